"""Chooses the scales of the axes of a sweep, and finds where lines cross on them."""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np
from matplotlib.scale import LogTransform, SymmetricalLogTransform
from matplotlib.transforms import IdentityTransform

from harness.statistics import statistics
from harness.statistics.statistics import Estimate
from reports.scaling.sweep import Line, Panel, Quantity

DECADE = 10.0
EVEN = 1.5  # between the largest and the smallest ratio of neighbours in geometric steps
LINEAR = 0.3  # decades of a logarithmic axis with a 0 below its least positive value


@dataclass(frozen=True)
class Scale:
    """The scale of an axis: linear, log, or symlog, which is linear below `least`, the least positive value."""

    name: str
    least: float = 1.0

    @property
    def transform(self):
        """From values to places on the axis."""
        if self.name == "linear":
            return IdentityTransform()
        return LogTransform(10) if self.name == "log" else SymmetricalLogTransform(10, self.least, LINEAR)

    @property
    def options(self) -> dict:
        """The arguments of `set_xscale` and `set_yscale` beside the name."""
        return {"linthresh": self.least, "linscale": LINEAR} if self.name == "symlog" else {}


@dataclass(frozen=True)
class Crossing:
    """Where `line` falls below `other`, as x rises. between: the values of the axis that order them differently."""

    line: Line
    other: Line
    x: float
    y: float
    between: tuple[float, float]


def across(values: Iterable[float]) -> Scale:
    """Returns the scale for values of an axis: logarithmic over a decade or in geometric steps.

    Even steps are linear, however far they go.
    """
    values = sorted(set(values))
    steps = np.diff(values)
    if len(values) > 2 and np.ptp(steps) <= 1e-6 * steps.max():
        return Scale("linear")
    some = [value for value in values if value > 0]
    ratios = [after / before for before, after in pairwise(some)]
    geometric = len(ratios) > 1 and max(ratios) < EVEN * min(ratios)
    return _logarithmic(values) if geometric else upright(values)


def upright(values: Iterable[float]) -> Scale:
    """Returns the scale for values of a quantity: logarithmic over a decade."""
    values = list(values)
    some = [value for value in values if value > 0]
    return _logarithmic(values) if some and max(some) >= DECADE * min(some) else Scale("linear")


def _logarithmic(values: list[float]) -> Scale:
    if min(values) < 0:
        return Scale("linear")
    return Scale("log") if min(values) > 0 else Scale("symlog", min(value for value in values if value > 0))


def values(panels: Iterable[Panel], quantity: Quantity) -> list[float]:
    """Returns the values of a quantity in panels that share its axis."""
    return [value.value for panel in panels for line in panel.lines for _, value in line.points(quantity)]


def crossings(
    panel: Panel, lines: list[Line], quantity: Quantity, scale: Scale, floor: float | None = None
) -> list[Crossing]:
    """Returns where lines of a panel cross, by rising x: where the 95 % intervals of two values order them differently.

    The place is where straight lines between medians meet on the chart's axes. scale: of the quantity. floor: the noise
    floor of the run; smaller differences do not order two values.
    """
    if not quantity.crosses or panel.mark:
        return []
    of = {line.label: dict(line.points(quantity)) for line in lines}
    meetings = []
    for line, other in combinations(lines, 2):
        a, b = of[line.label], of[other.label]
        both = sorted(a.keys() & b.keys())
        order = [(x, side) for x in both if (side := _order(a[x], b[x], floor))]
        for (x, before), (later, after) in pairwise(order):
            if before == after:
                continue
            xs = [value for value in both if x <= value <= later]
            meeting = _meeting(across(panel.values), scale, xs, a, b)
            lower, upper = (line, other) if after < 0 else (other, line)
            meetings.append(Crossing(lower, upper, *meeting, (x, later)))
    return sorted(meetings, key=lambda crossing: crossing.x)


def _order(a: Estimate, b: Estimate, floor: float | None) -> int:
    """Returns -1 if a is below b, 1 if above, 0 if that is not resolved."""
    if a.low is None or b.low is None or statistics.difference(a.value / b.value) <= (floor or 0.0):
        return 0
    return -1 if a.high < b.low else 1 if a.low > b.high else 0


def _meeting(horizontal: Scale, vertical: Scale, xs: list[float], a: dict, b: dict) -> tuple[float, float]:
    """Returns x and y where the medians of two lines meet between values that order them differently.

    Where they meet several times, as neither is resolved to be lower in between, the middle one.
    """
    at = horizontal.transform.transform(np.array(xs, dtype=float))
    heights, its = (vertical.transform.transform(np.array([line[x].value for x in xs])) for line in (a, b))
    gap = heights - its
    places = [n for n in range(len(xs) - 1) if gap[n] * gap[n + 1] <= 0]
    n = places[len(places) // 2]
    share = gap[n] / (gap[n] - gap[n + 1]) if gap[n] != gap[n + 1] else 0.5
    x, y = (line[n] + share * (line[n + 1] - line[n]) for line in (at, heights))
    return tuple(
        float(scale.transform.inverted().transform(value)) for scale, value in ((horizontal, x), (vertical, y))
    )
