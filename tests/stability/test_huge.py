"""S3: a huge sphere as the ground."""

import numpy as np
import pytest

from harness.stress.geometry.huge import ROWS
from harness.stress.row import ROUNDOFF

BY_NAME = {row.name: row for row in ROWS}
SEED = 20201107
PRECISIONS = ("float32", "float64")
NARROW = ("robust", "textbook")


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("method", NARROW)
def test_every_narrow_form_loses_digits_by_the_radius(strain, serial, method, precision):
    """Robust too: what cancels is f·f - r², which all of them have."""
    u, grew = ROUNDOFF[precision], []
    for level in 10 ** np.random.default_rng(SEED).uniform((1, 4), (2, 5)):
        errors = strain(serial, "huge-sphere", level, precision, SEED, sphere=method).errors
        assert np.median(errors) < 3 * u * level
        grew.append(np.median(errors))
    assert grew[1] > 50 * grew[0]


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("method", NARROW)
def test_the_ground_is_lost(strain, serial, method, precision):
    level = 100 * BY_NAME["huge-sphere"].limit(ROUNDOFF[precision], {"sphere": method})
    finding = strain(serial, "huge-sphere", level, precision, SEED, sphere=method)
    assert finding.failures > 0.5 * finding.count


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", BY_NAME)
def test_twice_the_digits_hold(strain, serial, name, precision):
    u = ROUNDOFF[precision]
    for level in (30.0, 0.3 / u, 10 / u):
        finding = strain(serial, name, level, precision, SEED, sphere="wide")
        assert finding.failures == 0
        assert np.median(finding.errors) < 4 * BY_NAME[name].expected(level, u, {"sphere": "wide"})


@pytest.mark.parametrize("precision", PRECISIONS)
def test_the_aligned_ground_flatters(strain, serial, precision):
    """With the centre straight below, f has one component, and its square is exact for longer."""
    generic, aligned = (strain(serial, name, 1e3, precision, SEED, sphere="robust") for name in BY_NAME)
    assert np.median(aligned.errors) < 0.1 * np.median(generic.errors)
