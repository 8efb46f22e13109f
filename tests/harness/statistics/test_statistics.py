"""Medians, ratios, outliers, the noise floor: by hand, and by simulation with printed seeds."""

import itertools
import math

import numpy as np
import pytest

from harness.statistics import statistics
from harness.statistics.statistics import Estimate


def test_median_by_hand():
    found = statistics.median([14.0, 9.0, 10.0, 11.0, 30.0, 12.0, 8.0, 13.0, 7.0])
    # of 9 the ranks 2 and 8: P(fewer than 2 below the median) = (1 + 9) / 2^9, both sides 3.9 %; ranks 3 and 7: 18 %
    assert (found.value, found.low, found.high, found.processes, found.note) == (11, 8, 14, 9, "")
    assert statistics.median([4.0, 1.0, 2.0, 3.0]).value == 2.5


@pytest.mark.parametrize("count", [5, 6, 8, 9, 12, 20, 21])
def test_ranks_are_the_narrowest_that_cover(count):
    def covers(rank):
        return 1 - 2 * sum(math.comb(count, k) for k in range(rank)) / 2**count

    found = statistics.median(range(1, count + 1))
    rank = int(found.low)
    assert found.low + found.high == count + 1
    assert (covers(rank) >= 0.95 or (count == 5 and covers(rank) == 0.9375)) and covers(rank + 1) < 0.95


def test_equal_values_have_an_interval_of_no_width():
    found = statistics.median([0.1] * 5)
    assert found.value == found.low == found.high == 0.1


@pytest.mark.parametrize("count", [1, 2, 4])
def test_too_few_processes_say_so(count):
    for found in (statistics.median([1.0] * count), statistics.ratio([1.0] * count, [1.0] * 9)):
        assert (found.value, found.low, found.high) == (1, None, None)
        assert found.note == f"no interval from {count} process{'' if count == 1 else 'es'}"
        assert statistics.verdict(found, None) == statistics.NOT_RESOLVED


@pytest.mark.parametrize(("count", "level"), [(5, 0.9375), (6, 0.96875), (12, 0.9614)])
def test_median_holds_its_level(count, level):
    """Also for values that are not normal: of 4000 intervals the share that holds the truth, within 4 of its errors."""
    rng = np.random.default_rng(5)
    truth = math.exp(1)  # the median of a log-normal distribution
    found = [statistics.median(row) for row in rng.lognormal(1, 1, (4000, count))]
    share = np.mean([e.low <= truth <= e.high for e in found])
    assert abs(share - level) < 4 * math.sqrt(level * (1 - level) / 4000)


def test_ratio_against_a_bootstrap_written_out():
    """Every resample of 5 processes is equally likely: all 5^5 are written out."""
    above, below = np.array([9.0, 12.0, 10.0, 11.0, 15.0]), np.array([2.0, 2.5, 1.9, 2.2, 2.1])
    found = statistics.ratio(above, below)
    assert found.value == pytest.approx(11 / 2.1) and found.processes == 5
    choices = np.array(list(itertools.product(range(5), repeat=5)))
    tops, bottoms = np.median(above[choices], axis=1), np.median(below[choices], axis=1)
    low, high = np.percentile((tops[:, None] / bottoms).ravel(), [2.5, 97.5])
    assert (found.low, found.high) == pytest.approx((low, high), rel=0.03)


def test_ratio_of_rounds_by_hand():
    """4.5, 4.8, 5, 5.26, 7.14 in the five rounds, of which the range is the interval."""
    above, below = np.array([9.0, 12.0, 10.0, 11.0, 15.0]), np.array([2.0, 2.5, 1.9, 2.2, 2.1])
    found = statistics.ratio(above, below, paired=True)
    assert (found.value, found.low, found.high) == pytest.approx((5.0, 4.5, 15 / 2.1)) and found.processes == 5
    turned = statistics.ratio(below, above, paired=True)
    assert (turned.value, turned.low, turned.high) == pytest.approx((1 / 5.0, 2.1 / 15, 1 / 4.5))


def test_ratio_is_the_same_for_the_same_seed():
    above, below = [3.0, 4.0, 5.0, 4.5, 3.7], [1.0, 1.1, 1.3, 1.25, 0.95]
    assert statistics.ratio(above, below, seed=3) == statistics.ratio(above, below, seed=3)


def test_rounds_that_do_not_match_are_a_fault():
    with pytest.raises(ValueError, match="rounds of 6 and 5"):
        statistics.ratio([1.0] * 6, [1.0] * 5, paired=True)


def test_pairing_takes_out_what_disturbs_a_whole_round():
    rounds = np.linspace(1, 2, 20)  # a drift of 100 %
    above, below = 1.05 * rounds, rounds
    assert statistics.verdict(statistics.ratio(above, below), None) == statistics.NOT_RESOLVED
    assert statistics.verdict(statistics.ratio(above, below, paired=True), None) == "slower"


def times(rng, count, noise=0.02, outliers=0.0, factor=1.0, frames=10):
    """Seconds of `count` processes: normal noise of each, and the median of frames of which some are outliers."""
    own = factor * (1 + noise * rng.standard_normal((count, 1))) * (1 + 0.01 * rng.standard_normal((count, frames)))
    hit = rng.random((count, frames)) < outliers
    own[hit] *= rng.uniform(2, 10, hit.sum())
    return np.median(own, axis=1)


@pytest.mark.slow
@pytest.mark.parametrize("paired", [False, True])
@pytest.mark.parametrize("count", [5, 7, 20])
def test_ratio_of_equals_is_rarely_resolved(count, paired):
    """False positives of the interval alone, 5 % if it held its level: about 3 to 7 % (600 draws, +- 3 %)."""
    rng = np.random.default_rng(count)
    draws = ((times(rng, count), times(rng, count)) for _ in range(600))
    found = [statistics.verdict(statistics.ratio(*draw, paired), None) for draw in draws]
    assert 0.005 <= np.mean([text != statistics.NOT_RESOLVED for text in found]) <= 0.1


@pytest.mark.parametrize("outliers", [0.0, 0.12])
def test_a_5_percent_difference_is_found_and_none_is_not(outliers):
    """20 repetitions, 2 % noise, each draw with the floor of an A/A pair of its own: at least 95 of 100 are right."""
    equal, slower = [], []
    for seed in range(100):
        rng = np.random.default_rng(seed)
        floor = statistics.noise_floor(times(rng, 20, outliers=outliers), times(rng, 20, outliers=outliers)).value
        one, other, longer = (times(rng, 20, outliers=outliers, factor=factor) for factor in (1, 1, 1.05))
        if statistics.verdict(statistics.ratio(other, one, paired=True), floor) != statistics.NOT_RESOLVED:
            equal.append(seed)
        if statistics.verdict(statistics.ratio(longer, one, paired=True), floor) != "slower":
            slower.append(seed)
    assert len(equal) <= 5 and len(slower) <= 5, f"wrong at the seeds {equal}, {slower}"


def test_outliers_by_hand():
    # median 10, deviations 1 0.5 0 0 0.5 0.7 and 7.4 or 7.5: MAD 0.5, 14.826 of it 7.413
    assert statistics.outliers([9.0, 9.5, 10.0, 10.0, 10.5, 10.7, 17.4]) == [False] * 7
    assert statistics.outliers([9.0, 9.5, 10.0, 10.0, 10.5, 10.7, 17.5]) == [False] * 6 + [True]
    # all equal but one: 14.826 of 0.2 %, 2.97 %
    assert statistics.outliers([1.0] * 5 + [1.029]) == [False] * 6
    assert statistics.outliers([1.0] * 5 + [1.031]) == [False] * 5 + [True]
    assert statistics.outliers([1.0, 1.0, 1.0, 9.0]) == [False] * 4
    assert statistics.outliers([]) == []


def test_outliers_are_those_of_12_percent_and_no_others():
    wrong = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        values, hit = 1 + 0.02 * rng.standard_normal(50), rng.random(50) < 0.12
        values[hit] *= rng.uniform(2, 10, hit.sum())
        wrong += statistics.outliers(values) != hit.tolist()
    assert wrong <= 2


def test_the_floor_is_the_far_end_of_the_pair_s_interval():
    rounds = [1.0, 1.02, 0.98, 1.01, 0.99, 1.0]
    found = statistics.noise_floor(rounds, [1.03 * value for value in rounds])
    assert found.ratio.value == pytest.approx(1.03)
    assert found.value == pytest.approx(0.03) and found.reason == ""
    assert statistics.noise_floor([1.03 * value for value in rounds], rounds).value == pytest.approx(0.03)


def test_no_floor_has_a_reason():
    found = statistics.noise_floor([1.0] * 4, [1.0] * 4)
    assert found.value is None and found.reason == "no interval from 4 processes of the pair, it needs 5"
    found = statistics.noise_floor([], [])
    assert found.value is None and found.ratio is None and found.reason


@pytest.mark.parametrize(
    ("ratio", "floor", "verdict"),
    [
        ((1.05, 1.02, 1.08), None, "slower"),
        ((1.05, 1.02, 1.08), 0.04, "slower"),
        ((1.05, 1.02, 1.08), 0.06, "not resolved"),
        ((1.05, 0.99, 1.08), None, "not resolved"),
        ((0.8, 0.7, 0.9), None, "faster"),
        ((0.8, 0.7, 0.9), 0.24, "faster"),  # 1 / 0.8 = 1.25
        ((0.8, 0.7, 0.9), 0.26, "not resolved"),
        ((1.0, 1.0, 1.0), None, "not resolved"),
        ((2.0, None, None), None, "not resolved"),
    ],
)
def test_verdict(ratio, floor, verdict):
    assert statistics.verdict(Estimate(*ratio, 9), floor) == verdict
