"""Means and ratios with intervals. The process is the unit: frames of one process are not independent."""

from dataclasses import dataclass

import numpy as np

LEVEL = 0.95
LEAST = 3  # processes that an interval needs


@dataclass(frozen=True)
class Estimate:
    """A value and its 95 % interval; low and high are None, and `note` says why, where processes are too few."""

    value: float
    low: float | None
    high: float | None
    processes: int
    note: str = ""


def too_few(processes: int) -> str:
    return f"no interval from {processes} process{'es' if processes > 1 else ''}"


def mean(per_process: list[float]) -> Estimate:
    """Mean over processes, Student's interval."""
    from scipy import stats

    values = np.asarray(per_process, dtype=float)
    centre = float(values.mean())
    if len(values) < LEAST:
        return Estimate(centre, None, None, len(values), too_few(len(values)))
    if np.ptp(values) == 0:
        return Estimate(centre, centre, centre, len(values))
    interval = stats.ttest_1samp(values, 0.0).confidence_interval(LEVEL)
    return Estimate(centre, float(interval[0]), float(interval[1]), len(values))


def ratio(above: list[float], below: list[float], seed: int = 1) -> Estimate:
    """Ratio of the means over processes, bootstrap interval (percentile, processes resampled)."""
    from scipy import stats

    a, b = np.asarray(above, dtype=float), np.asarray(below, dtype=float)
    value = float(a.mean() / b.mean())
    count = min(len(a), len(b))
    if count < LEAST:
        return Estimate(value, None, None, count, too_few(count))

    def statistic(x, y, axis=-1):
        return np.mean(x, axis=axis) / np.mean(y, axis=axis)

    interval = stats.bootstrap(
        (a, b), statistic, method="percentile", confidence_level=LEVEL, n_resamples=4999, rng=seed
    ).confidence_interval
    return Estimate(value, float(interval.low), float(interval.high), count)
