"""Writes docs/the-study.md: each claim and figure of the study with its verdict, from packed runs."""

from collections import Counter
from collections.abc import Callable
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

`python docs/study.py` makes this page from those runs; claims and rules are in
[claims.toml](../reports/study/claims.toml). Square brackets hold 95 % intervals. `rayrace run ladder --report` shows
where the factor between the study's programs and ours goes, one change at a time.
"""


def write(reference: Path) -> str:
    """Returns the page. reference: a folder of machines, each a folder of packed runs; of an experiment the newest."""
    with ExitStack() as opened:
        loaded = _newest(reference, opened)
        verdicts: Counter = Counter()
        parts = []
        for chapter in claims.chapters():
            rows = [_row(claim, loaded, verdicts) for claim in chapter.claim]
            header = ["where", "what it claims", "verdict", "measured", "true if", "run", "why"]
            parts.append(f"## {markdown.escape(chapter.title)}\n\n{_table(header, rows)}")
    count = ", ".join(f"{number} {word}" for word, number in verdicts.most_common())
    return "\n\n".join([HEAD.rstrip(), f"{sum(verdicts.values())} claims: {count}.", *parts]) + "\n"


def _newest(reference: Path, opened: ExitStack) -> Callable[[str], tuple[str, results.Results] | None]:
    """Returns a function that loads the newest run of an experiment, with the name of its machine, once."""
    wanted = {claim.run for chapter in claims.chapters() for claim in chapter.claim} - {""}
    found: dict[str, tuple[str, results.Results]] = {}
    for path in sorted(reference.glob("*/*.tar.xz")):
        if (name := packed.name(path)) in wanted:
            run = results.load(opened.enter_context(packed.opened(path)))
            if name not in found or found[name][1].facts["started"] < run.facts["started"]:
                found[name] = path.parent.name, run
    return found.get


def _row(claim: Claim, loaded: Callable, verdicts: Counter) -> list[str]:
    machine, run = loaded(claim.run) or ("", None)
    decided = verdict.decide(claim, run)
    verdicts[decided.verdict] += 1
    where = f"{claim.run}, {machine}" if machine else claim.run
    return [claim.place, claim.says, decided.verdict, decided.measured, claim.rule, where, claim.why]


def _table(header: list[str], rows: list[list[str]]) -> str:
    """Returns a table of plain texts that keeps every column, as each row is read alone."""
    lines = [header, ["---"] * len(header), *([markdown.escape(text) for text in row] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
