"""S20: bad samples, the pixels that they kill, and whether anybody is told."""

import numpy as np
import pytest

from harness.stress.light.nan import SHARE

SEED = 20201107
PRECISIONS = ("float32", "float64")


@pytest.mark.parametrize("precision", PRECISIONS)
def test_a_bad_sample_kills_its_pixel(strain, serial, precision):
    finding = strain(serial, "nan", 16, precision, SEED, fresnel="unclamped")
    expected = SHARE * 16**2 * finding.count
    assert abs(finding.failures - expected) < 4 * np.sqrt(expected)
    few = strain(serial, "nan", 2, precision, SEED, fresnel="unclamped")
    assert few.failures < 0.1 * few.count


@pytest.mark.parametrize("precision", PRECISIONS)
def test_a_clamp_has_no_bad_samples(strain, serial, precision):
    assert strain(serial, "nan", 16, precision, SEED).failures == 0


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("floating_point", ["strict", "contract"])
def test_all_are_counted(strain, serial, floating_point, precision):
    for level in (0.4, float(10 ** np.random.default_rng(SEED).uniform(-3, -1))):
        assert strain(serial, "nan-counted", level, precision, SEED, floating_point=floating_point).failures == 0


@pytest.mark.parametrize("precision", PRECISIONS)
def test_fast_math_hides_them(strain, serial, precision):
    """A weight that is not a number compares as it likes: the pixel is black, and the count 0."""
    finding = strain(serial, "nan-counted", 0.1, precision, SEED, floating_point="fast")
    assert abs(finding.failures - 0.1 * finding.count) < 0.03 * finding.count
