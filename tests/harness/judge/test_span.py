"""How many ill-conditioned pixels may leave what perturbed references span: by hand, by number, and by simulation."""

import os

import numpy as np
import pytest
from scipy.special import betainc

from harness.judge import span

SEED = 71


def test_a_span_grows_by_half_its_width_and_the_tolerance():
    low, high = np.array([[0.2, 0.0, 0.5]]), np.array([[0.4, 0.0, 0.5]])
    spans = np.stack([low, high])
    for channel, value, leaves in [(0, 0.1, 0), (0, 0.08, 1), (0, 0.52, 1), (1, 0.009, 0), (1, 0.011, 1), (2, 0.4, 1)]:
        pixel = low.copy()
        pixel[0, channel] = value
        assert span.leaves(pixel, spans, 0.01).tolist() == [bool(leaves)], (channel, value)
    assert span.leaves(low + 3e-4, spans, 1e-9).tolist() == [False]  # no visible change
    assert span.leaves(low * np.nan, spans, 1e-9).tolist() == [True]
    far = span.excess(np.array([[0.7, 0.0, 0.5]]), spans, 0.01)
    assert far == pytest.approx(0.7 - 0.4 - 0.1 - 0.01)


def test_how_many_it_takes():
    """5^-13 and 9^-10 are the first below 1e-9: so many pixels tell a wrong picture, and fewer never do."""
    for further, needed in ((4, 13), (8, 10)):
        clear = (0,) * further
        assert [span.most(count, clear) for count in (1, 2, 3, needed - 1)] == [1, 2, 3, needed - 1]
        assert span.most(needed, clear) == span.most(100_000, clear) == needed - 1


def test_it_is_the_quantile_of_a_binomial():
    """Against scipy's incomplete beta function: P(X >= k) of X out of others * worst + k."""
    seed = int.from_bytes(os.urandom(4))
    print("seed", seed)
    rng = np.random.default_rng(seed)
    for count in (0, 1, 9, 13, 500, 20_000):
        left = tuple(rng.integers(0, count // rng.integers(1, 40) + 1, rng.choice([4, 8])).tolist())
        k, others = np.arange(1, count + 1), len(left)
        chance = betainc(k, others * max(left) + 1, 1 / (others + 1))
        low, high = (np.count_nonzero(chance >= span.ALARM * bound) for bound in (1 + 1e-6, 1 - 1e-6))
        assert low <= span.most(count, left) <= high, left


def test_the_share_that_further_references_leave_too_is_let_pass():
    """The largest number is the share of the worst of them and some standard deviations."""
    assert 300 < span.most(1000, (300,) * 4) < 500
    assert span.most(1000, (0, 0, 0, 300)) == span.most(1000, (300,) * 4)
    assert span.most(100_000, (30_000,) * 8) < 31_500
    assert span.most(20, (20,) * 4) == 20


@pytest.mark.parametrize("further", [4, 8])
@pytest.mark.parametrize("count", [3, 30, 3000])
def test_a_right_picture_is_hardly_ever_rejected(monkeypatch, count, further):
    """Where it leaves spans as further references do, each pixel with a probability of its own: at an ALARM that can be
    counted, the share of alarms stays below it."""
    print("seed", SEED)
    rng = np.random.default_rng([SEED, count, further])
    monkeypatch.setattr(span, "ALARM", 0.02)
    alarms, tries = 0, 400
    for _ in range(tries):
        chance = rng.beta(0.3, 2, count)
        left = (rng.uniform(size=(further + 1, count)) < chance).sum(axis=1)
        alarms += left[0] > span.most(count, tuple(left[1:].tolist()))
    assert alarms <= 18  # of 400 so many or more have a probability of 1e-3 at 0.02
