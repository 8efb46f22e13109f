import math

import numpy as np
import pytest

from harness import statistics


def test_mean_by_hand():
    found = statistics.mean([9.0, 10.0, 11.0, 14.0])
    half = 3.182446305 * math.sqrt(14 / 3 / 4)  # Student's t for 3 degrees of freedom, 97.5 %
    assert (found.value, found.processes, found.note) == (11, 4, "")
    assert (found.low, found.high) == pytest.approx((11 - half, 11 + half), rel=1e-8)


def test_equal_values_have_an_interval_of_no_width():
    found = statistics.mean([0.1] * 5)
    assert found.value == pytest.approx(0.1) and found.high - found.low < 1e-15


@pytest.mark.parametrize("count", [1, 2])
def test_too_few_processes_say_so(count):
    for found in (statistics.mean([1.0] * count), statistics.ratio([1.0] * count, [1.0] * 9)):
        assert (found.value, found.low, found.high) == (1, None, None)
        assert found.note == f"no interval from {'1 process' if count == 1 else '2 processes'}"


def test_mean_holds_its_level():
    """Of 2000 intervals about 95 % hold the truth: 99.9 % of such counts lie within 0.95 +- 0.016."""
    rng = np.random.default_rng(5)
    found = [statistics.mean(row) for row in rng.normal(3, 1, (2000, 5))]
    assert abs(np.mean([e.low <= 3 <= e.high for e in found]) - 0.95) < 0.016


def test_ratio_against_a_bootstrap_written_out():
    rng = np.random.default_rng(6)
    above, below = rng.normal(10, 1, 8), rng.normal(2, 0.1, 7)
    found = statistics.ratio(list(above), list(below))
    assert found.value == pytest.approx(above.mean() / below.mean())
    means = rng.choice(above, (20000, 8)).mean(axis=1) / rng.choice(below, (20000, 7)).mean(axis=1)
    low, high = np.percentile(means, [2.5, 97.5])
    assert (found.low, found.high) == pytest.approx((low, high), rel=0.01)
    assert found.processes == 7


def test_ratio_is_the_same_for_the_same_seed():
    above, below = [3.0, 4.0, 5.0, 4.5], [1.0, 1.1, 1.3]
    assert statistics.ratio(above, below, 3) == statistics.ratio(above, below, 3) != statistics.ratio(above, below, 4)
