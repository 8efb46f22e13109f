"""Fits models of a frame's time: the study's, and two that count orders or traced rays."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from harness.statistics import fit
from harness.statistics.fit import Coefficient, Line
from reports.run.cell import Missing
from reports.scaling.complexity_points import Series

# T = a + b * work. With d reflections at most there are d + 1 orders: the first is that of primary rays.
WORK = {
    "p·d·(o + l)": lambda t: t["p"] * t["d"] * (t["o"] + t["l"]),
    "p·(d + 1)·(o + l)": lambda t: t["p"] * (t["d"] + 1) * (t["o"] + t["l"]),
    "rays·(o + l)": lambda t: t["rays"] * (t["o"] + t["l"]),
}
STUDY, ORDERS, COUNTED = WORK
FACTOR = {
    "p": lambda t: t["p"],
    "d": lambda t: t["d"],
    "d + 1": lambda t: t["d"] + 1,
    "o": lambda t: t["o"],
    "l": lambda t: t["l"],
    "o + l": lambda t: t["o"] + t["l"],
    "rays": lambda t: t["rays"],
}
# What log T is fitted on, by the model whose work has these factors.
POWERS = ((STUDY, ("p", "d", "o + l")), (ORDERS, ("p", "d + 1", "o", "l")), (COUNTED, ("rays", "o + l")))
FAR = 10  # times a: below it a lowers an exponent by more than 1 / FAR


@dataclass(frozen=True)
class Power:
    """An exponent of a factor. model: that has the factor.

    expected: the exponent that times of the model have in the same cells. For p it is 1, less what a takes from it.

    low, high: of the factor, in these cells.
    """

    model: str
    factor: str
    low: float
    high: float
    cells: int
    exponent: Coefficient | Missing
    expected: float

    @property
    def differs(self) -> bool:
        """Does its interval exclude the exponent that the model expects?"""
        exponent = self.exponent
        return not isinstance(exponent, Missing) and not exponent.low <= self.expected <= exponent.high


@dataclass(frozen=True)
class Fitted:
    """A series with its fits.

    lines: by model. errors: how far each model is off (modelled / measured - 1), a column each, a row a cell; NaN
    where it has none. powers: exponents. share: the largest a / T in the cells that these are from.
    """

    series: Series
    lines: dict[str, Line | Missing]
    errors: pd.DataFrame
    powers: list[Power]
    share: float

    def line(self, model: str) -> Line | None:
        model_line = self.lines[model]
        return None if isinstance(model_line, Missing) else model_line


def fitted(series: Series) -> Fitted:
    """Fits a series that lacks nothing."""
    points = series.points
    lines = {model: _line(points, model) for model in WORK}
    fits = {model: line for model, line in lines.items() if isinstance(line, Line)}
    errors = pd.DataFrame(
        {
            model: fits[model].seconds(work(points)) / points["seconds"] - 1 if model in fits else np.nan
            for model, work in WORK.items()
        },
        index=points.index,
    )
    best = min(fits.values(), key=lambda line: line.spread, default=None)
    a = max(0.0, best.a.value) if best else 0.0
    far = points[points["seconds"] >= FAR * a]
    powers = [power for model, factors in POWERS for power in _powers(points, a, model, factors)]
    return Fitted(series, lines, errors, powers, float((a / far["seconds"]).max()) if len(far) else np.nan)


def _line(points: pd.DataFrame, model: str) -> Line | Missing:
    work = WORK[model](points)
    if work.isna().any():
        return Missing("the rays are not told")
    # As written the model has no work at all where d = 0: such cells say nothing of b, and would force a.
    some = work > 0
    try:
        return fit.line(work[some], points["seconds"][some])
    except fit.Unfit as why:
        return Missing(str(why))


def _powers(points: pd.DataFrame, a: float, model: str, factors: tuple[str, ...]) -> list[Power]:
    every = {name: FACTOR[name](points) for name in factors}
    positive = np.logical_and.reduce([values > 0 for values in every.values()])
    some = positive & (points["seconds"] >= FAR * a)
    columns = {name: values[some] for name, values in every.items()}
    varied = {name: values for name, values in columns.items() if values.nunique() > 1}
    try:
        seconds, work = points["seconds"][some], WORK[model](points[some])
        exponents = fit.exponents(varied, seconds)
        expected = fit.exponents(varied, a + work * ((seconds - a) / work).median())
    except fit.Unfit as why:
        exponents, expected = dict.fromkeys(varied, Missing(f"{why} (cells of at least {FAR} times a)")), {}
    return [
        Power(
            model, name, values.min(), values.max(), int(some.sum()),
            exponents.get(name) or Missing(_fixed(name, every[name], points["seconds"], positive, some, FAR * a)),
            expected[name].value if name in expected else np.nan,
        )
        for name, values in columns.items()
    ]  # fmt: skip


def _fixed(name: str, values: pd.Series, seconds: pd.Series, positive, counted, limit: float) -> str:
    """Why a factor has one value, or none, in the cells that count for exponents; limit: s, the shortest that counts.

    positive: which cells have a logarithm in all factors of the model; counted: which of them are long enough too.
    """
    if values.nunique() < 2:
        return "not told" if values.isna().any() else "not varied"
    some = values[positive]
    if some.nunique() < 2:
        return "varied, but not in cells where all factors are told and above 0, as logarithms must be"
    counts = values[counted].unique()
    short = seconds[positive & ~values.isin(counts)].max()
    where = f"only cells of {name} = {counts[0]:g} are" if len(counts) else "no cell is"
    return (
        f"varied from {some.min():g} to {some.max():g}, but {where} long enough: it takes {1e3 * limit:.3g} ms, {FAR} "
        f"times a, and the longest {'other ' * len(counts)}took {1e3 * short:.3g} ms; more pixels or a larger scene "
        "make frames longer"
    )
