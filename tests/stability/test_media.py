"""S16: no ray is lost between media; and how "an index of 1 is outside" loses it."""

import numpy as np
import pytest

from harness.stress.row import ROUNDOFF

SEED = 20201107
PRECISIONS = ("float32", "float64")
DRAWN = int(np.random.default_rng(SEED).integers(6, 12))


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("level", [1, 8, DRAWN])
@pytest.mark.parametrize("name", ["media-matched", "media-nested", "media-overlap"])
def test_what_is_seen_through_balls(strain, serial, name, level, precision):
    for seed in (SEED, SEED + 1):
        finding = strain(serial, name, level, precision, seed)
        assert finding.failures == 0 and finding.count > 0


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("level", [1, 8, DRAWN])
def test_a_pane_in_slices_is_a_pane(strain, serial, level, precision):
    for seed in (SEED, SEED + 1):
        finding = strain(serial, "media-cut", level, precision, seed, merge="tolerant")
        assert finding.failures == 0 and finding.count > 0


@pytest.mark.parametrize("precision", PRECISIONS)
def test_face_by_face_the_medium_is_lost(strain, serial, precision):
    finding = strain(serial, "media-cut", 2, precision, SEED, merge="none")
    assert finding.failures > 0.5 * finding.count


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("level", [1.0, 30.0, 1e4])
def test_a_floor_is_seen_through_glass_that_stands_on_it(strain, serial, level, precision):
    for seed in (SEED, SEED + 1):
        finding = strain(serial, "glass-on-floor", level, precision, seed, merge="tolerant")
        assert finding.failures == 0 and finding.count > 0
        assert finding.errors.max() < 100 * level * ROUNDOFF[precision]


@pytest.mark.parametrize("precision", PRECISIONS)
def test_face_by_face_the_floor_is_lost(strain, serial, precision):
    found = [strain(serial, "glass-on-floor", 30.0, precision, seed, merge="none") for seed in (SEED, SEED + 1)]
    assert sum(finding.failures for finding in found) > 0.2 * sum(finding.count for finding in found)


def bent(way, normal, inside_of, outside, inside):
    """Snell's law for a ray at a face, which is an exit if `inside_of`."""
    cosine = way @ normal
    n = inside / outside if inside_of else outside / inside
    s = np.sqrt(1 - n * n * (1 - cosine**2))
    return n * way + ((s if inside_of else -s) - n * cosine) * normal


def test_an_index_of_1_taken_for_outside_traps_rays():
    """The ray comes to the face from inside. As its index is 1, it is taken to be outside and to enter: I - 2|c|N."""
    way, normal = np.array([1.0, 0.0, 0.0]), np.array([0.5, np.sqrt(0.75), 0.0])
    leaves_by_index, leaves_by_sign = False, way @ normal > 0
    np.testing.assert_allclose(bent(way, normal, leaves_by_sign, 1.0, 1.0), way, atol=1e-15)
    trapped = bent(way, normal, leaves_by_index, 1.0, 1.0)
    np.testing.assert_allclose(trapped, [0.5, -np.sqrt(0.75), 0.0], atol=1e-15)
    assert trapped @ normal < 0  # back into the ball, as from a mirror
