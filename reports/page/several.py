"""Writes the report of one run or of several, in folders or packed.

Each of several runs gets a report in a folder of its own; one page compares machines and runs and repeats the study.
"""

import tempfile
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from pathlib import Path

from harness.errors import UserError
from harness.statistics.statistics import Floor
from harness.store import confined, likeness, packed, store
from harness.system import output, trouble
from reports import page
from reports.compare import hosts, side_by_side
from reports.compare.hosts import Member
from reports.page import card, report, study_again
from reports.page.card import Card
from reports.paper import drawn, form, markdown, quantity
from reports.paper.form import Form
from reports.run import results

TITLE = "Several runs"
MARK = ".rayrace-report"  # a file in the folder of a report


def make(runs: list[Path], out: Path, pool: bool = False, shape: Form = form.PAGE) -> Path:
    """Writes the report of the runs into the folder `out`; returns the path of its report.html.

    A run on several hosts of a cluster counts as one run per host. pool: hosts that differ only in their names count
    as one machine. shape: of figures and tables.
    """
    may_write(out)
    with ExitStack() as stack, form.written_in(shape):
        folders = [stack.enter_context(packed.opened(run)) for run in runs]
        loaded = [run for folder in folders for run in _by_host(folder, pool)]
        begin(out)  # nothing is written before all runs were checked
        if len(loaded) == 1:
            report.write_loaded(loaded[0][1], out)
            card.write(loaded[0][1], out)
            return out / page.NAME
        members = hosts.members(loaded)
        # The largest first, so that none is written alone in the end.
        order = sorted(members, key=lambda member: -len(member.results.cells))
        with workers(len(members)) as writing:
            written = writing.map(_report, [(member.results, out / member.name, shape) for member in order])
            made = dict(zip(order, written, strict=True))
        texts = {member: made[member][0] for member in members}
        cards = [(made[member][1], f"{member.name}/{page.NAME}") for member in members]
        parts = [
            ("several_runs", _runs(members)),
            ("unlike", _unlike(folders)),
            ("several_machines", hosts.write(members)),
            ("side_by_side", side_by_side.write(members, out)),
            ("study_again", study_again.write(members, texts)),
        ]
        parts = [(name, text) for name, text in parts if text]
        output.text(out / "report.md", "\n\n".join([f"# {TITLE}", *(text for _, text in parts)]) + "\n")
        return page.write_several(TITLE, _lead(members), parts, cards, out / page.NAME)


def workers(reports: int) -> ProcessPoolExecutor:
    """Returns processes that write so many reports, one on each usable core at most."""
    return ProcessPoolExecutor(max(1, min(reports, len(trouble.usable()))))


def _report(job: tuple[results.Results, Path, Form]) -> tuple[list[str], Card]:
    """Writes the report of a run into a folder, in a form; returns the texts of its sections, and its card."""
    loaded, out, shape = job
    with form.written_in(shape):
        return [text for _, text in report.write_loaded(loaded, out)], card.write(loaded, out)


def may_write(out: Path) -> None:
    """UserError if the folder of a report holds other files, or a link, or is one; nothing is written."""
    if out.is_symlink():
        raise UserError(f"{out}: a link; nothing is written through it", remedy="name the folder itself with -o")
    mark, page_file = out / MARK, out / page.NAME
    try:
        if out.exists() and not mark.exists() and any(out.iterdir()):
            with open(page_file, "rb") as file:  # of version 0.1, which had no mark
                if b" - rayrace</title>" not in file.read(4096):
                    raise FileNotFoundError
    except (FileNotFoundError, IsADirectoryError):
        why = f"{out}: holds files that do not belong to a report"
        raise UserError(why, remedy="give -o an empty folder or a new one") from None
    confined.check_output(out)


def begin(out: Path) -> None:
    """Makes and marks the folder of a report, whose files may be overwritten."""
    output.make_folder(out)
    output.text(out / MARK, "This folder is a report of rayrace: `rayrace report` overwrites the files in it.\n")


def _by_host(folder: Path, pool: bool) -> list[tuple[str, results.Results]]:
    """Returns the run in a folder as (name, run), split by host, or by kind of host if `pool`."""
    name, there = markdown.slug(packed.name(folder)), store.hosts(folder)
    if len(there) < 2:
        return [(name, results.load(folder))]
    groups: list[list[str]] = []
    for host, facts in there.items():
        alike = (group for group in groups if pool and likeness.is_alike(there[group[0]], facts))
        group = next(alike, None)
        if group is None:
            groups.append([host])
        else:
            group.append(host)
    if len(groups) == 1:
        return [(name, results.load(folder, groups[0]))]
    return [(f"{name}-{markdown.slug(there[group[0]]['host'])}", results.load(folder, group)) for group in groups]


def _unlike(folders: list[Path]) -> str:
    """Returns the sections on hosts of one partition that differ, and on repetitions that no host has run."""
    parts = []
    if differ := [markdown.escape(line) for folder in folders for line in likeness.of_run(folder)]:
        parts += ["## Not alike", markdown.bullets(differ)]
    if lost := [line for folder in folders for line in _lost(folder)]:
        parts += ["## Not run", markdown.bullets(lost)]
    return "\n\n".join(parts)


def _lost(folder: Path) -> list[str]:
    """Lists the repetitions that the jobs of a run have not run, a line for each reason."""
    _, records = store.read(folder, list(store.hosts(folder)))
    reasons = Counter((record["status"], record["reason"]) for record in records if record.get("lost"))
    return [
        markdown.escape(f"{packed.name(folder)}: {count} processes: {status}: {reason}")
        for (status, reason), count in reasons.items()
    ]


def check(runs: list[Path], old: Path, pool: bool = False) -> list[str]:
    """Lists the figures and tables in the folder `old` whose data differ from a new report of the same runs."""
    if not (old / "report.md").exists():
        paths = " ".join(map(str, runs))
        raise UserError(f"{old}: holds no report", remedy=f"make one with: rayrace report {paths} -o {old}")
    confined.check_output(old)
    with tempfile.TemporaryDirectory() as made:
        make(runs, Path(made), pool)
        return drawn.differences(old, Path(made))


def _lead(members: list[Member]) -> str:
    machines = hosts.by_host(members)
    count = sum(len(member.results.records) for member in members)
    several = f"{len(machines)} machines: {', '.join(machines)}" if len(machines) > 1 else "one machine"
    return f"{len(members)} runs, {count} processes, on {several}. Runs and machines are not pooled."


def _runs(members: list[Member]) -> str:
    header = ["machine", "run", "title", "begun", "commit", "processes", "ok cells", "noise floor"]
    rows = []
    for member in members:
        facts, cells = member.results.facts, member.results.cells
        good = sum(cell.status == "ok" for cell in cells)
        rows.append([
            member.host, member.name, facts["title"], facts["started"][:16].replace("T", " "),
            facts["environment"]["commit"], str(len(member.results.records)), f"{good} of {len(cells)}",
            _floor(member.results.floor),
        ])  # fmt: skip
    links = [f"[{markdown.escape(member.name)}]({member.name}/{page.NAME})" for member in members]
    return "\n\n".join(
        ["## Runs", markdown.table(header, rows), "Each run has its own report: " + ", ".join(links) + "."]
    )


def _floor(floor: Floor) -> str:
    return f"unavailable: {floor.reason}" if floor.value is None else quantity.percentage(floor.value)
