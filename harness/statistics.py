"""Means and ratios with intervals. The process is the unit: frames of one process are not independent."""

from dataclasses import dataclass

import numpy as np

LEVEL = 0.95


@dataclass(frozen=True)
class Estimate:
    """A value and its 95 % interval; low and high are None, and `note` says why, where processes are too few."""

    value: float
    low: float | None
    high: float | None
    processes: int
    note: str = ""


def mean(per_process: list[float]) -> Estimate:
    """Mean over processes, Student's interval."""
    from scipy import stats

    values = np.asarray(per_process, dtype=float)
    centre = float(values.mean())
    if len(values) < 3:
        return Estimate(centre, None, None, len(values), f"no interval from {len(values)} processes")
    interval = stats.ttest_1samp(values, 0.0).confidence_interval(LEVEL) if values.std() else (centre, centre)
    return Estimate(centre, float(interval[0]), float(interval[1]), len(values))


def ratio(above: list[float], below: list[float], seed: int = 1) -> Estimate:
    """Ratio of the means over processes, bootstrap interval (percentile, processes resampled)."""
    from scipy import stats

    a, b = np.asarray(above, dtype=float), np.asarray(below, dtype=float)
    value = float(a.mean() / b.mean())
    count = min(len(a), len(b))
    if count < 3:
        return Estimate(value, None, None, count, f"no interval from {count} processes")

    def statistic(x, y, axis=-1):
        return np.mean(x, axis=axis) / np.mean(y, axis=axis)

    interval = stats.bootstrap(
        (a, b), statistic, method="percentile", confidence_level=LEVEL, n_resamples=4999, rng=seed
    ).confidence_interval
    return Estimate(value, float(interval.low), float(interval.high), count)
