"""Ranks cells: only a cell with a steady time and a judged, right picture takes part."""

from dataclasses import replace

from harness.statistics import statistics
from harness.statistics.statistics import Estimate
from reports.run.results import Cell, Missing, Results


def ranked(results: Results, place: tuple[str, str]) -> list[Cell]:
    """The cells of a place that take part, the lowest median of steady times first."""
    return sorted((cell for cell in results.at(place) if not cell.unranked), key=lambda cell: cell.steady.value)


def baseline(results: Results, scene: str) -> str | None:
    """The variant that times of a scene are divided by: `cpp`, else the experiment's first that is ranked there."""
    there = [cell.variant for cell in results.of(scene) if not cell.unranked]
    return "cpp" if "cpp" in there else next(iter(there), None)


def ratio(cell: Cell, other: Cell, column: str = "steady_s") -> Estimate:
    """Time of `cell` over that of `other`, which both have: paired by round, if there are enough that both were in."""
    above, below = cell.rounds(column), other.rounds(column)
    both = sorted(above.keys() & below.keys())
    if len(both) < statistics.LEAST:
        return statistics.ratio(list(above.values()), list(below.values()))
    return statistics.ratio([above[number] for number in both], [below[number] for number in both], paired=True)


def resolved(results: Results, ratio: Estimate) -> bool:
    """Is it surely not 1, and further from it than the noise floor of the run?"""
    return statistics.verdict(ratio, results.floor.value) != statistics.NOT_RESOLVED


def ratio_to(results: Results, cell: Cell, variant: str | None) -> Estimate | Missing | str:
    """`ratio` of a cell to `variant` at the same place; why there is none; text if it is that variant itself."""
    if cell.unranked:
        return Missing(f"not ranked: {cell.unranked}")
    other = next((c for c in results.at(cell.place) if c.variant == variant), None)
    if other is None or other.unranked:
        return Missing(f"{variant} is not ranked here")
    if other is cell:
        return "1 (the baseline)"
    found = ratio(cell, other)
    return replace(found, note=found.note or statistics.verdict(found, results.floor.value))
