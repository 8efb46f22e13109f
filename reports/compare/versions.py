"""Compares two versions of a renderer that ran interleaved in one run (`rayrace run --against`)."""

from dataclasses import dataclass
from pathlib import Path

from harness.errors import UserError
from harness.statistics import statistics
from harness.statistics.statistics import Estimate
from reports.paper import markdown, quantity
from reports.run import naming
from reports.run.results import Cell, Missing, Results

INCOMPARABLE = "not comparable"
CAPTION = (
    "Time of a steady frame of this version over that of the other, paired by round. The intervals hold together: with "
    "95 % all of them hold (Bonferroni). Faster or slower is a ratio whose whole interval differs from 1, and which "
    "differs from 1 by more than the noise floor of the run."
)


@dataclass(frozen=True)
class Held:
    """A cell of this version held against the same of another.

    ratio: its time over the other's. verdict: slower, faster, not resolved, or not comparable, for `reason`. broken:
    the other is ok and this is not.
    """

    name: str
    other: str
    ratio: Estimate | None
    verdict: str
    reason: str
    broken: bool

    @property
    def text(self) -> str:
        """The result in a line."""
        if self.ratio is None or self.verdict == INCOMPARABLE:
            return f"{self.name}: {self.verdict}: {self.reason}"
        return f"{self.name}: {self.verdict}: {quantity.text(self.ratio)} × the time of {self.other}"

    def slower_by(self, percent: float) -> bool:
        """Is it slower by more than `percent` with its whole interval?"""
        return self.verdict == "slower" and self.ratio.low > 1 + percent / 100


def comparisons(results: Results) -> list[Held]:
    """Returns each cell that a run held against another version; [] of other runs."""
    others = {against["variant"]: against["other"] for against in results.facts.get("against", [])}
    there = {(cell.place, cell.variant, cell.parameters["threads"]): cell for cell in results.cells}
    pairs = [
        (cell, there[cell.place, others[cell.variant], cell.parameters["threads"]])
        for cell in results.cells
        if cell.variant in others
    ]
    names = naming.names([cell for cell, _ in pairs])
    return [_held(results, name, cell, other, len(pairs)) for name, (cell, other) in zip(names, pairs, strict=True)]


def _held(results: Results, name: str, cell: Cell, other: Cell, count: int) -> Held:
    """count: of the intervals that hold together."""
    broken = other.status == "ok" != cell.status
    unranked = [f"{side.label}: {side.unranked}" for side in (cell, other) if side.unranked]
    if unranked:
        return Held(name, other.label, None, INCOMPARABLE, "; ".join(unranked), broken)
    above, below = cell.rounds("steady_s"), other.rounds("steady_s")
    both = sorted(above.keys() & below.keys())
    if not both:
        return Held(name, other.label, None, INCOMPARABLE, "no round has a steady time of both", broken)
    level = 1 - (1 - statistics.LEVEL) / count
    ratio = statistics.ratio([above[n] for n in both], [below[n] for n in both], paired=True, level=level)
    verdict = INCOMPARABLE if ratio.low is None else statistics.verdict(ratio, results.floor.value)
    return Held(name, other.label, ratio, verdict, ratio.note, broken)


def verdict(rows: list[Held]) -> str:
    """Returns the result of all cells in a line."""
    if len(rows) == 1:
        return rows[0].text
    counts = {word: sum(row.verdict == word for row in rows) for word in ("slower", "faster", statistics.NOT_RESOLVED)}
    apart = len(rows) - sum(counts.values())
    parts = [f"{count} {word}" for word, count in {**counts, INCOMPARABLE: apart}.items() if count]
    resolved = [row for row in rows if row.verdict in ("slower", "faster")]
    worst = max(resolved, key=lambda row: statistics.difference(row.ratio.value), default=None)
    return ", ".join(parts) + (f"; most: {worst.text}" if worst else "")


def failures(rows: list[Held], percent: float) -> list[str]:
    """Returns why a gate at `percent` fails, [] if it passes. UserError if nothing could be compared."""
    if all(row.ratio is None or row.ratio.low is None for row in rows) and not any(row.broken for row in rows):
        reasons = "; ".join(dict.fromkeys(f"{row.name}: {row.reason}" for row in rows))
        raise UserError(f"--fail-slower: no cell could be compared: {reasons}")
    slower = [f"slower by more than {percent:g} %: {row.text}" for row in rows if row.slower_by(percent)]
    return slower + [f"no longer ok: {row.text}" for row in rows if row.broken]


def write(results: Results, _: Path | None = None) -> str:
    """Returns the section of the report; "" of a run without another version."""
    compared = comparisons(results)
    if not compared:
        return ""
    rows = [[row.name, row.other, _ratio(row), row.verdict, "" if row.ratio else row.reason] for row in compared]
    header = ["this version", "other version", "time ÷ the other's", "verdict", ""]
    if not any(row[-1] for row in rows):
        header, rows = header[:-1], [row[:-1] for row in rows]
    body = markdown.table(header, rows)
    return "\n\n".join(["## This version against another", markdown.escape(f"{verdict(compared)}."), body, CAPTION])


def _ratio(row: Held) -> str:
    return quantity.text(Missing(row.reason) if row.ratio is None else row.ratio)
