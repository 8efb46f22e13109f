"""S25: solids that a ray steps through (CSG-7): thin parts, faces in one place, and faces that are grazed."""

import numpy as np
import pytest

from harness.stress.geometry.stepping import ROWS, thickness_passed_over

BY_NAME = {row.name: row for row in ROWS}
U = {"float32": 2.0**-24, "float64": 2.0**-53}
SEED = 20201109
PRECISIONS = ("float32", "float64")


@pytest.mark.parametrize("precision", PRECISIONS)
def test_intervals_know_parts_of_any_thickness(strain, serial, precision):
    for level in (10.0, 1e7, 1e16):
        finding = strain(serial, "thin-part", level, precision, SEED, csg="intervals")
        assert finding.failures == 0 and finding.count > 5_000


@pytest.mark.parametrize("precision", PRECISIONS)
def test_a_step_passes_over_what_is_thinner(strain, serial, precision):
    """From the thickness of a step on, which theory knows to a factor of two, nearly all rays stay inside for ever."""
    methods = {"csg": "stepping", "offset": "bounded", "epsilon": 32 * U[precision]}
    limit = thickness_passed_over(U[precision], methods)
    finding = strain(serial, "thin-part", limit / 4, precision, SEED, csg="stepping")
    assert finding.failures == 0
    finding = strain(serial, "thin-part", limit * 2, precision, SEED, csg="stepping")
    assert finding.failures > 0.9 * finding.count


def test_a_fixed_step_passes_over_more(strain, serial):
    """A ten-thousandth is longer than a part that neither precision minds."""
    for level, share in ((2e3, 0.0), (2e4, 1.0)):
        finding = strain(serial, "thin-part", level, "float64", SEED, csg="stepping", offset="fixed")
        assert finding.failures == share * finding.count


@pytest.mark.parametrize("precision", PRECISIONS)
def test_a_grazed_face_is_hit_beside_the_truth(strain, serial, precision):
    """By the length of the step over the sine, which is tens of roundings over the sine."""
    level = 100.0
    errors = {
        csg: np.median(strain(serial, "grazed-face", level, precision, SEED, csg=csg).errors)
        for csg in ("intervals", "stepping")
    }
    print(errors)
    assert errors["intervals"] < 4 * U[precision] * level < 8 * U[precision] * level < errors["stepping"]
    assert errors["stepping"] < 64 * U[precision] * level


@pytest.mark.parametrize("name", ["coincident-or", "coincident-and"])
@pytest.mark.parametrize("precision", PRECISIONS)
def test_faces_in_one_place_are_not_told_apart(strain, serial, name, precision):
    finding = strain(serial, name, 30.0, precision, SEED, csg="stepping")
    print(f"{finding.failures} of {finding.count}")
    assert finding.failures > 0.1 * finding.count


@pytest.mark.parametrize("precision", PRECISIONS)
def test_rays_of_the_rows_start_where_they_should(precision):
    """In the ball or in both boxes, by the numbers that the renderers get."""
    print("seed", SEED)
    for level in (10.0, 1e5):
        trial = BY_NAME["thin-part"].make(level, precision, np.random.default_rng(SEED))
        ball, _ = trial.scene.objects[0].parts()
        assert (np.linalg.norm(trial.rays[:, :3] - ball.centre, axis=1) < 0.95).all()
        trial = BY_NAME["grazed-face"].make(level, precision, np.random.default_rng(SEED))
        for box in trial.scene.objects[0].parts():
            found = np.linalg.solve(np.array(box.edges).T, (trial.rays[:, :3] - box.corner).T)
            assert ((found > 0) & (found < 1)).all()
