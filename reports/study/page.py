"""Writes docs/the-study.md: each claim and figure of the study with its verdict, from packed runs."""

import tomllib
from collections import Counter
from contextlib import ExitStack
from pathlib import Path

from harness.store import packed
from reports.paper import markdown
from reports.run import results
from reports.study import claims, verdict
from reports.study.claims import Claim

HEAD = """# The study: every claim a verdict

The study is Kerman Alonso Ajuria's *Implementation and performance analysis of several versions of a Realistic Ray
Tracer (Python, CUDA and C++)* (University of the Basque Country, 2020). This page lists its tables, its figures of
results, its equation of cost, and what its chapters 2 to 5 claim, in our words, by section.

- **true**: it holds for the programs of the run that is named, on that machine; **false**: it does not. The study's
  numbers stay true of its own program.
- **not decided**: the interval of what was measured reaches over the bound of "true if".
- **not testable here**: nothing that can be measured decides it; the reason stands beside it.
- **unavailable**: the experiment decides it, and no run of it is in
  [results/reference](../results/reference/README.md), or that run lacks a device.

`python docs/study.py` makes this page from those runs. Where several machines have a run, a claim is decided by a
whole one before one that was cut short, by one with as many processes as the experiment asks for now before one with
fewer, and by the newest of these that has what the claim is about; `run` names its machine and its processes. Claims
are in [claims.toml](../reports/study/claims.toml), each with the quantity that it is about, and only the rules and
columns that measure this quantity may decide it. Square brackets hold 95 % intervals.
`rayrace run ladder --report` shows where the factor between the study's programs and ours goes, one change at a time.
"""


def write(reference: Path) -> str:
    """Returns the page. reference: a folder of machines, each a folder of packed runs."""
    with ExitStack() as opened:
        loaded = _runs(reference, opened)
        verdicts: Counter = Counter()
        parts = []
        for chapter in claims.chapters():
            rows = [_row(claim, loaded.get(claim.run, []), verdicts) for claim in chapter.claim]
            header = ["where", "what it claims", "verdict", "quantity", "measured", "true if", "run", "why"]
            parts.append(f"## {markdown.escape(chapter.title)}\n\n{_table(header, rows)}")
    count = ", ".join(f"{number} {word}" for word, number in verdicts.most_common())
    return "\n\n".join([HEAD.rstrip(), f"{sum(verdicts.values())} claims: {count}.", *parts]) + "\n"


def _runs(reference: Path, opened: ExitStack) -> dict[str, list[tuple[str, results.Results]]]:
    """Returns the runs of each experiment that a claim names, with the names of their machines, the best first
    (_rank).
    """
    wanted = {claim.run for chapter in claims.chapters() for claim in chapter.claim} - {""}
    by_experiment: dict[str, list[tuple[str, results.Results]]] = {}
    for path in sorted(reference.glob("*/*.tar.xz")):
        if (name := packed.name(path)) in wanted:
            run = results.load(opened.enter_context(packed.opened(path)))
            by_experiment.setdefault(name, []).append((path.parent.name, run))
    experiments = reference.parents[1] / "experiments"
    processes = {
        name: tomllib.loads((experiments / f"{name}.toml").read_text("utf-8"))["processes"] for name in by_experiment
    }
    return {
        name: sorted(runs, key=lambda pair: _rank(pair[1], processes[name]), reverse=True)
        for name, runs in by_experiment.items()
    }


def _rank(run: results.Results, wanted: int) -> tuple[bool, int, str]:
    """Returns whether a run has all the processes of its time, how many of those that the experiment asks for now, and
    when it began. It knows nothing of verdicts: a run is not chosen for what it decides.
    """
    processes = _processes(run)
    whole = all(len(cell.timed) >= processes for cell in run.cells if cell.counting)
    return whole, min(processes, wanted), run.facts["started"]


def _processes(run: results.Results) -> int:
    return run.facts["experiment"]["processes"]


def _row(claim: Claim, runs: list[tuple[str, results.Results]], verdicts: Counter) -> list[str]:
    """Returns a claim's row, decided by the first of `runs` that has what the claim is about."""
    made = [(_where(claim, *pair), verdict.decide(claim, pair[1])) for pair in runs]
    made = made or [(claim.run, verdict.decide(claim, None))]
    where, decided = next((candidate for candidate in made if candidate[1].verdict != "unavailable"), made[0])
    verdicts[decided.verdict] += 1
    cells = [decided.verdict, claim.quantity, decided.measured, claim.rule, where, claim.why]
    return [claim.place, claim.says, *cells]


def _where(claim: Claim, machine: str, run: results.Results) -> str:
    count = _processes(run)
    return f"{claim.run}, {machine}, {count} process{'es' if count > 1 else ''}"


def _table(header: list[str], rows: list[list[str]]) -> str:
    """Returns a table of plain texts that keeps every column, as each row is read alone."""
    lines = [header, ["---"] * len(header), *([markdown.escape(text) for text in row] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
