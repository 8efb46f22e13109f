"""What a picture can do without: scenes whose answer is known, and leave-outs that apply."""

from dataclasses import replace

import numpy as np
import pytest
import seeds

from harness.judge.cache import Kept
from harness.judge.truth import Truth
from harness.process.session import Sessions
from harness.renderer.parameters import Parameters
from harness.scene.model import Csg, Operator
from harness.scene.needs import needs
from harness.scene.text import read
from harness.single import worth
from harness.single.leave_out import leave_outs

# The second light is behind the wall, the third black; the last sphere is behind the eye, where nothing mirrors it, and
# what the mirror reflects reflects nothing itself, so that depth 1 is enough.
KNOWN = """CAMERA (0,0,0) (1,0,0) (0,0.75,0) 4
AMBIENT (0.2,0.2,0.2)
LIGHT (3.1,4.2,6.3) (0.8,0.7,0.9) 0
LIGHT (0.3,0.2,-9) (0.9,0.8,0.7) 0
LIGHT (2,3,5) (0,0,0) 0
POLYGON 4 (-9,-9,-3) (9,-9,-3.1) (9,9,-3.2) (-9,9,-3.1) (0.5,0.6,0.4) 0 10 (0,0,0) 1e6 1
SPHERE (-0.4,0.1,-1) 0.5 (0.2,0.2,0.2) 0.7 20 (0,0,0) 1e6 1
SPHERE (-0.4,0.1,-40) 0.3 (0.2,0.5,0.2) 0 20 (0,0,0) 1e6 1
"""
SOLID = """CAMERA (0,0,0) (1,0,0) (0,1,0) 4
AIR 1.1 1 (0.9,0.8,0.9)
LIGHT (1,2,3) (1,1,1) 0.3
LIGHT (2,2,3) (1,1,1) 0
OR
  AND SPHERE (0,0,0) 1 NOT BOX (0,0,0) (1,0,0) (0,1,0) (0,0,1) END END
  ELLIPSOID (1,2,3) (1,0,0) (0,2,0) (0,0,3)
END
(0.1,0.2,0.3) 0.5 20 (0.9,0.8,0.7) 2 1
"""


def names(scene, **job):
    return [one.name for one in leave_outs(scene, Parameters(**job))]


@pytest.fixture(scope="module")
def study(known):
    """The known scene in pictures by numpy, which has nothing to compile, each timed once."""
    scene = read(KNOWN)
    job = Parameters(width=28, height=21, depth=3, shadows=True, feelers=3, frames=1)
    full, listed = worth.Model(scene, job), leave_outs(scene, job)
    listed = [one for one in listed if "float32" not in one.name]
    with Sessions() as sessions:
        true = worth.truth_of(full, known, Kept(None), sessions.run)
        return worth.measure(full, true, known["numpy"], sessions.run, 1, 60.0, listed)


def test_what_nothing_needs_is_found_and_no_more(study):
    told = {one.name: one.verdict for one in study.worths}
    proved = {name for name, verdict in told.items() if verdict.startswith("needs none of it (proved)")}
    assert proved == {"soft shadows", "light 3"}
    measured = {name for name, verdict in told.items() if verdict == "changes no pixel (measured)"}
    assert measured == {"light 2", "the sphere of line 8", "depth 3 to 1", "depth 3 to 2"}
    needed = {"shadows", "light 1", "the polygon of line 6", "the sphere of line 7", "depth 3 to 0", "ambient light"}
    assert needed <= {name for name, verdict in told.items() if verdict == "error grows"}


def test_what_is_proved_changes_nothing(study):
    assert all(one.largest == 0 for one in study.worths if one.proof)


def test_one_process_resolves_no_time(study):
    done = [one for one in study.worths if not one.unavailable]
    assert len(done) > 10
    assert {one.faster for one in done} == {"not resolved"} and all(one.time.value > 0 for one in done)


def test_what_a_renderer_cannot_do_is_unavailable(study):
    (lanes,) = (one for one in study.worths if "lanes" in one.name)
    assert lanes.verdict.startswith("unavailable: unsupported: ") and "time" not in lanes.record()


def test_leave_outs_apply_and_change_what_they_name():
    scene = read(SOLID)
    job = Parameters(shadows=True, feelers=4, glossy_rays=5, lens_radius=0.1, sampler="jittered", samples=2)
    listed = leave_outs(scene, job)
    assert len({one.name for one in listed}) == len(listed)
    for one in listed:
        smaller = one.change(scene, job)
        assert smaller != (scene, job), one.name
        needs(*smaller)  # a valid model
    expected = {"attenuation of the air", "radius of light 1", "lens", "supersampling", "feelers 4 to 1"}
    assert expected | {"glossy rays 5 to 1", "glossy reflection", "soft shadows"} <= {one.name for one in listed}
    plain = names(replace(scene, lights=()), depth=0)
    assert plain == [
        *("float64 to float32", "one ray at a time, to lanes", "attenuation of the air"),
        *("the csg of line 5", *(f"part {k} ({s}) of the csg of line 5" for k, s in PARTS)),
    ]


# Without its sphere, the AND would be the outside of the box.
PARTS = ((2, "box"), (3, "ellipsoid"))


def test_a_part_of_csg_is_left_out_of_its_tree():
    scene = read(SOLID)
    (solid,) = scene.objects
    sphere, box, ellipsoid = solid.parts()
    found = {one.name: one.change(scene, Parameters())[0].objects[0] for one in leave_outs(scene, Parameters())[-2:]}
    codes = [thing.code for thing in found.values() if isinstance(thing, Csg)]
    assert codes == [(sphere, ellipsoid, Operator.OR), (sphere, box, Operator.NOT, Operator.AND)]


def test_of_an_operator_the_other_operand_remains():
    both = read(SOLID).objects[0]
    sphere, box, _ = both.parts()
    scene = replace(read(SOLID), objects=(replace(both, code=(sphere, box, Operator.AND)),))
    first, second = (one.change(scene, Parameters())[0].objects[0] for one in leave_outs(scene, Parameters())[-2:])
    assert (first.code, second.code) == ((box,), (sphere,))


def test_the_error_added_is_known_as_well_as_it_says():
    """Against truths with noise, of pictures of which one errs more: the scores are normal."""
    (seed, *_) = seeds.numbers("worth")
    print("seed", seed)
    rng = np.random.default_rng(seed)
    shape = (9, 7, 3)
    true, error = rng.uniform(size=shape), rng.uniform(0.01, 0.2, size=shape)
    full, reduced = (true + scale * rng.normal(size=shape) for scale in (0.01, 0.05))
    exact = np.mean((reduced - true) ** 2 - (full - true) ** 2)
    scores = []
    for _ in range(2000):
        noisy = Truth("t", true + error * rng.normal(size=shape), 4, (1, 2), error, 0)
        gap, doubt = worth.added(reduced, full, noisy)
        scores.append((gap - exact) / doubt)
    assert abs(np.mean(scores)) < 5 / np.sqrt(2000)
    assert abs(np.std(scores) - 1) < 5 / np.sqrt(4000)
    same = worth.added(full, full, noisy)
    assert same == (0, 0)
