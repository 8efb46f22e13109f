"""Compares the instructions of a frame of two cells, in two runs that counted them (the pass "count")."""

from dataclasses import dataclass

from reports.run.results import Cell, Missing, Results

SAME = "tool", "version", "width", "height", "options", "environment"  # of counts that can be compared


@dataclass(frozen=True)
class Counts:
    """Instructions of a frame in A and in B, ratio: b / a; all None for `reason`."""

    a: float | None = None
    b: float | None = None
    ratio: float | None = None
    reason: str = ""

    def more(self, percent: float) -> bool:
        """Does B take more by more than `percent`?"""
        return self.ratio is not None and self.ratio > 1 + percent / 100

    @property
    def text(self) -> str:
        if self.ratio is None:
            return f"instructions not compared: {self.reason}"
        return f"instructions {self.a:.6g} -> {self.b:.6g}, B / A = {self.ratio:.4f}"


def compare(a: Results, b: Results, cell_a: Cell, cell_b: Cell) -> Counts | None:
    """Returns the counts of a cell in run A and in run B; None if neither run counted anything."""
    if not (a.counted or b.counted):
        return None
    one, other = a.counts(cell_a), b.counts(cell_b)
    missing = [
        f"in {name}: {counts.reason}" for name, counts in (("A", one), ("B", other)) if isinstance(counts, Missing)
    ]
    if missing:
        return Counts(reason="; ".join(missing))
    if changed := [f"{name} {one.get(name)} -> {other.get(name)}" for name in SAME if one.get(name) != other.get(name)]:
        return Counts(reason=f"counted in another way: {', '.join(changed)}")
    before, now = one["instructions"], other["instructions"]
    return Counts(before, now, now / before)
