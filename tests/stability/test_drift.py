"""S9: directions and normals that are not renormalised."""

import math

import numpy as np
import pytest

from harness.stress.execution import drift
from harness.stress.row import ROUNDOFF

SEED = 20201107
PRECISIONS = ("float32", "float64")


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("level", [1, 4, 20, int(np.random.default_rng(SEED).integers(5, 40))])
def test_renormalised_rays_stay_in_the_ball(strain, serial, level, precision):
    finding = strain(serial, "drift", level, precision, SEED)
    assert finding.failures == 0
    # Of a sum of so many terms, each the power of what is rounded.
    assert finding.errors.max() < 16 * (level + 1) * ROUNDOFF[precision]


@pytest.mark.parametrize("precision", PRECISIONS)
def test_others_get_out_after_a_few_bounces(strain, serial, precision):
    """In float64 as in float32: the surface is missed by more than the offset, which is of the same precision."""
    assert strain(serial, "drift", 1, precision, SEED, renormalise="off").failures == 0
    finding = strain(serial, "drift", 6, precision, SEED, renormalise="off")
    assert finding.failures > 0.1 * finding.count


@pytest.mark.parametrize("impact", [0.3, 0.8])
def test_an_error_of_length_grows_as_the_row_says(impact):
    """d(1 + e) to d'(1 + (1 + 12 c⁴) e), by SPH-1, SPH-2 and REF-3 as they stand without NUM-4."""
    e = 1e-9
    f, d = np.array([impact, math.sqrt(1 - impact**2), 0.0]), np.array([0.0, -(1 + e), 0.0])
    b = -f @ d
    n = f + (b + math.sqrt(1 - ((f + b * d) ** 2).sum())) * d
    after = d - 2 * (d @ n) * n
    c2 = 1 - impact**2
    assert (np.linalg.norm(after) - 1) / e == pytest.approx(1 + 12 * c2**2, rel=1e-4)
    assert (np.linalg.norm(n) - 1) / e == pytest.approx(3 * c2, rel=1e-4)
    assert pytest.approx(1 + 12 * (1 - drift.IMPACT**2) ** 2) == drift.GROWTH
