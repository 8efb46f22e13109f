"""Fits time against work (the study's equation 4.1): a straight line, and an exponent of each factor.

An observation is a cell: the median over its processes, which are the unit of replication. Errors are taken as
relative, so weights are 1 / T^2: what a model misses is a share of the time, and so is most of the noise.

Intervals are Student's, from the deviations of the cells about the fit, which hold the noise of processes and what the
model misses. A bootstrap over processes holds the noise alone: of a model that is 30 % off it would be sure to 0.1 %.
Their variances are HC3 (MacKinnon & White, Journal of Econometrics 29, 1985, p. 305), right also where short times are
noisier than long ones. Both take the deviations of cells as independent.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from harness.statistics.statistics import LEVEL

FREE = 3  # observations that a fit needs beyond the number of coefficients


class Unfit(ValueError):
    """The data determine no fit; the text says why."""


class Coefficient(NamedTuple):
    """A value and its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Line:
    """The fit T = a + b * work. a: s; b: s per unit of work; spread: standard deviation of the relative residuals;
    cells: their number.
    """

    a: Coefficient
    b: Coefficient
    spread: float
    cells: int

    def seconds(self, work: np.ndarray) -> np.ndarray:
        """T in s for amounts of work."""
        return self.a.value + self.b.value * work


def line(work: np.ndarray, seconds: np.ndarray) -> Line:
    """The weighted least squares line through cells, each with its work and its time (s). Unfit if there is none."""
    work, seconds = np.asarray(work, dtype=float), np.asarray(seconds, dtype=float)
    unit = work.max(initial=0) or 1.0  # of work, so that both columns have similar sizes
    (a, b), spread = _fit({"work": work / unit}, seconds, 1 / seconds**2)
    return Line(a, Coefficient(*(float(end / unit) for end in b)), spread, len(seconds))


def exponents(factors: dict[str, np.ndarray], seconds: np.ndarray) -> dict[str, Coefficient]:
    """The exponent of each factor in T = c * product of powers. factors: positive values. Unfit if there is none.

    A time a + b * w has the exponent 1 - a / T in w, not 1, so give cells whose time is well above a.
    """
    logs = {name: np.log(np.asarray(values, dtype=float)) for name, values in factors.items()}
    (_, *coefficients), _ = _fit(logs, np.log(np.asarray(seconds, dtype=float)), 1.0)
    return dict(zip(logs, coefficients, strict=True))


def noise(per_process: list[float]) -> float:
    """Relative standard error of the median over processes, from their MAD, which is robust; NaN for one process.

    As for a normal distribution: the standard deviation is 1.4826 MAD, the error of the median sqrt(pi / 2 n) of that.
    """
    values = np.asarray(per_process, dtype=float)
    if len(values) < 2:
        return float("nan")
    from scipy import stats

    spread = stats.median_abs_deviation(values, scale="normal")
    return float(np.sqrt(np.pi / 2 / len(values)) * spread / np.median(values))


def _fit(columns: dict[str, np.ndarray], y: np.ndarray, weights) -> tuple[list[Coefficient], float]:
    """The coefficients of a constant and of the columns, and the standard deviation of the weighted residuals."""
    from scipy import stats

    matrix = np.column_stack([np.ones(len(y)), *columns.values()])
    need = matrix.shape[1] + FREE
    if len(y) < need:
        raise Unfit(f"{len(y)} cell{'s' * (len(y) != 1)}, {need} are needed")
    if np.linalg.matrix_rank(matrix) < matrix.shape[1]:
        fixed = [name for name, values in columns.items() if np.ptp(values) == 0]
        raise Unfit(
            f"{' and '.join(fixed)} not varied" if fixed else f"not all of {', '.join(columns)} varied independently"
        )
    root = np.sqrt(np.broadcast_to(weights, len(y)))
    matrix, y = matrix * root[:, None], y * root
    q, r = np.linalg.qr(matrix)
    leverage = (q**2).sum(axis=1)
    if leverage.max() > 1 - 1e-9:  # HC3 divides by 1 - leverage
        raise Unfit("a coefficient depends on one cell alone")
    values = np.linalg.solve(r, q.T @ y)
    residuals = y - matrix @ values
    free = len(y) - len(values)
    # HC3: the covariance is A diag((e / (1 - h))^2) A^T with A = (X^T X)^-1 X^T = R^-1 Q^T.
    errors = np.linalg.norm(np.linalg.solve(r, q.T) * (residuals / (1 - leverage)), axis=1)
    width = stats.t.ppf((1 + LEVEL) / 2, free) * errors
    ends = np.column_stack([values, values - width, values + width])
    return [Coefficient(*map(float, row)) for row in ends], float(np.sqrt(residuals @ residuals / free))
