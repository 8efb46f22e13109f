"""Computes curves of failures and errors along a growing stress, from the rows of a [[stress]] run."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from harness.renderer.methods import METHODS
from harness.statistics.statistics import LEVEL
from reports.run import command
from reports.run.cell import Cell, Missing
from reports.run.results import Results, grouped

# Values that the catalogue calls naive: a way with one of them is not robust.
NAIVE = {method.name: method.naive for method in METHODS}
KNOWN = "stress", "level", "precision"  # of a swept point; its other values distinguish ways
PLAIN = "default"  # name of the only way of a row


@dataclass(frozen=True)
class Way:
    """A way to compute a row, named by the value of its method and of other varied parameters."""

    naive: bool
    name: str


@dataclass(frozen=True)
class Point:
    """A level of a curve. answers: `stability` of the record (harness/store/store.py), or why it is missing."""

    level: float
    answers: dict | Missing
    status: str
    cell: Cell

    @property
    def answered(self) -> bool:
        return not isinstance(self.answers, Missing)

    @property
    def fails(self) -> bool:
        return self.answered and self.answers["failures"] > 0

    @property
    def share(self) -> float:
        """The share of wrong answers of a known point."""
        return self.answers["failures"] / self.answers["count"] if self.answers["count"] else 0.0

    @cached_property
    def interval(self) -> tuple[float, float]:
        return interval(self.answers["failures"], self.answers["count"])


@dataclass(frozen=True)
class Survival:
    """The stress that a curve survives without a failure, in decades, or in levels if its axis is not logarithmic.

    value: None if the first known level fails; `below` is then the place of that level, 0 if it is the mildest. of: the
    whole range. whole: every level was run and none failed. lost: no level failed, but the last has no answer.
    """

    value: float | None
    below: float
    of: float
    decades: bool
    whole: bool
    lost: bool

    @property
    def sure(self) -> bool:
        """Is it known where the curve breaks, or that it does not break?"""
        return not self.lost and self.below == 0

    @property
    def share(self) -> float:
        return 1.0 if self.whole else (self.value or 0.0) / self.of if self.of else 0.0

    @property
    def mark(self) -> str:
        """A short label."""
        if self.whole:
            return "all"
        if self.value is None and self.below == 0:
            return "×"
        value = self.below if self.value is None else self.value
        text = f"{value:.2g}" if self.decades else f"{value:g}/{self.of:g}"
        return f"<{text}" if self.value is None else f"≥{text}" if self.lost else text


@dataclass(frozen=True)
class Curve:
    """Points of one variant in one precision and way, from the mildest level to the most extreme."""

    variant: str
    precision: str
    way: Way
    points: list[Point]

    @cached_property
    def answered(self) -> list[Point]:
        return [point for point in self.points if point.answered]

    @cached_property
    def broken(self) -> Point | None:
        """The first point with a failure."""
        return next((point for point in self.points if point.fails), None)

    @property
    def unbroken(self) -> list[Point]:
        """Known points before the first failure."""
        return self.answered[: self.answered.index(self.broken)] if self.broken else self.answered

    @property
    def limit(self) -> float | None:
        """The level at which theory lets it break; None if unknown."""
        return next((point.answers["limit"] for point in self.answered if point.answers["limit"] is not None), None)

    @property
    def expected(self) -> list[tuple[float, float]]:
        """Levels with the errors that theory expects."""
        return [
            (point.level, point.answers["expected"]) for point in self.answered if point.answers["expected"] is not None
        ]

    @property
    def missing(self) -> dict[str, list[Point]]:
        """Points without an answer, by reason."""
        return grouped((point for point in self.points if not point.answered), lambda point: str(point.answers))

    def survival(self, logarithmic: bool) -> Survival | Missing:
        if not self.answered:
            return self.points[0].answers
        levels, unbroken = [point.level for point in self.points], self.unbroken
        decades = logarithmic and min(levels) > 0
        whole = len(unbroken) == len(self.points)
        lost = self.broken is None and not whole
        first = 0 if unbroken else self.points.index(self.broken)
        if decades:
            value = abs(math.log10(unbroken[-1].level / unbroken[0].level)) if unbroken else None
            below, of = (abs(math.log10(level / levels[0])) for level in (levels[first], levels[-1]))
            return Survival(value, below, of, True, whole, lost)
        return Survival(len(unbroken) or None, first, len(levels), False, whole, lost)


@dataclass(frozen=True)
class Row:
    """A row of the catalogue in this run. facts: of the row, from run.json (harness/stress/row.py)."""

    name: str
    facts: dict[str, Any]
    curves: list[Curve]

    @property
    def label(self) -> str:
        return f"{self.facts['code']} {self.name}"

    @property
    def variants(self) -> list[str]:
        return list(dict.fromkeys(curve.variant for curve in self.curves))

    @property
    def precisions(self) -> list[str]:
        return sorted({curve.precision for curve in self.curves})

    @property
    def ways(self) -> list[Way]:
        """Its ways, robust ones first, each kind in the order of the run."""
        return sorted(dict.fromkeys(curve.way for curve in self.curves), key=lambda way: way.naive)

    @property
    def levels(self) -> list[float]:
        """The levels of all its curves, from mild to extreme."""
        levels = list(dict.fromkeys(point.level for curve in self.curves for point in curve.points))
        return sorted(levels, reverse=levels[0] > levels[-1])

    @property
    def logarithmic(self) -> bool:
        return self.facts["logarithmic"] and min(self.levels) > 0

    @property
    def cells(self) -> list[Cell]:
        return [point.cell for curve in self.curves for point in curve.points]

    def find(self, variant: str, precision: str, way: Way) -> Curve | None:
        return next((c for c in self.curves if (c.variant, c.precision, c.way) == (variant, precision, way)), None)

    def survival(self, curve: Curve) -> Survival | Missing:
        return curve.survival(self.facts["logarithmic"])

    def survived(self, naive: bool) -> float | None:
        """Returns the share of its range of stress without a wrong answer in any variant and precision.

        Of naive or of robust ways; None if no such way has an answer.
        """
        curves = [curve for curve in self.curves if curve.way.naive == naive and curve.answered]
        return min((self.survival(curve).share for curve in curves), default=None)


def rows(results: Results) -> list[Row]:
    """Returns every row of the run in its order, an aligned row after its twin in general position."""
    cells = grouped((cell for cell in results.cells if "stress" in cell.swept), lambda cell: cell.swept["stress"])
    stress_rows = [_row(results, name, row_cells) for name, row_cells in cells.items()]
    place = {row.name: number for number, row in enumerate(stress_rows)}
    return sorted(stress_rows, key=lambda row: (place.get(row.facts["aligned"], place[row.name]), place[row.name]))


def _row(results: Results, name: str, cells: list[Cell]) -> Row:
    facts = results.facts["stability"][name]
    others = dict.fromkeys(key for cell in cells for key in cell.swept if key not in (*KNOWN, facts["method"]))
    varied = [key for key in others if len({repr(_value(cell, key)) for cell in cells}) > 1]
    curves = grouped(
        cells, lambda cell: (cell.variant, cell.parameters["precision"], _way(cell, facts["method"], varied))
    )
    return Row(name, facts, [Curve(*key, [_point(results, cell) for cell in cells]) for key, cells in curves.items()])


def _way(cell: Cell, method: str, varied: list[str]) -> Way:
    keys = (method, *varied) if method else NAIVE  # a row without a method may use a naive one
    naive = [f"{key} {cell.parameters[key]}" for key in keys if cell.parameters.get(key) in NAIVE.get(key, ())]
    words = [str(_value(cell, method))] if method else []
    for key in varied:
        value = _value(cell, key)
        if value != command.default(key):
            words.append(value if isinstance(value, str) else f"{key} {value}")
    return Way(bool(naive), ", ".join(words or naive).replace("_", " ") or PLAIN)


def _value(cell: Cell, key: str):
    return cell.swept.get(key, cell.parameters.get(key))


def _point(results: Results, cell: Cell) -> Point:
    """Returns the repetition with the most failures, since a failure in one repetition counts."""
    answers = [results.records[row].get("stability") for row in cell.timed]
    worst = max(
        filter(None, answers), key=lambda answer: answer["failures"], default=Missing(f"{cell.status}: {cell.reason}")
    )
    return Point(cell.swept["level"], worst, cell.status, cell)


def interval(failures: int, count: int) -> tuple[float, float]:
    """Returns the 95 % interval of a share: Wilson's (JASA 22, 1927), or the rule of three where none or all fail.

    The rule of three is Hanley's (JAMA 249, 1983). The interval holds for answers that fail independently.
    """
    if count == 0:
        return 0.0, 1.0
    if failures == 0:
        return 0.0, min(1.0, 3 / count)
    if failures == count:
        return max(0.0, 1 - 3 / count), 1.0
    from scipy import stats

    bounds = stats.binomtest(failures, count).proportion_ci(LEVEL, method="wilson")
    return float(bounds.low), float(bounds.high)
