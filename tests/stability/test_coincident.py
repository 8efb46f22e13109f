"""S13: a face that two boxes share, in their union and their intersection."""

import numpy as np
import pytest

from harness.stress.geometry.coincident import ROWS

BY_NAME = {row.name: row for row in ROWS}
SEED = 20201107
PRECISIONS = ("float32", "float64")


def drawn(name):
    return float(10 ** np.random.default_rng([SEED, len(name)]).uniform(1, 4))


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", BY_NAME)
def test_merged_boundaries_leave_no_face(strain, serial, name, precision):
    for level in (10.0, drawn(name)):
        finding = strain(serial, name, level, precision, SEED, merge="tolerant")
        assert finding.failures == 0 and finding.count > 5_000


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", BY_NAME)
def test_without_it_is_there_by_chance(strain, serial, name, precision):
    """float64 does not help."""
    finding = strain(serial, name, 30.0, precision, SEED, merge="none")
    assert finding.failures > 0.1 * finding.count


@pytest.mark.parametrize("precision", PRECISIONS)
def test_rays_of_the_row_are_inside_and_outside(precision):
    """Of the boxes that they are meant for, by the reciprocal vectors of each."""
    print("seed", SEED)
    for name, inside in (("coincident-or", True), ("coincident-and", False)):
        trial = BY_NAME[name].make(100.0, precision, np.random.default_rng(SEED))
        pairs = len(trial.scene.objects)
        for number, solid in enumerate(trial.scene.objects):
            first, second = solid.parts()
            origins = trial.rays[number::pairs, :3]
            assert within(first, origins).all() == inside
            assert not within(second, origins).any()


def within(box, points):
    found = np.linalg.solve(np.array(box.edges).T, (points - box.corner).T)
    return ((found > 0) & (found < 1)).all(axis=0)
