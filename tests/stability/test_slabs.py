"""S12: rays along the faces of a box: 0·∞ or a branch."""

from fractions import Fraction

import numpy as np
import pytest

from harness.stress.geometry import slabs

BY_NAME = {row.name: row for row in slabs.ROWS}
SEED = 20201107
PRECISIONS = ("float32", "float64")
LEVELS = 0.0, 2.0, 2.0**15


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", BY_NAME)
def test_a_branch_is_right_of_every_ray(strain, serial, name, precision):
    for level in LEVELS:
        finding = strain(serial, name, level, precision, SEED, slab="branch")
        assert finding.failures == 0 and finding.errors.max() < 1e-4


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", BY_NAME)
def test_plain_slabs_lose_rays_in_a_face(strain, serial, name, precision):
    finding = strain(serial, name, LEVELS[1], precision, SEED, slab="plain")
    assert finding.failures > (0.02 if name == "slabs" else 0.3) * finding.count


def first(*ray):
    return slabs._first([Fraction(x) for x in ray], [0, 0, 0], [1, 1, 1])


@pytest.mark.parametrize(
    ("ray", "t"),
    [
        ((-2, 0.5, 0.5, 1, 0, 0), 2),
        ((0.25, 0.5, 0.5, 1, 0, 0), 0.75),  # from the inside
        ((-2, 1, 0, 1, 0, 0), 2),  # along an edge: the box is closed
        ((-2, 1.5, 0.5, 1, 0, 0), None),
        ((-1, 2, 1, 1, -1, 0), 1),  # in the plane of a face, through its edge at (0, 1)
        ((-1, 3, 1, 1, -1, 0), 2),  # through the corner of that face
        ((-1, 3.5, 1, 1, -1, 0), None),
        ((2, 0.5, 0.5, 1, 0, 0), None),  # behind
        ((0, 0.5, 0.5, 1, 0, 0), 1),  # from a face inward: 0 is no hit
        ((0, 0.5, 0.5, -1, 0, 0), None),
    ],
)
def test_truth_of_rays_worked_out_by_hand(ray, t):
    assert first(*ray) == t


@pytest.mark.parametrize("name", BY_NAME)
def test_rays_are_what_the_row_says(name):
    print("seed", SEED)
    level = 4.0
    trial = BY_NAME[name].make(level, "float32", np.random.default_rng(SEED))
    d, offsets = trial.rays[:, 3:], trial.rays[:, :3] - level * np.array([1, -1, 1])
    zeros = (d == 0).sum(axis=1)
    assert set(zeros) == {1, 2}
    assert np.signbit(d[d == 0]).any() and not np.signbit(d[d == 0]).all()
    in_plane = ((d == 0) & ((offsets == 0) | (offsets == 1))).any(axis=1)
    assert in_plane.all() if name == "slabs-inside" else 0.45 < in_plane.mean() < 0.55
