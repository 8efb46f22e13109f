"""Compares the instructions of a frame of two cells, in two runs that counted them (the pass "count")."""

from dataclasses import dataclass

from reports.exporters.budget import WAY
from reports.run.results import Cell, Missing, Results


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
    return of_two(a.counts(cell_a), b.counts(cell_b), "A", "B")


def of_two(first: dict | Missing, other: dict | Missing, name: str, other_name: str) -> Counts:
    """Returns the comparison of two counts; names are for the reason why there is none."""
    both = (name, first), (other_name, other)
    missing = [f"in {which}: {counts.reason}" for which, counts in both if isinstance(counts, Missing)]
    if missing:
        return Counts(reason="; ".join(missing))
    if changed := [f"{key} {first.get(key)} -> {other.get(key)}" for key in WAY if first.get(key) != other.get(key)]:
        return Counts(reason=f"counted in another way: {', '.join(changed)}")
    before, now = first["instructions"], other["instructions"]
    return Counts(before, now, now / before)
