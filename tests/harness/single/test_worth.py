"""What a picture can do without: scenes whose answer is known, and leave-outs that apply."""

import sys
from dataclasses import replace

import numpy as np
import pytest
import seeds
import trimesh

from harness.errors import UserError
from harness.judge import judge
from harness.judge.cache import Kept
from harness.process import repetition
from harness.process.session import Sessions
from harness.race.audit import Audit
from harness.race.host import ThisHost
from harness.reduction.leave_out import apply, leave_outs
from harness.renderer.parameters import Parameters
from harness.scene import load
from harness.scene.model import Csg, Mesh, Operator
from harness.scene.needs import needs
from harness.scene.text import read
from harness.scene.written import write
from harness.single import smallest, worth

# The second light and the last sphere are behind the wall, the third light is black, and what the mirror reflects
# reflects nothing itself, so that depth 1 is enough.
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
(0.1,0.2,0.3) 0.5 20 (0.9,0.8,0.7) 2 1 0.3
"""


def way(known, sessions):
    """Pictures and times by numpy, each timed by one process."""
    return worth.Way(known["numpy"], sessions.run, 60.0, Audit(ThisHost()), 1)


def names(scene, **job):
    return [one.name for one in leave_outs(scene, Parameters(**job))]


@pytest.fixture(scope="module")
def full():
    job = Parameters(width=28, height=21, depth=3, shadows=True, feelers=3, frames=1)
    return worth.Model(read(KNOWN), job)


@pytest.fixture(scope="module")
def listed(full):
    return [one for one in leave_outs(full.scene, full.job) if "float32" not in one.name]


@pytest.fixture(scope="module")
def study(known, full, listed):
    """The known scene in pictures by numpy, which has nothing to compile, each timed once."""
    with Sessions() as sessions:
        true = worth.truth_of(full, known, Kept(None), sessions.run)
        return worth.measure(full, true, way(known, sessions), listed)


def test_what_nothing_needs_is_found_and_no_more(study):
    told = {one.name: one.verdict for one in study.worths}
    proved = {name for name, verdict in told.items() if verdict.startswith("needs none of it (proved)")}
    assert proved == {"soft shadows", "light 3", "depth 3 to 1"}
    measured = {name for name, verdict in told.items() if verdict == "changes no pixel (measured)"}
    # The one mirror reflects most of a ray's weight, once.
    cut = {f"rays of a weight up to 2^{power}" for power in (-10, -8, -6)}
    assert measured == {"light 2", "the sphere of line 8"} | cut
    needed = {"shadows", "light 1", "the polygon of line 6", "the sphere of line 7", "depth 3 to 0", "ambient light"}
    assert needed <= {name for name, verdict in told.items() if verdict == "error grows"}


def test_what_is_proved_changes_nothing(study):
    assert all(one.change.largest == 0 for one in study.worths if one.proof)


def test_one_process_resolves_no_time(study):
    done = [one for one in study.worths if not one.unavailable]
    assert len(done) > 10
    assert {one.faster for one in done} == {"not resolved"} and all(one.time.value > 0 for one in done)


def test_what_a_renderer_cannot_do_is_unavailable(study):
    (lanes,) = (one for one in study.worths if "lanes" in one.name)
    assert lanes.verdict.startswith("unavailable: unsupported: ") and "time" not in lanes.record()


def test_pictures_share_one_program_where_it_is_built_first(full, known):
    asked = []

    def run(entry, arrays, job, needs, **more):
        asked.append((entry.name, job.kernel))
        return repetition.Result("failed", "not asked to render")

    for name in ("cpp", "numpy"):
        worth.Model(full.scene, full.job).shoot(known[name], run, 1.0)
    assert asked == [("cpp", "general"), ("numpy", "needed")]


@pytest.fixture(scope="module")
def search(known, study, listed):
    with Sessions() as sessions:
        limit = 1.1 * smallest.most(study.error, study.truth)
        yield smallest.Search(study, listed, limit, way(known, sessions))


def test_the_smallest_model_is_within_the_limit_by_another_renderer(search, known, tmp_path):
    """The scene is written, read back, and rendered by a renderer that took no part in the search."""
    found = search.greedy()
    without = {one.name for one in found.left}
    assert {"light 2", "light 3", "the sphere of line 8"} <= without
    assert not {"light 1", "the polygon of line 6", "the sphere of line 7"} & without
    assert sum(name.startswith("rays of a weight") for name in without) == 1  # the coarsest makes others needless
    assert 0 < smallest.most(found.error, search.study.truth) <= search.limit
    write(found.model.scene, tmp_path / "scene.txt")
    back = worth.Model(load(tmp_path / "scene.txt"), found.model.job)
    assert back.scene == found.model.scene
    back.shoot(known["python"], repetition.run, 60.0)
    true = search.study.truth
    error = judge.errors(back.picture, true.picture, true.standard_error, None)
    assert error["rmse"] == pytest.approx(found.error["rmse"], rel=1e-9)


def test_all_combinations_are_tried_and_none_is_missed(search):
    greedy = search.greedy()
    best = search.exhaustive(greedy)
    changing = [one for one in search.candidates if one in greedy.left or one in best.left]
    assert 1 <= best.within <= best.tried <= 2**smallest.MOST and changing
    assert smallest.most(best.error, search.study.truth) <= search.limit and best.over.value > 0


def test_a_limit_below_the_error_of_the_full_model(study):
    with pytest.raises(UserError, match=r"the full model has an RMSE of up to .* itself, more than 0\.001; take"):
        smallest.check(study.full, study.truth, 1e-3)


def test_too_many_combinations(search, monkeypatch):
    monkeypatch.setattr(smallest, "MOST", 0)
    with pytest.raises(UserError, match="changes are harmless alone, all combinations of which are too many"):
        search.exhaustive(None)


def test_leave_outs_apply_and_change_what_they_name():
    scene = read(SOLID)
    job = Parameters(shadows=True, feelers=4, glossy_rays=5, lens_radius=0.1, sampler="jittered", samples=2)
    listed = leave_outs(scene, job)
    assert len({one.name for one in listed}) == len(listed)
    for one in listed:
        smaller = apply([one], scene, job)
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


GLASS = """CAMERA (0,0,0) (1,0,0) (0,1,0) 4
AIR 1.2 1.1 (1,1,1)
LIGHT (1,2,3) (1,1,1) 0.3
LIGHT (2,2,3) (1,1,1) 0
SPHERE (0,0,-1) 1 (0.1,0.2,0.3) 0.5 20 (0.9,0.8,0.7) 2.3 1 0.3
SPHERE (3,0,-1) 1 (0.1,0.2,0.3) 0.9 20 (0,0,0) 1e6 1 0.2
SPHERE (0,3,-1) 1 (0.1,0.2,0.3) 0.8 20 (1,1,1) 1.2 1.1
"""


def test_what_several_materials_have_is_also_left_out_of_all():
    scene, job = read(GLASS), Parameters()
    listed = {one.name: one for one in leave_outs(scene, job)}
    alone = [one for name, one in listed.items() if name.startswith("constant") and "all" not in name]
    assert len(alone) > 1 and {one.kind for one in alone} == {"fresnel"}
    every = apply([listed["constant Fresnel share of all materials"]], scene, job)
    assert every == apply(alone, scene, job) and every not in [apply([one], scene, job) for one in alone]
    assert "constant Fresnel share of all materials" not in names(read(KNOWN))


def test_leave_outs_are_made_together_in_any_order():
    (seed, *_) = seeds.numbers("leave-outs")
    print("seed", seed)
    rng = np.random.default_rng(seed)
    scene, job = read(GLASS), Parameters(shadows=True, feelers=4, glossy_rays=5, sampler="uniform", samples=4)
    listed = [one for one in leave_outs(scene, job) if one.name not in ("depth 10 to 0", "supersampling")]
    for _ in range(50):
        some = [listed[k] for k in rng.permutation(len(listed))[: rng.integers(1, len(listed))]]
        assert apply(some, scene, job) == apply(rng.permutation(np.array(some, object)), scene, job)
    none, least = apply(listed, scene, job)
    assert none.objects == none.lights == () and (least.depth, least.samples, least.feelers) == (1, 2, 0)


def test_a_constant_fresnel_share_is_that_of_all_angles():
    """REF-2 with N = 1 does not depend on the angle, and is the mean over a sphere from afar."""
    scene = read(GLASS)
    mine = [one for one in leave_outs(scene, Parameters()) if "constant" in one.name and "all" not in one.name]
    same = [one for one in mine if one.proof]
    assert len(mine) == 3 and len(same) == 1 and "of line 7" in same[0].name
    for one, thing in zip(mine[:2], scene.objects, strict=False):
        made = apply([one], scene, Parameters())[0].objects[scene.objects.index(thing)].material
        m = scene.air.mu_r / made.mu_r
        assert made.eps_r * made.mu_r == pytest.approx(scene.air.eps_r * scene.air.mu_r, rel=1e-12)
        c = np.sqrt(np.random.default_rng(1).uniform(size=200_000))
        n, k = np.sqrt(1.32 / (thing.material.eps_r * thing.material.mu_r)), scene.air.mu_r / thing.material.mu_r
        s = np.sqrt(1 - n**2 * (1 - c**2))
        r = (((n * c - k * s) / (n * c + k * s)) ** 2 + ((k * c - n * s) / (k * c + n * s)) ** 2) / 2
        assert ((1 - m) / (1 + m)) ** 2 == pytest.approx(r.mean(), abs=5 * r.std() / np.sqrt(len(c)))


def test_a_mesh_is_made_coarser_and_stays_closed():
    pytest.importorskip("fast_simplification")
    ball = trimesh.creation.icosphere(3)
    whole = Mesh(read(GLASS).objects[0].material, ball.vertices, ball.faces.astype(np.int32), True)
    scene = replace(read(GLASS), objects=(whole,))
    coarser = [one for one in leave_outs(scene, Parameters()) if one.name.startswith("triangles 1,280 to ")]
    assert len(coarser) == 3 and not any(one.unavailable for one in coarser)
    counts = []
    for one in coarser:
        (mesh,) = apply([one], scene, Parameters())[0].objects
        counts.append(len(mesh.triangles))
        volume = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False).volume
        assert mesh.closed and abs(volume - ball.volume) < 0.1 * ball.volume
    assert counts == sorted(counts, reverse=True) and counts[0] <= 640
    (least,) = apply(coarser[::-1], scene, Parameters())[0].objects
    assert len(least.triangles) == counts[-1]


def test_without_the_library_meshes_stay_and_why_is_told(monkeypatch):
    monkeypatch.setitem(sys.modules, "fast_simplification", None)
    ball = trimesh.creation.icosphere(1)
    whole = Mesh(read(GLASS).objects[0].material, ball.vertices, ball.faces.astype(np.int32), True)
    scene = replace(read(GLASS), objects=(whole,))
    told = {one.unavailable for one in leave_outs(scene, Parameters()) if one.name.startswith("triangles")}
    assert told == {"unsupported: no fast-simplification here; pip install 'rayrace[simplify]'"}


def test_adaptive_samples_are_halved_less_and_know_no_cut_off():
    found = names(read(GLASS), sampler="adaptive")
    assert {"supersampling", "halvings of a pixel 3 to 1"} <= set(found)
    assert not [name for name in found if name.startswith("rays of a weight")]


# The ball of line 5 mirrors in a lobe of 1e-3 radians, the glass of line 6 has the index of the air, and the mirror
# of line 7 is smaller than a pixel.
SMALL = """CAMERA (0,0,0) (1,0,0) (0,0.75,0) 4
BACKGROUND (0.3,0.4,0.5)
LIGHT (3.1,4.2,6.3) (0.8,0.7,0.9) 0
POLYGON 4 (-9,-9,-3) (9,-9,-3.1) (9,9,-3.2) (-9,9,-3.1) (0.5,0.6,0.4) 0 10 (0,0,0) 1e6 1
SPHERE (-0.6,0.1,-1) 0.4 (0.2,0.2,0.2) 0.7 1e6 (0,0,0) 1e6 1 0.001
SPHERE (0.5,-0.4,-1) 0.3 (0,0,0) 0.9 20 (0.8,0.9,0.9) 1 1
SPHERE (0.041666666666666664,-0.5416666666666666,0) 0.03 (0.1,0.1,0.1) 0.9 1e6 (0,0,0) 1e6 1
"""


def test_known_answers_of_glass_gloss_and_a_mirror_of_one_pixel(known):
    scene, job = read(SMALL), Parameters(width=24, height=18, depth=3, glossy_rays=2, frames=1)
    whose = {line: f"of the material of the sphere of line {line}" for line in (6, 7)}
    unbent, clear = f"constant Fresnel share, no refraction, {whose[6]}", f"transmission {whose[6]}"
    mirror, gloss = f"specular share {whose[7]}", "glossy reflection"
    full = worth.Model(scene, job)
    listed = [one for one in leave_outs(scene, job) if one.name in (unbent, clear, mirror, gloss)]
    with Sessions() as sessions:
        true = worth.truth_of(full, known, Kept(None), sessions.run)
        study = worth.measure(full, true, way(known, sessions), listed)
    found = {one.name: one for one in study.worths}
    assert found[unbent].proof and found[unbent].change.pixels == 0 and found[clear].verdict == "error grows"
    assert found[mirror].change.pixels == 1 / (24 * 18) and found[mirror].change.largest > 0.01
    assert found[gloss].change.pixels > 0 and abs(found[gloss].change.added) < 0.01 * study.error["rmse"] ** 2


def test_a_perfect_mirror_has_a_finite_constant_share():
    scene = read(GLASS.replace("1e6 1", "1e30 1"))
    for one in leave_outs(scene, Parameters()):
        if "constant" in one.name:
            assert all(
                np.isfinite(t.material.mu_r) and t.material.eps_r > 0
                for t in one.change(scene, Parameters())[0].objects
            )
