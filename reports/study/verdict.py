"""Decides a claim from a run: true, false, not decided, not testable here, or unavailable."""

import math
from dataclasses import dataclass, replace

from harness.statistics.statistics import Estimate
from reports.paper import quantity
from reports.run import ranking, stored
from reports.run.repetition import ERRORS
from reports.run.results import Cell, Missing, Results
from reports.study.claims import Apart, Claim, Ratio, Verdict


@dataclass(frozen=True)
class Decided:
    """The verdict on a claim, and what was measured or why nothing was."""

    verdict: Verdict
    measured: str


# The interval of a ratio of two cells of too few processes: so far do those of 5 reach on a shared machine.
ALONE = 1.5


def decide(claim: Claim, results: Results | None) -> Decided:
    """Returns the verdict of a run on a claim; results: None if no run of its experiment is committed."""
    if claim.untestable:
        return Decided("not testable here", claim.untestable)
    if results is None:
        return Decided("unavailable", f"unavailable: no committed run of experiments/{claim.run}.toml")
    if claim.ratio:
        return _of_number(claim, _ratio(claim.ratio, results))
    if claim.apart:
        return _of_number(claim, _apart(claim.apart, results))
    found = _agreement(claim.differ if claim.agree is None else claim.agree, results)
    if isinstance(found, Missing):
        return Decided("unavailable", str(found))
    agreeing, pictures = found
    holds = (agreeing == pictures) == (claim.agree is not None)
    return Decided("true" if holds else "false", f"{agreeing} of {pictures} pictures agree")


def _of_number(claim: Claim, found: Estimate | Missing) -> Decided:
    if isinstance(found, Missing):
        return Decided("unavailable", str(found))
    alone = 1.0
    if claim.apart:
        told = f"{quantity.percent(found.value)} of the pixels differ"
    else:
        exact = claim.ratio.column in ERRORS  # an error has no interval over processes
        shown = found.value if exact else found
        told = quantity.times(shown) if claim.ratio.unit == "×" else f"{quantity.text(shown)} {claim.ratio.unit}"
        if not exact and claim.ratio.above != claim.ratio.below:
            alone = ALONE
    return Decided(_within(found, claim.least, claim.most, alone), told)


def _within(value: Estimate, least: float | None, most: float | None, alone: float) -> Verdict:
    """Is the whole interval of a value between the bounds, or outside, or neither? alone: the factor in its place."""
    low, high = (value.value / alone, value.value * alone) if value.low is None else (value.low, value.high)
    least, most = -math.inf if least is None else least, math.inf if most is None else most
    if least <= low and high <= most:
        return "true"
    return "false" if high < least or low > most else "not decided"


def cells(results: Results, wanted: dict) -> list[Cell]:
    """Returns the cells of a run by variant and by values of what was swept, else of parameters.

    `case` is the beginning of a name; a region is as the experiment spells it.
    """
    return [cell for cell in results.cells if all(_has(cell, key, value) for key, value in wanted.items())]


def _has(cell: Cell, key: str, value) -> bool:
    if key in ("variant", "scene"):
        return getattr(cell, key) == value
    if key == "case":
        return str(cell.swept.get("case", "")).startswith(value)
    return cell.swept.get(key, cell.parameters.get(key)) == value


def _cell(results: Results, wanted: dict) -> Cell | Missing:
    found = cells(results, wanted)
    return found[0] if len(found) == 1 else Missing(f"the run has {len(found)} such cells")


def _apart(apart: Apart, results: Results) -> Estimate | Missing:
    """Returns the share of pixels whose 8-bit colours differ by more than one step."""
    shown = []
    for wanted in (apart.one, apart.other):
        cell = _cell(results, wanted)
        picture = cell if isinstance(cell, Missing) else stored.picture(results, cell)
        if isinstance(picture, Missing):
            return picture
        shown.append(stored.displayed(picture, cell).astype(int))
    return Estimate(float((abs(shown[0] - shown[1]).max(axis=-1) > 1).mean()), None, None, 1)


def _ratio(ratio: Ratio, results: Results) -> Estimate | Missing:
    sides = []
    for wanted, column in ((ratio.above, ratio.column), (ratio.below, ratio.over or ratio.column)):
        cell = _cell(results, wanted)
        side = cell if isinstance(cell, Missing) else _side(cell, column)
        if isinstance(side, Missing):
            return side
        sides.append(side)
    above, below = sides
    found = (
        Estimate(above / below, None, None, 1) if isinstance(above, float) else ranking.ratio_of_rounds(above, below)
    )
    ends = (None if end is None else _scaled(end, ratio) for end in (found.low, found.high))
    return replace(found, value=_scaled(found.value, ratio), **dict(zip(("low", "high"), ends, strict=True)))


def _side(cell: Cell, column: str) -> float | dict[int, float] | Missing:
    """Returns an error, or the values of a column by round."""
    if column in ERRORS:
        return cell.error(column)
    rounds = cell.rounds(column)
    return rounds or cell.median(column, "the run does not have it")


def _scaled(value: float, ratio: Ratio) -> float:
    value *= ratio.times
    return value if ratio.power is None else math.log(value) / math.log(ratio.power)


def _agreement(wanted: dict, results: Results) -> tuple[int, int] | Missing:
    """Returns how many pictures agree with their references, and how many were judged."""
    known = [cell.agrees for cell in cells(results, wanted) if not isinstance(cell.agrees, Missing)]
    return (sum(known), len(known)) if known else Missing("no such picture was judged")
