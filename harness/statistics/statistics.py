"""Computes medians and ratios with intervals, outliers, and the noise floor.

The unit of observation is the process, as frames of one process are not independent of each other.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from statistics import median as middle  # without numpy: quicker for the few frames of a process

import numpy as np

LEVEL = 0.95
LEAST = 5  # processes that an interval needs: the range of 5 covers the median with 93.75 %, of 4 with 87.5 %
RESAMPLES = 4999
OUTLYING = 14.826  # times MAD, which is 10 standard deviations of a normal distribution, as in hyperfine
LEAST_MAD = 0.002  # of the median: closer agreement of repetitions is chance, given clock and system
NOT_RESOLVED = "not resolved"


@dataclass(frozen=True)
class Estimate:
    """A value and its interval, of 95 % unless told otherwise.

    low and high are None for too few processes, with the reason in `note`.
    """

    value: float
    low: float | None
    high: float | None
    processes: int
    note: str = ""


@dataclass(frozen=True)
class Floor:
    """The noise floor of a run, from a cell that ran twice in every round (an A/A pair).

    ratio: of the two processes, which differ by noise alone; None without a pair. reason: "", or why `value` is None.
    """

    ratio: Estimate | None
    reason: str = ""

    @property
    def value(self) -> float | None:
        """The largest relative difference in the interval of the pair; None if unknown."""
        if self.ratio is None or self.ratio.low is None:
            return None
        return max(difference(self.ratio.low), difference(self.ratio.high))


def too_few(processes: int, least: int = LEAST) -> str:
    """The note of an Estimate without an interval. least: processes that it needs."""
    needed = f", it takes {least}" if least != LEAST else ""
    return f"no interval from {processes} process{'es' if processes > 1 else ''}{needed}"


def median(per_process: Sequence[float], level: float = LEVEL) -> Estimate:
    """Median over processes, with an interval between two of them that holds for any distribution.

    The ends have the ranks (k, n + 1 - k): the narrowest pair that covers the median with at least `level` by the
    binomial distribution (Conover, Practical Nonparametric Statistics, 1999, section 3.2); for 5 processes the range.
    """
    values = np.sort(np.asarray(per_process, dtype=float))
    count, needed = len(values), processes_for(level)
    centre = float(np.median(values))
    if count < needed:
        return Estimate(centre, None, None, count, too_few(count, needed))
    rank = _rank(count, level)
    return Estimate(centre, float(values[rank - 1]), float(values[count - rank]), count)


def processes_for(level: float) -> int:
    """The processes that an interval needs: their range covers the median with 1 - 2^(1 - n); LEAST for 95 %."""
    return max(LEAST, math.ceil(1 - math.log2(1 - level))) if level > LEVEL else LEAST


@lru_cache
def _rank(count: int, level: float) -> int:
    """The rank, from 1, of the interval's lower end: the quantile of a binomial distribution, of `count` fair coins.

    Without scipy.stats, which takes a second to import: every report and comparison asks for it.
    """
    ways = itertools.accumulate(math.comb(count, heads) for heads in range(count + 1))
    return max(1, next(heads for heads, some in enumerate(ways) if some / 2**count >= (1 - level) / 2))


def ratio(
    above: Sequence[float], below: Sequence[float], paired: bool = False, seed: int = 1, level: float = LEVEL
) -> Estimate:
    """Ratio of two times with its interval.

    Not paired: the ratio of the medians over processes, with a bootstrap interval (percentile); both sides are
    resampled independently. Paired: the `median` over rounds of the ratio within a round. Disturbances of a whole round
    cancel, and the drift within a round is undone by the next, which runs in reverse order. Its interval is that of
    `median` with `level`, as a bootstrap of the median of 7 rounds covers only 88 %. `above` and `below` then have one
    process for each round, in order; ValueError if their lengths differ.
    """
    if not paired:
        return _ratio(tuple(above), tuple(below), seed)
    if len(above) != len(below):
        raise ValueError(f"rounds of {len(above)} and {len(below)} processes cannot be paired")
    return median(np.divide(above, below), level)


@lru_cache(maxsize=2**16)  # a report asks for the same ratio in several places
def _ratio(above: tuple[float, ...], below: tuple[float, ...], seed: int) -> Estimate:
    from scipy import stats

    def statistic(x, y, axis=-1):
        return np.median(x, axis=axis) / np.median(y, axis=axis)

    samples = np.asarray(above, dtype=float), np.asarray(below, dtype=float)
    value = float(statistic(*samples))
    count = min(len(above), len(below))
    if count < LEAST:
        return Estimate(value, None, None, count, too_few(count))
    interval = stats.bootstrap(
        samples, statistic, method="percentile", confidence_level=LEVEL, n_resamples=RESAMPLES, rng=seed
    ).confidence_interval
    return Estimate(value, float(interval.low), float(interval.high), count)


def outliers(values: Sequence[float]) -> list[bool]:
    """For each value: whether its distance from the median is above 14.826 times the median absolute deviation (MAD).

    The MAD is set to at least 0.2 % of the median. Fewer than 5 values have no outliers, as their MAD means nothing.
    """
    if len(values) < LEAST:
        return [False] * len(values)
    centre = middle(values)
    away = [abs(value - centre) for value in values]
    limit = OUTLYING * max(middle(away), LEAST_MAD * abs(centre))
    return [distance > limit for distance in away]


def noise_floor(first: Sequence[float], again: Sequence[float]) -> Floor:
    """The noise floor of an A/A pair. first, again: times of the first and the second process of each round."""
    if not len(first) or not len(again):
        return Floor(None, "no round has a steady time of both processes of the pair")
    pair_ratio = ratio(again, first, paired=True)
    return Floor(pair_ratio, f"{pair_ratio.note} of the pair, it needs {LEAST}" if pair_ratio.low is None else "")


def difference(ratio: float) -> float:
    """The distance of a ratio from 1, equal for a / b and b / a: 0.25 for 1.25 and for 0.8."""
    return max(ratio, 1 / ratio) - 1


def verdict(ratio: Estimate, floor: float | None) -> str:
    """ "faster" or "slower" if the ratio is significantly below or above 1 and differs from 1 by more than the noise
    floor, else "not resolved". Without a floor the interval alone decides; without an interval nothing is resolved.
    """
    if ratio.low is None or ratio.low <= 1 <= ratio.high or difference(ratio.value) <= (floor or 0.0):
        return NOT_RESOLVED
    return "slower" if ratio.value > 1 else "faster"
