"""Ranks cells with a steady time and a judged, right picture, and divides their times."""

from dataclasses import replace
from statistics import geometric_mean

from harness.statistics import statistics
from harness.statistics.statistics import Estimate
from reports.run.results import Cell, Missing, Results


def ranked(results: Results, place: tuple[str, str]) -> list[Cell]:
    """Returns the ranked cells of a place, the lowest median of steady times first."""
    return sorted((cell for cell in results.at(place) if not cell.unranked), key=lambda cell: cell.steady.value)


def baseline(results: Results, scene: str) -> str | None:
    """Returns the variant that divides the times of a scene: `cpp`, else the first ranked one; None without any."""
    there = [cell.variant for cell in results.of(scene) if not cell.unranked]
    return "cpp" if "cpp" in there else next(iter(there), None)


def base(results: Results, place: tuple[str, str], variant: str | None) -> Cell | None:
    """Returns the ranked cell of a variant at a place, of several the one with the fewest threads; None without any."""
    cells = [cell for cell in results.at(place) if cell.variant == variant and not cell.unranked]
    return min(cells, key=lambda cell: cell.parameters["threads"], default=None)


def ratio(cell: Cell, other: Cell, column: str = "steady_s") -> Estimate:
    """Returns the time of `cell` over that of `other`, paired by round if they share enough rounds. Both have times."""
    return ratio_of_rounds(cell.rounds(column), other.rounds(column))


def unpaired(cell: Cell, other: Cell, column: str = "steady_s") -> Estimate:
    """Returns the steady time of `cell` over that of `other`, a cell of another run. Both have times."""
    return statistics.ratio(cell.values(column), other.values(column))


def mean_ratio(pairs: list[tuple[Cell, Cell]]) -> Estimate:
    """Returns the median over rounds of the geometric mean over places of the ratios of pairs of cells."""
    above, below = ([cell.rounds("steady_s") for cell in cells] for cells in zip(*pairs, strict=True))
    both = set.intersection(*(set(rounds) for rounds in (*above, *below)))
    if len(both) < statistics.LEAST:  # rounds in common: of medians, without an interval
        values = [over.steady.value / under.steady.value for over, under in pairs]
        return Estimate(geometric_mean(values), None, None, len(both), statistics.too_few(len(both)))
    per_round = [
        geometric_mean([over[n] / under[n] for over, under in zip(above, below, strict=True)]) for n in sorted(both)
    ]
    return statistics.median(per_round)


def ratio_of_rounds(above: dict[int, float], below: dict[int, float]) -> Estimate:
    """Returns the same of times by round."""
    both = sorted(above.keys() & below.keys())
    if len(both) < statistics.LEAST:
        return statistics.ratio(list(above.values()), list(below.values()))
    return statistics.ratio([above[number] for number in both], [below[number] for number in both], paired=True)


def resolved(results: Results, ratio: Estimate) -> bool:
    """Is a ratio significantly different from 1, by more than the noise floor of the run?"""
    return statistics.verdict(ratio, results.floor.value) != statistics.NOT_RESOLVED


def ratio_to_cell(cell: Cell, base: Cell | None, absent: str, column: str = "steady_s") -> Estimate | Missing | str:
    """Returns `ratio` of a cell to `base`, `absent` if that has no rank, text for the base."""
    if cell.unranked:
        return Missing(f"not ranked: {cell.unranked}")
    if cell is base:
        return "1 (the baseline)"
    return Missing(absent) if base is None or base.unranked else ratio(cell, base, column)


def ratio_to(results: Results, cell: Cell, variant: str | None) -> Estimate | Missing | str:
    """Returns the same to `variant` at the same place, with a note whether it is resolved."""
    estimate = ratio_to_cell(cell, base(results, cell.place, variant), f"{variant} is not ranked here")
    if not isinstance(estimate, Estimate):
        return estimate
    return replace(estimate, note=estimate.note or statistics.verdict(estimate, results.floor.value))
