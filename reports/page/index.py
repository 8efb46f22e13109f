"""Writes a page for a folder of runs: a card for each, the newest first, with a link to its report.

A report is made if it is missing, or if the run or rayrace has changed since. Nothing is ever removed.
"""

import hashlib
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import reports
from harness.errors import UserError
from harness.store import packed
from harness.system import output
from reports import page
from reports.page import card, several
from reports.page.card import Card
from reports.paper import markdown

NAME = "index.html"
FRESH = ".rayrace-fresh"  # in the folder of a report: what it was made from
DEEPEST = 3  # folders within each other in which runs are looked for
TEXTS = "run.json", "end.json", "repetitions.jsonl", "jobs.jsonl"
CODE = "*.py", "*.css", "*.js", "*.jinja"
NO_RUN = "holds no run (no run.json, no .tar.xz)"


def make(folder: Path, out: Path, pool: bool = False, say: Callable[[str], None] = lambda _: None) -> Path:
    """Writes `out`/index.html and `out`/NAME/report.html for each run in `folder`; returns the path of the page.

    say: is told of each report that is made. UserError if there is no run.
    """
    paths, skipped = runs(folder, out)
    if not paths:
        remedy = "name a folder that `rayrace run` wrote, a packed run (.tar.xz), or a folder of such"
        raise UserError(f"{folder}: neither a run nor a folder of runs", remedy=remedy)
    several.may_write(out)
    several.begin(out)
    links: list[tuple[Card, str]] = []
    places = [out / name for name in names(folder, paths)]
    with several.workers(len(paths)) as writing:
        refreshed = [writing.submit(_refresh, path, place, pool) for path, place in zip(paths, places, strict=True)]
        for path, place, made in zip(paths, places, refreshed, strict=True):
            try:
                if made.result():
                    say(f"report: {place / page.NAME}")
                cards = [(card.read(report), report) for report in sorted(_with_cards(place))]
            except (UserError, OSError) as error:
                skipped.append((path, str(error)))
                continue
            links += [(run_card, (report / page.NAME).relative_to(out).as_posix()) for run_card, report in cards]
    links.sort(key=lambda link: link[0].begun, reverse=True)
    machines = len({run_card.machine for run_card, _ in links})
    lead = f"{_count(len(links), 'run')} on {_count(machines, 'machine')}, the newest first"
    return page.write_several(f"Runs in {folder.resolve().name}", lead, _skipped(folder, skipped), links, out / NAME)


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'s' * (number != 1)}"


def _skipped(folder: Path, skipped: list[tuple[Path, str]]) -> list[tuple[str, str]]:
    """Returns a section on what is no run, or a damaged one."""
    lines = [markdown.escape(f"{path.relative_to(folder)}: {why}") for path, why in sorted(skipped)]
    return [("skipped", f"## Skipped: {len(lines)}\n\n{markdown.bullets(lines)}")] if lines else []


def runs(folder: Path, out: Path, deep: int = 1) -> tuple[list[Path], list[tuple[Path, str]]]:
    """Returns the runs in a folder and in its folders, packed ones too, and the folders that hold none, with reasons.

    Reports and hidden folders are passed over.
    """
    paths, skipped = [], []
    for path in sorted(folder.iterdir()):
        if path.name.startswith(".") or path.resolve() == out.resolve() or (path / several.MARK).exists():
            continue
        if packed.is_packed(path) or (path / "run.json").exists():
            paths.append(path)
        elif path.is_dir():
            inside, _ = runs(path, out, deep + 1) if deep < DEEPEST and not path.is_symlink() else ([], [])
            paths += inside
            skipped += [(path, NO_RUN)] * (not inside)
    return paths, skipped


def names(folder: Path, paths: list[Path]) -> list[str]:
    """Returns a name for the report of each run, made of its path in the folder; no two are the same."""
    made: list[str] = []
    for path in paths:
        parts = (*path.relative_to(folder).parent.parts, packed.name(path))
        name = wanted = markdown.slug("-".join(parts))
        number = 2
        while name in made:
            name, number = f"{wanted}-{number}", number + 1
        made.append(name)
    return made


def _refresh(run: Path, out: Path, pool: bool) -> bool:
    """Makes the report of a run unless it is fresh; returns whether it was made."""
    mark, now = out / FRESH, fingerprint(run, pool)
    if mark.exists() and mark.read_text("utf-8") == now and _with_cards(out):
        return False
    if mark.exists():
        output.text(mark, "")  # of a report that is being made
    several.make([run], out, pool)
    output.text(mark, now)
    return True


def _with_cards(out: Path) -> list[Path]:
    """Returns the folders of reports in a folder that have a card: itself, or one for each host."""
    return [path.parent for path in [out / card.FILE, *out.glob(f"*/{card.FILE}")] if path.exists()]


def fingerprint(run: Path, pool: bool = False) -> str:
    """Returns a hash of what a report is made from: the rows of a run, the names of its other files, and rayrace."""
    digest = hashlib.sha256(f"{_code()} {pool}".encode())
    if packed.is_packed(run):
        with open(run, "rb") as file:
            digest.update(hashlib.file_digest(file, "sha256").digest())
        return digest.hexdigest()
    for path in sorted(run.rglob("*")):
        inside = path.relative_to(run)
        if inside.parts[0] == "report" or not path.is_file():
            continue
        digest.update(f"{inside.as_posix()} {path.stat().st_size}\n".encode())
        if path.name in TEXTS:
            with open(path, "rb") as file:
                digest.update(hashlib.file_digest(file, "sha256").digest())
    return digest.hexdigest()


@lru_cache(maxsize=1)
def _code() -> str:
    """Returns a hash of the code that makes reports."""
    digest = hashlib.sha256()
    for package in (Path(reports.__file__).parent, Path(packed.__file__).parents[1]):  # reports and harness
        for kind in CODE:
            for path in sorted(package.rglob(kind)):
                if not path.name.endswith(".min.js"):
                    digest.update(path.read_bytes())
    return digest.hexdigest()
