"""S19: the code of a pixel that is partly covered."""

import numpy as np
import pytest

SEED = 20201107
PRECISIONS = ("float32", "float64")


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("level", [1 / 16, 0.5, 15 / 16, float(np.random.default_rng(SEED).uniform(0.1, 0.9))])
def test_light_is_averaged(strain, serial, level, precision):
    finding = strain(serial, "codes", level, precision, SEED)
    assert finding.failures == 0 and finding.errors.max() <= 1


def test_codes_are_not_light(strain, serial):
    """Half of white over black: 128, not 188."""
    finding = strain(serial, "codes", 0.5, "float64", SEED, arithmetic="srgb")
    assert finding.failures == finding.count
    assert finding.errors.max() == 188 - 128
