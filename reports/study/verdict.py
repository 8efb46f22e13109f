"""Decides a claim from a run: true, false, not decided, not testable here, or unavailable."""

import math
from dataclasses import dataclass, replace

import numpy as np

from harness.statistics import statistics
from harness.statistics.statistics import Estimate
from reports.paper import quantity
from reports.run import ranking, stored
from reports.run.repetition import ERRORS
from reports.run.results import Cell, Missing, Results
from reports.stability import stability
from reports.study.claims import Apart, Claim, Cores, Failing, Growth, Ratio, Value, Verdict
from reports.times import cpu_figure


@dataclass(frozen=True)
class Decided:
    """The verdict on a claim, and what was measured or why nothing was."""

    verdict: Verdict
    measured: str


# The interval of a ratio of two cells of too few processes: so far do those of 5 reach on a shared machine.
ALONE = 1.5
COUNTS = {  # columns that the table of repetitions does not have: exact numbers of a record
    "reflected": lambda record: record["rays"] and record["rays"]["reflected"],
    "walk_rows": lambda record: ((record["used"] or {}).get("methods") or {}).get("walk_rows"),
}
LIGHT = "mean_light"  # the mean of all pixels and channels of a picture, linear RGB
EXACT = *ERRORS, *COUNTS, LIGHT  # which have no interval over processes
SAMPLES = 3  # of the measurer within a phase, at least


def decide(claim: Claim, results: Results | None) -> Decided:
    """Returns the verdict of a run on a claim; results: None if no run of its experiment is committed."""
    if claim.untestable:
        return Decided("not testable here", claim.untestable)
    if results is None:
        return Decided("unavailable", f"unavailable: no committed run of experiments/{claim.run}.toml")
    if claim.failing:
        return _failures(claim.failing, results)
    if claim.agree is None and claim.differ is None:
        return _of_number(claim, _number(claim, results))
    agreement = _agreement(claim.differ if claim.agree is None else claim.agree, results)
    if isinstance(agreement, Missing):
        return Decided("unavailable", str(agreement))
    agreeing, pictures = agreement
    holds = (agreeing == pictures) == (claim.agree is not None)
    return Decided("true" if holds else "false", f"{agreeing} of {pictures} pictures agree")


def _number(claim: Claim, results: Results) -> Estimate | Missing:
    if claim.ratio:
        return _ratio(claim.ratio, results)
    if claim.growth:
        return _growth(claim.growth, results)
    if claim.value:
        return _value(claim.value, results)
    return _cores(claim.cores, results) if claim.cores else _apart(claim.apart, results)


def _of_number(claim: Claim, number: Estimate | Missing) -> Decided:
    if isinstance(number, Missing):
        return Decided("unavailable", str(number))
    exact = claim.apart or (claim.columns and claim.columns[0] in EXACT)
    compared = claim.ratio and not exact and claim.ratio.above != claim.ratio.below
    verdict = _within(number, claim.least, claim.most, ALONE if compared else 1.0)
    if claim.apart:
        return Decided(verdict, f"{quantity.percent(number.value)} of the pixels differ")
    if claim.value and claim.value.column in COUNTS:
        return Decided(verdict, f"{number.value:.0f}{claim.unit}")
    shown = number.value if exact else number
    return Decided(verdict, quantity.times(shown) if claim.unit == " ×" else f"{quantity.text(shown)}{claim.unit}")


def _within(value: Estimate, least: float | None, most: float | None, alone: float) -> Verdict:
    """Is the whole interval of a value between the bounds, or outside, or neither? alone: the factor in its place."""
    low, high = (value.value / alone, value.value * alone) if value.low is None else (value.low, value.high)
    least, most = -math.inf if least is None else least, math.inf if most is None else most
    if least <= low and high <= most:
        return "true"
    return "false" if high < least or low > most else "not decided"


def cells(results: Results, wanted: dict) -> list[Cell]:
    """Returns the cells of a run by variant and by values of what was swept, else of parameters.

    `case` is the beginning of a name; a region is as the experiment spells it; `block_threads` are those of a block of
    a GPU; `pass` is the pass of the run whose repetitions the cell has; {not = value} is any other value.
    """
    chosen = [cell for cell in results.cells if all(has(cell, key, value) for key, value in wanted.items())]
    return [_of_pass(cell, wanted["pass"]) for cell in chosen] if "pass" in wanted else chosen


def has(cell, key: str, value) -> bool:
    if isinstance(value, dict):
        return not has(cell, key, value["not"])
    if key == "pass":
        return True
    if key in ("variant", "scene"):
        return getattr(cell, key) == value
    if key == "case":
        return str(cell.swept.get("case", "")).startswith(value)
    if key == "block_threads":
        return cell.swept.get("block_width", 0) * cell.swept.get("block_height", 0) == value
    return cell.swept.get(key, cell.parameters.get(key)) == value


def _of_pass(cell: Cell, name: str) -> Cell:
    keys = "scene", "point", "variant", "pass"
    columns = [cell.table.column(key) for key in keys]
    (first,) = {tuple(column[row] for column in columns[:3]) for row in cell.timed} or {None}
    rows = zip(*columns, strict=True)
    return replace(cell, timed=[number for number, row in enumerate(rows) if first and row == (*first, name)])


def _cell(results: Results, wanted: dict) -> Cell | Missing:
    there = cells(results, wanted)
    return there[0] if len(there) == 1 else Missing(f"the run has {len(there)} such cells")


def _lowest(results: Results, wanted: dict, column: str) -> Cell | Missing:
    medians = {cell: cell.median(column, "") for cell in cells(results, wanted)}
    measured = [cell for cell, median in medians.items() if not isinstance(median, Missing)]
    if not measured:
        return Missing(f"the run has no {column} of such cells")
    return min(measured, key=lambda cell: medians[cell].value)


def _apart(apart: Apart, results: Results) -> Estimate | Missing:
    """Returns the share of pixels whose 8-bit colours differ by more than one step."""
    shown = []
    for wanted in (apart.first, apart.other):
        cell = _cell(results, wanted)
        picture = cell if isinstance(cell, Missing) else stored.picture(results, cell)
        if isinstance(picture, Missing):
            return picture
        shown.append(stored.displayed(picture, cell).astype(int))
    return Estimate(float((abs(shown[0] - shown[1]).max(axis=-1) > 1).mean()), None, None, 1)


def _ratio(ratio: Ratio, results: Results) -> Estimate | Missing:
    columns = ratio.column, ratio.over or ratio.column, ratio.column, ratio.column
    sides = []
    for wanted, column in zip(ratio.sides, columns, strict=False):
        cell = _lowest(results, wanted, column) if ratio.lowest else _cell(results, wanted)
        side = cell if isinstance(cell, Missing) else _side(results, cell, column)
        if isinstance(side, Missing):
            return side
        sides.append(side)
    above, below = (sides[0], sides[1]) if ratio.gain is None else (_times(sides[0], sides[3]), _times(*sides[1:3]))
    estimate = (
        Estimate(above / below, None, None, 1) if isinstance(above, float) else ranking.ratio_of_rounds(above, below)
    )
    times = ratio.times / (results.facts["environment"]["cores"]["usable"] if ratio.per_core else 1)
    ends = (None if end is None else _scaled(end, times, ratio.power) for end in (estimate.low, estimate.high))
    value = _scaled(estimate.value, times, ratio.power)
    return replace(estimate, value=value, **dict(zip(("low", "high"), ends, strict=True)))


def _times(first: dict[int, float], other: dict[int, float]) -> dict[int, float]:
    """Returns the product, round by round, of times that were measured in the same rounds."""
    return {number: first[number] * other[number] for number in first.keys() & other.keys()}


def _side(results: Results, cell: Cell, column: str) -> float | dict[int, float] | Missing:
    """Returns an exact number, or the values of a column by round."""
    if column in ERRORS:
        return cell.error(column)
    if column == LIGHT:
        picture = stored.picture(results, cell)
        return picture if isinstance(picture, Missing) else float(picture.mean())
    if column in COUNTS:
        record = results.record(cell)
        count = COUNTS[column](record) if record else None
        return Missing(f"the run does not have {column}") if count is None else float(count)
    return cell.rounds(column) or cell.median(column, f"the run does not have {column}")


def _scaled(value: float, times: float, power: float | None) -> float:
    return value * times if power is None else math.log(value * times) / math.log(power)


FACTORS = {  # of equation 4.1: what the time is to grow with, by swept values
    "side": lambda swept: swept["side"] ** 2,
    "depth": lambda swept: swept["depth"],
    **dict.fromkeys(("objects", "lights"), lambda swept: swept["objects"] + swept["lights"]),
}


def _growth(growth: Growth, results: Results) -> Estimate | Missing:
    """Returns the median over rounds of the slope of log time on log factor, by least squares over all cells."""
    points = {}
    for cell in cells(results, growth.cells):
        factor = FACTORS[growth.along](cell.swept)
        if factor > 0 and (rounds := cell.rounds("steady_s")):  # depth 0 has no logarithm
            points[factor] = rounds
    if len(points) < 3:
        return Missing(f"the run has {len(points)} such cells")
    common = set.intersection(*(set(rounds) for rounds in points.values()))
    if not common:
        return Missing("its cells have no round in common")
    logs = np.log(list(points))
    return statistics.median(
        [
            float(np.polyfit(logs, np.log([rounds[number] for rounds in points.values()]), 1)[0])
            for number in sorted(common)
        ]
    )


def _value(value: Value, results: Results) -> Estimate | Missing:
    cell = _cell(results, value.cell)
    side = cell if isinstance(cell, Missing) else _side(results, cell, value.column)
    if isinstance(side, dict):
        return statistics.median(list(side.values()))
    return side if isinstance(side, Missing) else Estimate(side, None, None, 1)


def _cores(cores: Cores, results: Results) -> Estimate | Missing:
    """Returns the median over processes of the CPU time in a phase over its length."""
    cell = _cell(results, cores.cell)
    if isinstance(cell, Missing):
        return cell
    records = [results.records[row] for row in cell.counting]
    if not records:
        return Missing(cell.verdict)
    busy = [_busy(results, record, cores.phase) for record in records if record["series"]]
    loads = [value for value in busy if value is not None]
    return statistics.median(loads) if loads else Missing(f"no series has {SAMPLES} samples of the phase {cores.phase}")


def _busy(results: Results, record: dict, phase: str) -> float | None:
    """Returns the cores that a process kept busy in a phase; None if its series is too coarse for it."""
    t, percent = cpu_figure.rates(results.folder / record["series"])
    spent = np.concatenate([[0.0], np.cumsum(percent / 100 * np.diff(t))])  # s of CPU time, from the first sample on
    for name, start, end in record["phases"] or []:
        if name == phase and ((t >= start) & (t <= end)).sum() >= SAMPLES:
            return float(np.diff(np.interp([start, end], t, spent))[0] / (end - start))
    return None


def _failures(failing: Failing, results: Results) -> Decided:
    """Returns true if no level of a curve of the catalogue fails, and its first failure."""
    (row,) = [row for row in stability.rows(results) if row.name == failing.row] or [None]
    wanted = failing.cells.items()
    curves = [
        curve for curve in (row.curves if row else []) if all(has(curve.points[0].cell, *item) for item in wanted)
    ]
    if len(curves) != 1 or not curves[0].answered:
        return Decided("unavailable", f"unavailable: the run has {len(curves)} such curves")
    (curve,) = curves
    stress = row.facts["stress"]
    if curve.broken:
        point = curve.broken
        count = f"{point.answers['failures']} of {point.answers['count']}"
        return Decided("false", f"{count} fail at {quantity.plain(point.level)} ({stress})")
    ends = " to ".join(quantity.plain(curve.answered[end].level) for end in (0, -1))
    return Decided("true", f"no failure from {ends} ({stress})")


def _agreement(wanted: dict, results: Results) -> tuple[int, int] | Missing:
    """Returns how many pictures agree with their references, and how many were judged."""
    verdicts = [cell.agrees for cell in cells(results, wanted) if not isinstance(cell.agrees, Missing)]
    return (sum(verdicts), len(verdicts)) if verdicts else Missing("no such picture was judged")
