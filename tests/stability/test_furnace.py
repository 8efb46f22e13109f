"""S17: a lossless ball in a white world."""

import mpmath as mp
import numpy as np
import pytest

from harness.stress.light.optics import reflectance, white_light
from harness.stress.row import ROUNDOFF

SEED = 20201107
PRECISIONS = ("float32", "float64")


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("level", [1, 2, 7, 20])
def test_all_but_what_the_depth_cuts_off(strain, serial, level, precision):
    finding = strain(serial, "furnace", level, precision, SEED)
    assert finding.failures == 0 and len(finding.errors) == finding.count


@pytest.mark.parametrize("precision", PRECISIONS)
def test_at_the_rim(strain, serial, precision):
    """Down to where the sign of d·n is lost (the row's limit)."""
    u = ROUNDOFF[precision]
    for level in (0.1, 1e3 * u, float(np.random.default_rng(SEED).uniform(0.001, 0.1))):
        assert strain(serial, "furnace-grazing", level, precision, SEED).failures == 0
    finding = strain(serial, "furnace-grazing", u, precision, SEED)
    assert finding.failures <= 0.05 * finding.count


def test_surfaces_in_a_row_are_the_closed_form():
    """A ball is two surfaces; to order d all comes back but (1 - R) R^(d - 1)."""
    r = reflectance((1, 1), (2.25, 1), mp.mpf("0.3"))
    for depth in (1, 2, 5, 9):
        assert abs(white_light([r, r], depth) - (1 - (1 - r) * r ** (depth - 1))) < 1e-15
    assert reflectance((2.25, 1), (1, 1), mp.mpf("0.7")) == 1
    back = mp.sqrt(1 - (1 - mp.mpf("0.3") ** 2) / mp.mpf("2.25"))
    assert abs(reflectance((2.25, 1), (1, 1), back) - r) < 1e-14


def test_schlick_is_not_good_enough():
    """Nor is "it looks white": depth 2 is off by 4e-2, and Schlick's R by 1e-2."""
    cosines = np.linspace(0.05, 1, 50)
    exact = np.array([float(reflectance((1, 1), (2.25, 1), mp.mpf(c))) for c in cosines])
    schlick = 0.04 + 0.96 * (1 - cosines) ** 5
    assert abs(schlick - exact).max() > 1e-2
    assert float(1 - white_light([mp.mpf("0.04")] * 2, 2)) == pytest.approx(0.0384)
