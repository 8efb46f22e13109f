"""Who is compared with whom. Only a cell with a steady time and a judged, right picture takes part."""

from harness import statistics
from harness.statistics import Estimate
from reports.results import Cell, Missing, Results


def steady(cell: Cell) -> float:
    """Mean over processes of the steady times, s, of a cell that takes part."""
    return statistics.mean(cell.values("steady_s")).value


def ranked(results: Results, place: tuple[str, str]) -> list[Cell]:
    """The cells of a place that take part, the lowest mean of steady times first."""
    return sorted((cell for cell in results.at(place) if not cell.unranked), key=steady)


def baseline(results: Results, scene: str) -> str | None:
    """The variant that times of a scene are divided by: `cpp`, else the experiment's first that is ranked there."""
    there = [cell.variant for cell in results.cells if cell.scene == scene and not cell.unranked]
    return "cpp" if "cpp" in there else next(iter(there), None)


def ratio(cell: Cell, other: Cell) -> Estimate:
    """Steady time of `cell` over that of `other`, both ranked."""
    return statistics.ratio(cell.values("steady_s"), other.values("steady_s"))


def ratio_to(results: Results, cell: Cell, variant: str | None) -> Estimate | Missing | str:
    """`ratio` of a cell to `variant` at the same place; why there is none; text if it is that variant itself."""
    if cell.unranked:
        return Missing(f"not ranked: {cell.unranked}")
    other = next((c for c in results.at(cell.place) if c.variant == variant), None)
    if other is None or other.unranked:
        return Missing(f"{variant} is not ranked here")
    return "1 (the baseline)" if other is cell else ratio(cell, other)
