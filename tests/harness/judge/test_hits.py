"""First hits raced in place of a picture: which rays, who is masked, what is wrong, and what the record says."""

import re
from dataclasses import replace

import numpy as np
import pytest

from harness.judge import hits, reference
from harness.judge.reference import NoReference, Reference
from harness.process import repetition
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.needs import shapes
from harness.store import store

SEED = 4
SCENE = """CAMERA (0.3,0.1,0) (1.1,0,0.2) (-0.02,1.2,0.11) (0.2,-0.3,4)
LIGHT (4,5,6) (1,1,1) 0
SPHERE (0.1,-0.2,-1) 0.8 (0.7,0.5,0.3) 0.4 20 (0,0,0) 1e6 1
SPHERE (0.9,0.6,-2) 0.5 (0.2,0.5,0.3) 0.4 20 (0,0,0) 1e6 1
"""
EXPERIMENT = """title = "hits"
scenes = ["scene.txt"]
renderers = ["python", "numpy"]
processes = 1
frames = 1

[image]
rays = {rays}
seed = 3
"""


@pytest.fixture(scope="module")
def known_right(known, tmp_path_factory):
    """A Reference of many rays in float32, and the rays."""
    scene = text.read(SCENE, "two spheres")
    rays = hits.through_the_screen(scene, 4000, SEED)
    arrays = {**flatten(scene), "rays": rays}
    parameters = Parameters(kind="rays", width=len(rays), height=1, depth=0, precision="float32")
    found = hits.make(
        known["numpy"], arrays, parameters, tuple(shapes(scene)), tmp_path_factory.mktemp("cache"), repetition.run
    )
    assert isinstance(found, Reference), found
    return found, rays


def masked(found: Reference, mask: np.ndarray) -> Reference:
    """The reference with another mask, whose rays hit in all perturbed references what they hit in it."""
    spans = hits._spans(hits._told(found.picture, mask))
    return replace(found, mask=mask, span=spans, left=(0,) * 8)


def answers(found: Reference) -> np.ndarray:
    return found.picture.copy()


def test_rays_start_at_the_eye_and_fill_the_screen():
    scene = text.read(SCENE, "two spheres")
    rays = hits.through_the_screen(scene, 20000, SEED)
    camera = scene.camera
    u, v, e = map(np.array, (camera.u, camera.v, camera.e))
    np.testing.assert_array_equal(rays[:, :3], np.broadcast_to(np.array(camera.centre) + e, (20000, 3)))
    np.testing.assert_allclose(np.linalg.norm(rays[:, 3:], axis=1), 1, rtol=1e-15)
    # e + t d = x u + y v
    x, y, _ = np.linalg.solve(np.stack([u, v, -rays[0, 3:]], axis=1), e)
    assert abs(x) < 1 and abs(y) < 1
    points = np.array([np.linalg.solve(np.stack([u, v, -d], axis=1), e)[:2] for d in rays[:2000, 3:]])
    assert np.abs(points).max() < 1 and np.abs(points).max(axis=0).min() > 0.99
    np.testing.assert_allclose(points.mean(axis=0), 0, atol=0.05)
    np.testing.assert_array_equal(rays, hits.through_the_screen(scene, 20000, SEED))


def test_the_mask_is_where_a_turn_by_4_steps_matters(known, known_right):
    """By closed form: the rim of a sphere, seen under an angle a, has a ring of rays around it."""
    found, rays = known_right
    assert 0.2 < (found.picture[:, 7] >= 0).mean() < 0.9
    assert found.mask.mean() < 0.01
    scene = text.read(SCENE, "two spheres")
    centre, radius = np.array([0.1, -0.2, -1]), 0.8
    to = centre - rays[0, :3]
    along = to / np.linalg.norm(to)
    side = np.cross(along, [0, 0, 1.0]) / np.linalg.norm(np.cross(along, [0, 0, 1.0]))
    rim = np.arcsin(radius / np.linalg.norm(to))
    angles = rim + np.array([-1e-3, -2e-8, 2e-8, 1e-3])
    aimed = np.cos(angles)[:, None] * along + np.sin(angles)[:, None] * side
    some = np.hstack([np.tile(rays[0, :3], (4, 1)), aimed])
    parameters = Parameters(kind="rays", width=4, height=1, depth=0, precision="float32")
    arrays = {**flatten(scene), "rays": some}
    # the other sphere is out of the way on this side
    made = hits.make(known["numpy"], arrays, parameters, tuple(shapes(scene)), None, repetition.run)
    assert made.mask.tolist() == [False, True, True, False], made.picture


def test_the_right_answer_is_right(known_right):
    found, _ = known_right
    verdict = hits.judge(answers(found), found, "float64")
    assert verdict.wrong is None and verdict.max_outside == 0 and verdict.mask_fraction == found.mask.mean()


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_distances_are_judged_by_their_share(known_right, precision):
    found, _ = known_right
    (row, *_) = np.flatnonzero((found.picture[:, 7] >= 0) & ~found.mask)
    for factor, wrong in ((0.9, False), (1.1, True)):
        off = answers(found)
        off[row, 0] *= 1 + factor * hits.TOLERANCE[precision]
        verdict = hits.judge(off, found, precision)
        assert (verdict.wrong is not None) == wrong, verdict
        assert verdict.max_outside == pytest.approx(factor * hits.TOLERANCE[precision], rel=1e-5)
    assert "1 distances off by more than" in verdict.wrong


def test_the_distance_of_a_miss_is_not_judged(known_right):
    found, _ = known_right
    off = answers(found)
    off[found.picture[:, 7] < 0, 0] = 5
    verdict = hits.judge(off, found, "float64")
    assert verdict.wrong is None and verdict.max_outside == 0


def test_another_object_is_wrong_outside_the_mask_and_inside_if_many_have_it(known_right):
    found, _ = known_right
    hundred = masked(found, np.arange(len(found.mask)) < 100)
    other = answers(found)
    assert hits.judge(other, hundred, "float64").wrong is None
    other[:9, 7] = 5
    hidden = hits.judge(other, hundred, "float64")
    assert hidden.wrong is None and hidden.bad_pixels == 9 / len(other)  # 9^-9 is above 1e-9, 9^-10 below
    other[:10, 7] = 5
    assert hits.judge(other, hundred, "float64").wrong == (
        "10 of 100 rays inside the mask hit what turns by some float32 steps do not bring them to; of right answers at "
        "most 9 do"
    )
    other[100, 7] = 5
    assert hits.judge(other, hundred, "float64").wrong == "1 rays hit something else outside the mask"
    gone = answers(found)
    row = np.flatnonzero(found.picture[:, 7] >= 0)[-1]
    gone[row] = [0, 0, 0, 0, 0, 0, 0, -1]
    assert "hit something else" in hits.judge(gone, masked(found, np.zeros_like(found.mask)), "float64").wrong
    assert hits.judge(other[:-1], hundred, "float64").wrong == "3999 answers, expected 4000"


def test_distances_inside_the_mask_stay_in_what_perturbed_references_have():
    """A ray that hits object 0 from 2 to 3 away, or object 1 from 5 to 5 away, or nothing."""
    rows = np.zeros((4, 8))
    told = [(row, thing, far) for row in range(4) for thing, far in ((0, 2), (0, 3), (1, 5), (-1, np.inf))]
    spans = hits._spans(np.array(told, dtype=float))
    assert spans[:3].tolist() == [[0, -1, np.inf, np.inf], [0, 0, 2, 3], [0, 1, 5, 5]]
    for thing, far, leaves in [
        (0, 1.51, 0),
        (0, 1.49, 1),
        (0, 3.51, 1),
        (1, 5, 0),
        (1, 4, 1),
        (-1, np.inf, 0),
        (2, 5, 1),
    ]:
        rows[:, 7], rows[:, 0] = thing, far
        assert hits._leaves(rows, np.ones(4, bool), spans, 1e-9).sum() == 4 * leaves, (thing, far)


def test_nothing_that_hits_leaves_no_error():
    nothing = Reference("x", np.tile([0.0] * 7 + [-1.0], (5, 1)), np.zeros(5, bool), None, np.zeros((0, 4)), ())
    rows = np.tile([0.0] * 7 + [-1.0], (5, 1))
    assert hits.judge(rows, nothing, "float64").max_outside == 0
    all_masked = masked(nothing, np.ones(5, bool))
    verdict = hits.judge(rows, all_masked, "float64")
    assert (verdict.wrong, verdict.max_outside, verdict.mask_fraction) == (None, None, 1)


def test_a_maker_that_fails_makes_no_reference(known):
    def run(*_, **__):
        return type("Result", (), {"status": "failed", "reason": "no rays today", "array": None})()

    rays = np.zeros((2, 6))
    parameters = Parameters(kind="rays", width=2, height=1, depth=0)
    found = hits.make(known["numpy"], {"rays": rays}, parameters, ("sphere",), None, run)
    assert isinstance(found, NoReference) and "no rays today" in found.reason


def test_a_race_of_rays(rayrace, write, tmp_path):
    write("scene.txt", SCENE)
    file = write("experiment.toml", EXPERIMENT.format(rays=7000))
    rayrace("run", file, "--out", tmp_path / "run", "--report", code=0)
    facts, rows = store.read(tmp_path / "run")
    assert {row["status"] for row in rows} == {"ok"} and len(rows) == 2
    for row in rows:
        assert row["rays"] == {"primary": 7000, "reflected": 0, "transmitted": 0, "shadow": 0, "non_finite": 0}
        assert row["picture"] is None and row["error"]["against"] == "hits"
        assert row["error"]["max"] < 1e-12 and row["error"]["bad_pixels"] == 0
        assert row["agreement"]["max_outside"] < 1e-12 and row["agreement"]["tolerance"] == 1e-9
        assert row["agreement"]["reference"] not in (row["variant"], None)
        assert row["needs"] == ["sphere"] and row["parameters"]["kind"] == "rays"
    assert len({row["scene_version"] for row in rows}) == 1
    report = (tmp_path / "run" / "report" / "report.md").read_text()
    assert "was not judged" not in report
    assert re.search(r"\*\*numpy\*\* (is the fastest|has the lowest median)", report)
    more = write("more.toml", EXPERIMENT.format(rays=701))
    done = rayrace("run", more, "--dry-run", "--json", code=0)
    assert facts["cells"][0]["scene_version"] not in done.stdout


def test_the_number_of_rays_is_swept_and_can_be_a_condition(rayrace, write):
    write("scene.txt", SCENE)
    sweep = "\n[sweep]\nrays = [0, 100, 200]\n"
    where = "where = [\"rays != 100 or renderer == 'numpy'\"]\n"
    file = write("experiment.toml", EXPERIMENT.format(rays=0).replace("[image]", where + "\n[image]") + sweep)
    done = rayrace("run", file, "--dry-run", code=0)
    assert "5 cells" in done.stdout, done.stdout


@pytest.mark.parametrize("rays", [-1, 1.5, 10**8])
def test_a_faulty_number_of_rays(rayrace, write, rays):
    write("scene.txt", SCENE)
    done = rayrace("run", write("experiment.toml", EXPERIMENT.format(rays=rays)), code=2)
    assert "image.rays" in done.stdout + done.stderr


def test_reference_moves_by_steps_of_float32():
    assert reference.ULPS * np.spacing(np.float32(0.5)) == pytest.approx(4 * 2**-24)
