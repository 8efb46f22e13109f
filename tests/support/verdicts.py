"""How often verdicts on a renderer's speed are right, while another program uses the machine.

    .venv/bin/python tests/support/verdicts.py against compare found counts spread history > table.md
    .venv/bin/python tests/support/verdicts.py gates --busy 1 --programs 2 > gates.md
    .venv/bin/python tests/support/verdicts.py --read FILE .. > table.md     # of what earlier calls wrote to stderr

against: runs of a copy of `cpp` against another that differs in a comment. compare: pairs of such runs, one after the
other, with `cpp` itself in both, which tells the drift. found: runs of a copy that takes 5 % more time. counts: gates
on instructions, with the same work and with a loop of 1 % more. gates: `--fail-slower 5` on equal versions and on a
copy that takes 10 % more processor time. spread: counts of the same tree. history: 15 commits of `cpp` with a slowdown
put into the eighth.
"""

import argparse
import json
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(Path(__file__).parent)]

from competing import SPIN  # noqa: E402
from repositories import git  # noqa: E402

from reports.compare import compare, gate, versions  # noqa: E402
from reports.run import results  # noqa: E402
from reports.run.missing import Missing  # noqa: E402

PROGRAM = Path(sys.executable).with_name("rayrace")
FRAME = "        frame();\n"  # of main.cpp, where a batch of frames is made
WAIT = FRAME + "        for (const double from = begun, until = now() + {} * (now() - from); now() < until;) {{}}\n"
LOOP = FRAME + '        for (long turn = 0; turn < {}; turn++) __asm__ volatile("");\n'
SLOWER = 0.05  # more time
# A program works for a share of the processor time of each frame, as which others may interrupt it.
WORK = (
    FRAME + "        for (const auto until = std::clock() + {} * (std::clock() - from); std::clock() < until;) {{}}\n"
)
HEAVIER = 0.1  # more processor time
LIMIT = 5.0  # % of a gate on times
MORE = 0.01  # more instructions
GATE = 0.5  # % more instructions that pass
TURNS = 100_000  # of the empty loop, whose instructions tell what a turn takes
COMMITS, SLOWED = 15, 7
SLOWDOWN = 4 * TURNS  # some 5 % of the instructions of a frame of history.toml
EXPERIMENT = """title = "verdicts"
scenes = ["{scene}"]
renderers = {renderers}
processes = {processes}
frames = {frames}
timeout = "2 min"
[image]
width = 160
height = 120
depth = 4
[measure]
{measure}
[reference]
spots = 0
"""
SHORT, LONG = {"processes": 10, "frames": 10}, {"processes": 1000, "frames": 50}


class Bench:
    """A folder with copies of `cpp` and runs of them."""

    def __init__(self, folder: Path):
        self.folder, self.count = folder, 0

    def copy(self, name: str, change: Callable[[str], str] = str) -> Path:
        """Returns the folder of a renderer `mine`: `cpp` with another comment, and its main.cpp changed."""
        place = self.folder / name / "renderers" / "mine"
        shutil.copytree(ROOT / "renderers" / "cpp", place)
        rename(place)
        main = place / "main.cpp"
        main.write_text(f"// {name}\n{change(main.read_text())}")
        return place

    def run(self, renderer: Path, *words, renderers=("mine",), measure: str = "", code=(0,), **size) -> Path:
        """Returns the folder of a new run."""
        self.count += 1
        file, out = self.folder / "verdicts.toml", self.folder / "runs" / f"{self.count:04}"
        size = {**SHORT, **size}
        scene = ROOT / "experiments" / "scenes" / "comparison.txt"
        text = EXPERIMENT.format(scene=scene, renderers=json.dumps(list(renderers)), measure=measure, **size)
        file.write_text(text)
        call("run", file, "--renderer", renderer, "--out", out, *words, cwd=self.folder, code=code)
        return out


def rename(place: Path) -> None:
    """The renderer in a folder becomes `mine`, with a variant of one thread."""
    manifest = place / "renderer.toml"
    head, variant, *_ = manifest.read_text().split("\n[[variant]]")
    manifest.write_text(head.replace('"cpp"', '"mine"', 1) + "\n[[variant]]" + variant.replace('"cpp"', '"mine"', 1))


def call(*words, cwd: Path, code=(0,)) -> subprocess.CompletedProcess:
    done = subprocess.run([PROGRAM, *map(str, words)], cwd=cwd, capture_output=True, text=True)
    if done.returncode not in code:
        raise RuntimeError(f"{' '.join(map(str, words))}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}")
    return done


@contextmanager
def busy(share: float, programs: int = 1) -> Iterator[None]:
    """Other programs use a core each for a share of the time."""
    command = [sys.executable, "-c", SPIN, str(share)]
    others = [subprocess.Popen(command) for _ in range(programs if share else 0)]
    try:
        yield
    finally:
        for other in others:
            other.kill()
            other.wait()


def waits(text: str) -> str:
    """Each frame takes 5 % longer, however long it takes: a program that waits does no work that noise could change."""
    begin = "    for (long long i = 0; i < renders; i++) {\n"
    text = replaced(text, begin, begin + "        const double begun = now();\n")
    return replaced(text, FRAME, WAIT.format(SLOWER))


def works(text: str) -> str:
    """Each frame takes 10 % more of the processor's time."""
    begin = "    for (long long i = 0; i < renders; i++) {\n"
    text = "#include <ctime>\n" + replaced(text, begin, begin + "        const double from = std::clock();\n")
    return replaced(text, FRAME, WORK.format(HEAVIER))


def loops(turns: int) -> Callable[[str], str]:
    """Each frame has an empty loop of so many turns."""
    return lambda text: replaced(text, FRAME, LOOP.format(turns))


def replaced(text: str, old: str, new: str) -> str:
    if text.count(old) != 1:
        raise RuntimeError(f"main.cpp: expected one {old!r}")
    return text.replace(old, new)


def interval(ratio) -> str:
    return "" if ratio is None or ratio.low is None else f"{ratio.value:.3f} [{ratio.low:.3f}, {ratio.high:.3f}]"


# --- Each part yields a record of each of its trials ---


def against(bench: Bench, count: int) -> Iterator[dict]:
    one, other = bench.copy("one"), bench.copy("other")
    for _ in range(count):
        yield _held(bench.run(one, "--against", other))


def found(bench: Bench, count: int) -> Iterator[dict]:
    """The run goes on until its ratio is known to 2 %, for ten minutes at most."""
    slow, other = bench.copy("slow", waits), bench.copy("as it was")
    for _ in range(count):
        words = "--against", other, "--max-minutes", 10
        yield _held(bench.run(slow, *words, measure='until = "2 %"', **LONG))


def _held(folder: Path) -> dict:
    run = results.load(folder)
    (held,) = versions.comparisons(run)
    rounds = max(len(cell.rounds("steady_s")) for cell in run.cells)
    told = {"verdict": held.verdict, "why": held.reason, "ratio": interval(held.ratio)}
    return {**told, "rounds": rounds, "floor": run.floor.value}


def gates(bench: Bench, count: int) -> Iterator[dict]:
    copies = {"same": bench.copy("one"), "heavier": bench.copy("heavier", works)}
    other = bench.copy("other")
    for _ in range(count):
        for name, copy in copies.items():
            words = "--against", other, "--fail-slower", LIMIT
            folder = bench.run(copy, *words, code=tuple(gate.STATUS.values()), processes=20, frames=100)
            answer = gate.line(gate.of(results.load(folder), {"slower_percent": LIMIT, "budget": None}))
            yield {"copy": name, "answer": answer, **_held(folder)}


def pairs(bench: Bench, count: int) -> Iterator[dict]:
    copies = bench.copy("one"), bench.copy("other")
    before = None
    for number in range(count + 1):
        folder = bench.run(copies[number % 2], renderers=("cpp", "mine"))
        if before:
            told = compare.compare(before, folder)
            (row,) = (row for row in told.rows if row.name.startswith("mine"))
            yield {"verdict": row.time, "ratio": interval(row.ratio), "drift": told.drift.value}
        before = folder


COUNTED = {"processes": 1, "frames": 1, "measure": "count = true"}
COUNTED_VARIANTS = "cpp", "numba", "python"


def counts(bench: Bench, count: int) -> Iterator[dict]:
    """Each pair of runs by `compare --fail-more-instructions`."""
    same, probe = bench.copy("as it was"), bench.copy("probe", loops(TURNS))
    base, more = (_instructions(bench.run(one, **COUNTED), "mine") for one in (same, probe))
    turns = round(MORE * base * TURNS / (more - base))
    slow = bench.copy("slow", loops(turns))
    before = bench.run(same, **COUNTED)
    for _ in range(count):
        again, slower = bench.run(same, **COUNTED), bench.run(slow, **COUNTED)
        told = {}
        for name, one in (("same", again), ("more", slower)):
            words = "compare", before, one, "--fail-more-instructions", GATE
            told[name] = call(*words, cwd=bench.folder, code=(0, 1)).returncode
            told[f"{name} instructions"] = _instructions(one, "mine")
        yield {**told, "turns": turns}
        before = again


def spread(bench: Bench, count: int) -> Iterator[dict]:
    for _ in range(count):
        folder = bench.run(ROOT / "renderers", renderers=COUNTED_VARIANTS, **COUNTED)
        yield {name: _instructions(folder, name) for name in COUNTED_VARIANTS}


def _instructions(folder: Path, variant: str) -> float:
    run = results.load(folder)
    (cell,) = (cell for cell in run.cells if cell.variant == variant)
    told = run.counts(cell)
    if isinstance(told, Missing):
        raise RuntimeError(f"{variant}: {told}")
    return told["instructions"]


def history(bench: Bench, _: int) -> Iterator[dict]:
    """In a repository with the sources of `cpp` at each of its last commits."""
    tree = bench.folder / "tree"
    place = tree / "mine"
    log = git(ROOT, "log", "--format=%H", f"-{COMMITS}", "--", "renderers/cpp").split()
    place.mkdir(parents=True)
    git(tree, "init", "-q")
    hashes = []
    for number, commit in enumerate(reversed(log)):
        shutil.rmtree(place)
        archive = ["git", "-C", ROOT, "archive", commit, "renderers/cpp"]
        files = subprocess.run(archive, check=True, capture_output=True).stdout
        subprocess.run(["tar", "-x", "-C", tree], input=files, check=True)
        shutil.move(tree / "renderers" / "cpp", place)
        rename(place)
        main = place / "main.cpp"
        text = main.read_text()
        main.write_text(f"// {commit}\n{loops(SLOWDOWN)(text) if number >= SLOWED else text}")
        git(tree, "add", "-A")
        git(tree, "commit", "-qm", git(ROOT, "log", "-1", "--format=%s", commit).strip())
        hashes.append(git(tree, "rev-parse", "HEAD").strip())
    words = "history", "mine", "--commits", f"{hashes[0]}..HEAD", "--renderer", place, "--json"
    told = json.loads(call(*words, cwd=bench.folder).stdout)
    for step in told["steps"]:
        yield {**step, "commits": len(told["points"]), "put in": step["after"] == hashes[SLOWED]}
    for point in told["points"]:
        yield {"point": point["subject"], "instructions": point["instructions"], "why": point["no_instructions"]}


PARTS = {
    "against": (against, 100),
    "compare": (pairs, 100),
    "found": (found, 20),
    "counts": (counts, 20),
    "gates": (gates, 20),
    "spread": (spread, 5),
    "history": (history, 1),
}
TITLES = {
    "against": "two equal versions, `run --against`",
    "compare": "two equal versions, `compare` of two runs",
    "found": f'{100 * SLOWER:g} % more time, `run --against`, `until = "2 %"`',
    "history": f"`history`, with a slowdown put into commit {SLOWED + 1} of {COMMITS}",
}
OF_TIMES = {"same": "two equal versions", "heavier": f"{100 * HEAVIER:g} % more processor time"}
GATES = {"same": "equal versions", "more": f"a loop of {100 * MORE:g} % more instructions"}


def table(records: list[dict]) -> str:
    """The records of all parts, as Markdown."""
    lines = ["| what is compared | trials | verdicts |", "|---|---|---|"]
    for part in dict.fromkeys(one["part"] for one in records):
        lines += [f"| {' | '.join(map(str, row))} |" for row in _rows(part, [r for r in records if r["part"] == part])]
    return "\n".join(lines)


def _rows(part: str, records: list[dict]) -> Iterator[list]:
    title, count = TITLES.get(part, ""), len(records)
    if part in ("against", "compare"):
        yield [title, count, _counted(one["verdict"] for one in records)]
    elif part == "found":
        rounds, longest = np.median([one["rounds"] for one in records]), max(one["seconds"] for one in records)
        told = f"{rounds:.0f} rounds in the median, {longest / 60:.1f} minutes at most"
        yield [title, count, f"{_counted(one['verdict'] for one in records)}; {told}"]
    elif part == "gates":
        for name, words in OF_TIMES.items():
            answers = [one["answer"].split(": ")[1] for one in records if one["copy"] == name]
            yield [f"{words}, `run --against --fail-slower {LIMIT:g}`", len(answers), _counted(answers)]
    elif part == "counts":
        for name, told in GATES.items():
            verdicts = _counted("fail" if one[name] else "pass" for one in records)
            yield [f"{told}, `compare --fail-more-instructions {GATE}`", count, verdicts]
    elif part == "spread":
        for name in COUNTED_VARIANTS:
            values = [one[name] for one in records]
            share = 100 * (max(values) / min(values) - 1)
            yield [f"instructions of `{name}`, the same tree", count, f"they differ by {share:.2g} % at most"]
    else:
        steps = [one for one in records if "ratio" in one]
        told = [f"{one['ratio']:.3f} times at {'its' if one['put in'] else 'another'} commit" for one in steps]
        yield [title, 1, f"steps of the instructions: {', '.join(told)}" if told else "no step"]


def _counted(verdicts: Iterable[str]) -> str:
    return ", ".join(f"{count} {word}" for word, count in Counter(verdicts).most_common())


def main() -> None:
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # so that the other program ends, too
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("parts", nargs="*", help=", ".join(PARTS))
    asked.add_argument("--count", type=int, help="trials of each part")
    asked.add_argument("--busy", type=float, default=0.5, help="share of the time for which another program is busy")
    asked.add_argument("--programs", type=int, default=1, help="how many such programs")
    asked.add_argument("--read", nargs="*", type=Path, help="print the table of what earlier calls wrote to stderr")
    told, records = asked.parse_args(), []
    for file in told.read or ():
        records += [json.loads(line) for line in file.read_text().splitlines() if line.startswith("{")]
    for name in told.parts:
        part, count = PARTS[name]
        with tempfile.TemporaryDirectory() as folder, busy(told.busy, told.programs):
            began = time.monotonic()
            for record in part(Bench(Path(folder)), told.count or count):
                now = time.monotonic()
                records.append({"part": name, **record, "seconds": now - began})
                print(json.dumps(records[-1]), file=sys.stderr, flush=True)
                began = now
    print(table(records))


if __name__ == "__main__":
    main()
