"""Compares two versions of a renderer that ran interleaved in one run (`rayrace run --against`)."""

from dataclasses import dataclass
from pathlib import Path

from harness.statistics import statistics
from harness.statistics.statistics import Estimate
from reports.compare import witness
from reports.compare.witness import Witness
from reports.paper import markdown, quantity
from reports.run import naming, repetition
from reports.run.results import Cell, Missing, Results

INCOMPARABLE = "not comparable"
CAPTION = (
    "Time of a steady frame of this version over that of the other, paired by round. The intervals hold together: with "
    "95 % all of them hold (Bonferroni). Faster or slower is a ratio whose whole interval differs from 1, and which "
    "differs from 1 by more than the noise floor of the run. Where others had the processor during at least half of "
    "the processes, the median of frames is biased, as a frame is interrupted or not: CPU time then stands in its "
    "place, of one thread on a processor, else the mean over frames."
)


@dataclass(frozen=True)
class Held:
    """A cell of this version held against the same of another.

    ratio: its time over the other's, of the times that `witness` chose. verdict: slower, faster, not resolved, or not
    comparable, for `reason`. broken: the other is ok and this is not. wanted: the other is ok, so that there is
    something to hold this against. floor: the noise floor of these times. wall: the ratio of mean wall times beside one
    of CPU times, else None.
    """

    name: str
    other: str
    ratio: Estimate | None
    verdict: str
    reason: str
    broken: bool
    wanted: bool = True
    witness: Witness | None = None
    floor: float | None = None
    wall: Estimate | None = None

    @property
    def text(self) -> str:
        """The result in a line."""
        if self.ratio is None or self.verdict == INCOMPARABLE:
            return f"{self.name}: {self.verdict}: {self.reason}"
        beside = f" (wall time: {quantity.text(self.wall)})" if self.wall else ""
        ratio = f"{quantity.text(self.ratio)} × the {self.witness.name} of {self.other}{beside}"
        return f"{self.name}: {self.verdict}: {ratio}" + (f", as {self.witness.why}" if self.witness.why else "")


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
    wanted = other.status == "ok" and not other.as_meant
    if unranked:
        return Held(name, other.label, None, INCOMPARABLE, "; ".join(unranked), broken, wanted)
    level, chosen = 1 - (1 - statistics.LEVEL) / count, witness.of((results, cell), (results, other))
    ratio = _ratio_of_rounds(cell, other, chosen.column, level)
    if ratio is None:
        return Held(name, other.label, None, INCOMPARABLE, "no round has a steady time of both", broken, wanted)
    floor = results.floor_by(chosen.column).value
    verdict = INCOMPARABLE if ratio.low is None else statistics.verdict(ratio, floor)
    wall = _ratio_of_rounds(cell, other, repetition.MEAN, level) if chosen.column == repetition.CPU else None
    return Held(name, other.label, ratio, verdict, ratio.note, broken, wanted, chosen, floor, wall)


def _ratio_of_rounds(cell: Cell, other: Cell, column: str, level: float) -> Estimate | None:
    above, below = cell.rounds(column), other.rounds(column)
    both = sorted(above.keys() & below.keys())
    if not both:
        return None
    return statistics.ratio([above[n] for n in both], [below[n] for n in both], paired=True, level=level)


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
