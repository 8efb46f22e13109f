"""What a smaller model changes in a picture: known in numbers, and in words."""

import numpy as np
import pytest
import seeds

from harness.statistics import change
from harness.statistics.change import Change


def test_the_error_added_is_known_as_well_as_it_says():
    """Against truths with noise, of pictures of which one errs more: the scores are normal."""
    (seed, *_) = seeds.numbers("worth")
    print("seed", seed)
    rng = np.random.default_rng(seed)
    shape = (9, 7, 3)
    true, error = rng.uniform(size=shape), rng.uniform(0.01, 0.2, size=shape)
    full, reduced = (true + scale * rng.normal(size=shape) for scale in (0.01, 0.05))
    exact = np.mean((reduced - true) ** 2 - (full - true) ** 2)
    scores = []
    for _ in range(2000):
        noisy = true + error * rng.normal(size=shape)
        found = change.between(reduced, full, noisy, error, 0.0)
        scores.append((found.added - exact) / found.doubt)
    assert abs(np.mean(scores)) < 5 / np.sqrt(2000)
    assert abs(np.std(scores) - 1) < 5 / np.sqrt(4000)
    same = change.between(full, full, noisy, error, 0.1)
    assert (same.pixels, same.largest, same.added, same.doubt) == (0, 0, 0, 0)


def test_a_change_in_numbers():
    full = np.zeros((2, 3, 3))
    truth, reduced = full + 0.5, full.copy()
    reduced[1, 2, 0], reduced[0, 0, 1] = 0.25, 5e-10  # of which the second is no difference
    found = change.between(reduced, full, truth, np.full((2, 3, 3), 0.01), 0.02)
    assert (found.pixels, found.largest) == (1 / 6, 0.25)
    assert found.added == pytest.approx((0.25**2 - 0.5**2) / 18)
    assert found.doubt == pytest.approx(np.hypot(2 * 0.25 * 0.01 / 18, 2 * 0.02 * 0.25 / np.sqrt(18)))


@pytest.mark.parametrize(
    ("told", "proof", "verdict"),
    [
        ((0.0, 0.0, 0.0, 0.0), "it is black", "needs none of it (proved): it is black"),
        ((0.0, 0.0, 0.0, 0.0), "", "changes no pixel (measured)"),
        ((0.1, 0.5, 2e-6, 1.1e-6), "", "error: not resolved"),
        ((0.1, 0.5, 2e-6, 0.9e-6), "", "error grows"),
        ((0.1, 0.5, -2e-6, 0.9e-6), "", "error shrinks"),
    ],
)
def test_verdicts(told, proof, verdict):
    assert Change(*told).verdict(proof) == verdict
