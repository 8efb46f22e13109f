"""S18: Phong's power of a cosine, and the sign of another."""

import numpy as np
import pytest

from harness import stress
from harness.stress.row import ROUNDOFF

SEED = 20201107
PRECISIONS = ("float32", "float64")


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("level", [1.0, 1e3, 1e6, float(10 ** np.random.default_rng(SEED).uniform(0, 6))])
def test_the_error_grows_with_the_exponent(strain, serial, level, precision):
    finding = strain(serial, "highlight", level, precision, SEED)
    assert finding.failures == 0
    expected = (level + 1) * ROUNDOFF[precision]
    assert expected / 10 < np.median(finding.errors) < 10 * expected


def test_a_cosine_above_1_is_brighter_than_the_light(strain, serial):
    found = [strain(serial, "highlight", 1e6, "float32", seed, phong="unclamped") for seed in range(3)]
    assert sum(finding.failures for finding in found) > 0


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("level", [0.1, 0.9, 0.9999, float(np.random.default_rng(SEED).uniform(0.1, 1))])
def test_no_light_from_behind(strain, serial, level, precision):
    assert strain(serial, "highlight-behind", level, precision, SEED).failures == 0


@pytest.mark.parametrize("precision", PRECISIONS)
def test_an_even_exponent_lights_it_and_a_broken_one_kills_it(strain, serial, precision):
    finding = strain(serial, "highlight-behind", 0.999, precision, SEED, phong="unclamped")
    assert finding.failures == finding.count
    assert np.median(finding.errors) == pytest.approx(0.999**50, rel=1e-2)


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("roundings", [10.0, 1e3, float(10 ** np.random.default_rng(SEED).uniform(1, 6))])
def test_a_light_above_the_plane_lights_all_pixels(strain, serial, roundings, precision):
    level = min(0.1, roundings * stress.rows()["in-plane"].limit(ROUNDOFF[precision], {}))
    finding = strain(serial, "in-plane", level, precision, SEED)
    assert finding.failures == 0 and finding.errors.size == finding.count


@pytest.mark.parametrize("precision", PRECISIONS)
def test_a_light_in_the_plane_is_switched_by_rounding(strain, serial, precision):
    """Some pixels are lit and others not, whatever the side that the light is on."""
    level = 0.01 * ROUNDOFF[precision]
    found = [strain(serial, "in-plane", level, precision, seed) for seed in range(4)]
    assert sum(finding.failures > 0 for finding in found) >= 2
    assert sum(finding.failures < finding.count for finding in found) >= 2
