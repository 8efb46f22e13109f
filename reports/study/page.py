"""Writes docs/the-study.md: each claim and figure of the study with its verdict, from packed runs."""

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

`python docs/study.py` makes this page from those runs, each claim from the newest whole one that has what
it is about, or the newest that was cut short; claims and rules are in
[claims.toml](../reports/study/claims.toml). Square brackets hold 95 % intervals. `rayrace run ladder --report` shows
where the factor between the study's programs and ours goes, one change at a time.
"""


def write(reference: Path) -> str:
    """Returns the page. reference: a folder of machines, each a folder of packed runs."""
    with ExitStack() as opened:
        loaded = _runs(reference, opened)
        verdicts: Counter = Counter()
        parts = []
        for chapter in claims.chapters():
            rows = [_row(claim, loaded.get(claim.run, []), verdicts) for claim in chapter.claim]
            header = ["where", "what it claims", "verdict", "measured", "true if", "run", "why"]
            parts.append(f"## {markdown.escape(chapter.title)}\n\n{_table(header, rows)}")
    count = ", ".join(f"{number} {word}" for word, number in verdicts.most_common())
    return "\n\n".join([HEAD.rstrip(), f"{sum(verdicts.values())} claims: {count}.", *parts]) + "\n"


def _runs(reference: Path, opened: ExitStack) -> dict[str, list[tuple[str, results.Results]]]:
    """Returns the runs of each experiment that a claim names, with the names of their machines: whole ones first, of
    these the newest.
    """
    wanted = {claim.run for chapter in claims.chapters() for claim in chapter.claim} - {""}
    found: dict[str, list[tuple[str, results.Results]]] = {}
    for path in sorted(reference.glob("*/*.tar.xz")):
        if (name := packed.name(path)) in wanted:
            run = results.load(opened.enter_context(packed.opened(path)))
            found.setdefault(name, []).append((path.parent.name, run))
    return {name: sorted(runs, key=lambda one: _rank(one[1]), reverse=True) for name, runs in found.items()}


def _rank(run: results.Results) -> tuple[bool, str]:
    """Returns whether a run is whole, with as many processes of what ran as it asked for, and when it began."""
    processes = run.facts["experiment"]["processes"]
    return all(len(cell.timed) >= processes for cell in run.cells if cell.counting), run.facts["started"]


def _row(claim: Claim, runs: list[tuple[str, results.Results]], verdicts: Counter) -> list[str]:
    """Returns a claim's row, decided by the first of `runs` that has what the claim is about."""
    made = [(machine, verdict.decide(claim, run)) for machine, run in runs] or [("", verdict.decide(claim, None))]
    machine, decided = next((one for one in made if one[1].verdict != "unavailable"), made[0])
    verdicts[decided.verdict] += 1
    where = f"{claim.run}, {machine}" if machine else claim.run
    return [claim.place, claim.says, decided.verdict, decided.measured, claim.rule, where, claim.why]


def _table(header: list[str], rows: list[list[str]]) -> str:
    """Returns a table of plain texts that keeps every column, as each row is read alone."""
    lines = [header, ["---"] * len(header), *([markdown.escape(text) for text in row] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
