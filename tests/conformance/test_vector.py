"""VEC-1, VEC-2: rays in lanes make the picture that rays one by one make, in every renderer that has lanes."""

import numpy as np
import pytest
from feature_scenes import features, some_rough
from nightly import by_night
from random_scenes import MATERIAL, random_material, random_scene, random_stage, words
from tessellate import ball, obj

from harness.judge import judge, reference
from harness.renderer import registry
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.needs import needs, shapes

KNOWN = registry.entries()
IN_LANES = [name for name, entry in KNOWN.items() if "on" in entry.methods.get("vector", ())]
SIZE = {"width": 70, "height": 41}  # more than a tile, and no multiple of anything
MIRROR = "(0.4,0.5,0.3) 0.6 12 (0,0,0) 1e6 1"
STAGE = "CAMERA (0.1,0,0) (1.9,0,0.1) (0,1.4,0) (0.3,0.4,5)\nAMBIENT (0.1,0.1,0.2)\nBACKGROUND (0.2,0.1,0.3)\n"
LIGHTS = "LIGHT (3,5,6) (0.8,0.7,0.6) 0\nLIGHT (-4,1,-3) (0.3,0.5,0.6) 0\n"


@pytest.fixture(params=[name for name in IN_LANES if KNOWN[name].variant.threads == 1])
def laned(request):
    return request.param


@pytest.fixture
def render(bench):
    """The Result of a picture in lanes, by a kernel that tests share; Numba has lanes in exact kernels alone."""

    def make(variant, scene, **parameters):
        exact = not bench.entry(variant).renderer.manifest.build
        result = bench.result(variant, scene, exact=exact, **{**SIZE, "vector": "on", **parameters})
        assert result.said.used["methods"]["vector"] == "on"
        return result

    return make


@pytest.fixture
def agree(bench, known, render):
    """Assert that a picture in lanes is right: float64 to 1e-9 and float32 to 1/255 outside the mask, rays counted."""

    def check(variant, scene, **parameters):
        result = render(variant, scene, **parameters)
        wanted = Parameters(**{**SIZE, "vector": "on", **parameters})
        read = text.read(scene, "scene of the test")
        maker = reference.choose(known[variant], known, wanted, needs(read, wanted))
        found = bench.reference(maker, flatten(read), wanted, needs(read, wanted))
        verdict = judge.judge(result.array, found, wanted.precision)
        print(f"{variant} against {found.maker}: {verdict} {result.said.rays}")
        assert verdict.wrong is None, verdict.wrong
        if wanted.precision == "float64":
            assert judge.compare_rays(result.said.rays, found.rays, "float64") is None
        return result

    return check


@pytest.mark.parametrize("precision", ["float64", "float32"])
@pytest.mark.parametrize("seed", by_night(range(4), "1", "2", "3"))
def test_random_scenes(agree, laned, seed, precision):
    """Overlapping mirrors in air of its own index, from outside and from between them."""
    rng = np.random.default_rng([61, seed])
    scene = random_scene(rng, sphere=int(rng.integers(1, 40)), material=random_material, rest=random_stage(rng))
    agree(laned, scene, depth=int(rng.integers(0, 6)), shadows=bool(seed % 2), precision=precision)


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_fast_math_leaves_highlights_as_they_are(agree, precision):
    """LOC-4 in lanes: a power of two that is split by rounding must not be put together again (NUM-3)."""
    rng = np.random.default_rng(63)
    scene = random_scene(rng, sphere=12, material=random_material, rest=random_stage(rng))
    agree("cpp", scene, depth=0, floating_point="fast", precision=precision)


@pytest.mark.parametrize("size", [(1, 1), (3, 5), (1, 40), (33, 1), (64, 32), (65, 33)])
def test_sizes(agree, laned, size):
    rng = np.random.default_rng([62, *size])
    scene = random_scene(rng, sphere=9, spread=1.2, material=random_material, rest=STAGE + LIGHTS)
    agree(laned, scene, width=size[0], height=size[1], depth=2, shadows=True)


@pytest.mark.parametrize(
    "scene",
    [
        STAGE + LIGHTS,
        STAGE + f"SPHERE (0,0,0) 1 {MIRROR}\n",
        STAGE + LIGHTS + "SPHERE (0,0,0) 1 (0.4,0.5,0.3) 0 12 (0,0,0) 1 1\n",
        STAGE + LIGHTS + f"SPHERE (0.4,0.4,5) 9 {MIRROR}\nSPHERE (0,0,0) 1 {MIRROR}\n",
        STAGE + LIGHTS + f"SPHERE (0.4,0.4,5.2) 0.5 {MIRROR}\nSPHERE (0,0,12) 3 {MIRROR}\nSPHERE (0,0,0) 1 {MIRROR}\n",
        STAGE + LIGHTS + f"SPHERE (-1,0,0) 1 {MIRROR}\nSPHERE (1,0,0) 1 {MIRROR}\n",
    ],
    ids=["nothing", "no light", "matte", "eye in a sphere", "eye in one, one behind", "touching"],
)
def test_plain_and_odd_scenes(agree, laned, scene):
    agree(laned, scene, depth=3, shadows=True)


CLOSE_UP = "CAMERA (0,0,0) (0.04,0,0) (0,0.03,0) (0,0,5)\nLIGHT (0,0,5) (0.8,0.7,0.6) 0\n" + LIGHTS
HIGHLIGHT = CLOSE_UP + "SPHERE (0,0,0) 1.4 (0.1,0.2,0.3) 0.9 {} (0,0,0) 1 1\n"  # seen from where a light is


@pytest.mark.parametrize("exponent", [0, 0.3, 1, 30, 1e4, 1e6])
def test_highlights_of_any_exponent(agree, laned, exponent):
    """The polynomials of the power, from 1 to where it underflows."""
    result = agree(laned, HIGHLIGHT.format(exponent), width=256, height=256, depth=0)
    assert result.array.max() > 0.5
    assert exponent < 1e6 or result.array.min() < 0.1


@pytest.mark.parametrize("exponent", [0, 0.3, 30, 1e4, 1e6])
def test_highlights_in_float32(render, laned, exponent):
    """No further from float64 than rays one by one: c is off by some u, and c^m by m times that."""
    job = {"width": 256, "height": 256, "depth": 0}
    truth = render(laned, HIGHLIGHT.format(exponent), **job).array
    job["precision"] = "float32"
    mine = render(laned, HIGHLIGHT.format(exponent), **job).array
    apart = np.abs(mine - truth).max()
    print(laned, exponent, apart)
    assert apart < 8 * 2.0**-24 * (1 + exponent)


@pytest.mark.parametrize("tile", [(64, 32), (32, 32)])
def test_spheres_at_the_corners_of_tiles(agree, laned, tile):
    """VEC-2: what is left out for a tile, no ray of it meets. Each corner pixel's ray passes at 0.95 radii from the
    centre of a sphere that lies outside the tile: only that ray and some beside it meet it."""
    rng = np.random.default_rng([63, *tile])
    width, height = 200, 150
    u, v, e = np.array([1.9, 0, 0.1]), np.array([0, 1.4, 0]), np.array([0.3, 0.4, 5])
    eye, dots = np.array([0.1, 0, 0]) + e, []
    for x0 in range(0, width, tile[0]):
        for y0 in range(0, height, tile[1]):
            x1, y1 = min(x0 + tile[0], width) - 1, min(y0 + tile[1], height) - 1
            for x, y in ((x0, y0), (x1, y0), (x0, y1), (x1, y1)):
                d = (2 * (x + 0.5) / width - 1) * u + (1 - 2 * (y + 0.5) / height) * v - e
                d /= np.linalg.norm(d)
                out = (2 * (x == x1) - 1) * u - (2 * (y == y1) - 1) * v
                out -= out @ d * d
                far, radius = rng.uniform(3, 9), rng.uniform(0.01, 0.03)
                centre = eye + far * d + 0.95 * radius * out / np.linalg.norm(out)
                dots.append(f"SPHERE {words(centre)} {radius} {MIRROR}\n")
    scene = STAGE + LIGHTS + "".join(dots)
    result = agree(laned, scene, width=width, height=height, depth=0, accel="none")
    assert np.abs(result.array - [0.2, 0.1, 0.3]).any(axis=-1).sum() > len(dots)


def test_a_wide_view(agree, laned):
    """Tiles whose cones are wide: the eye is close to its screen."""
    rng = np.random.default_rng(64)
    stage = "CAMERA (0,0,0) (30,0,0) (0,25,0) (0,0,1)\nBACKGROUND (0.1,0.1,0.2)\n" + LIGHTS
    agree(laned, random_scene(rng, sphere=60, spread=5, material=random_material, rest=stage), depth=2)


def test_a_region_and_threads_change_no_byte(render, laned):
    rng = np.random.default_rng(65)
    scene = random_scene(rng, sphere=20, material=random_material, rest=random_stage(rng))
    whole = render(laned, scene, depth=4, shadows=True)
    part = render(laned, scene, depth=4, shadows=True, region=(5, 3, 61, 40))
    assert part.array.tobytes() == np.ascontiguousarray(whole.array[3:40, 5:61]).tobytes()
    folder = registry.entries()[laned].renderer.folder
    for name in IN_LANES:
        entry = registry.entries()[name]
        if entry.renderer.folder == folder and entry.variant.threads == "all":
            for threads in (1, 2, 3, 5):
                found = render(name, scene, depth=4, shadows=True, threads=threads)
                assert found.array.tobytes() == whole.array.tobytes(), f"{name} on {threads} threads"


def test_frames_and_batches_are_the_same_picture(render, laned):
    scene = STAGE + LIGHTS + f"SPHERE (0,0,0) 1 {MIRROR}\n"
    once = render(laned, scene, depth=2)
    more = render(laned, scene, depth=2, frames=3, least_frame=0.01)
    assert more.array.tobytes() == once.array.tobytes() and more.said.rays == once.said.rays


WHOLE_MODEL = [name for name in ("cpp", "numba") if name in IN_LANES]  # have lanes for all of SPEC.md, or nearly so
GLASS = "(0.2,0.3,0.1) 0.8 20 (0.8,0.9,0.7) 2.2 1"
FLOOR = "POLYGON 4 (-9,-2,-9) (-9,-2,9) (9,-2,9) (9,-2,-9) (0.6,0.5,0.4) 0.3 9 (0,0,0) 1 1\n"


@pytest.mark.parametrize("precision", ["float64", "float32"])
@pytest.mark.parametrize("variant", WHOLE_MODEL)
def test_more_children_than_a_stream_has_room_for(agree, variant, precision):
    """Glass and eight glossy rays: some rays are followed to the end before their siblings are made (WLK-1)."""
    rng = np.random.default_rng(67)
    frosted = some_rough(lambda _: GLASS, rng)
    scene = random_scene(rng, sphere=5, box=2, material=frosted, rest=STAGE + LIGHTS + FLOOR.strip() + " 0.4\n")
    agree(variant, scene, depth=3, glossy_rays=8, shadows=True, precision=precision)


@pytest.mark.parametrize("count", [3, 8, 9, 14])
@pytest.mark.parametrize("variant", WHOLE_MODEL)
def test_solids_of_few_and_many_parts(agree, variant, count):
    """Those of more than eight parts are asked ray by ray, and so is every ray that meets two faces in one place."""
    rng = np.random.default_rng([68, count])
    balls = [f"SPHERE {words(rng.uniform(-1, 1, 3))} {rng.uniform(0.5, 1.1)}\n" for _ in range(count)]
    block = "BOX (-1,-1,-1) (2,0,0) (0,2,0) (0,0,2)\nNOT BOX (-1,-1,-1) (2,0,0) (0,2,0) (0,0,1.3) END\n"
    scene = STAGE + LIGHTS + FLOOR
    scene += f"OR {''.join(balls[1:])} END {GLASS}\nAND {block} {balls[0]} END {GLASS}\n"
    agree(variant, scene, depth=3, shadows=True)


def test_more_solids_in_each_other_than_there_are_bits(bench, agree, render):
    """MED-2: 40 nested balls do not fit into 32 bits; float32 then goes ray by ray (VEC-3)."""
    balls = "".join(
        f"SPHERE (0,0,0) {1.98 - 0.04 * k} (0,0,0) 0.9 9 (0.9,0.9,0.9) {1 + 0.1 * (k % 3)} 1\n" for k in range(40)
    )
    scene = STAGE + LIGHTS + FLOOR + balls
    agree("cpp", scene, depth=4, precision="float64")
    result = render("cpp", scene, depth=4, precision="float32")
    assert result.said.used["methods"]["accel"] == "bvh"
    refused = attempt(bench, "cpp", scene, depth=4, precision="float32", accel="none")
    assert refused.status == "unsupported" and "40 solids" in refused.reason


@pytest.mark.parametrize("variant", [*WHOLE_MODEL, "numba-parallel"])
@pytest.mark.parametrize("depth", [0, 1, 4, 7])
def test_lattices_of_any_depth(agree, depth, variant):
    """SAM-4, SAM-5: from a whole tile in work to a single pixel; with a lens, so that each point draws."""
    scene = (
        STAGE + LIGHTS + FLOOR + f"SPHERE (0,0,0) 1 {MIRROR}\nBOX (0.4,-1,1) (1,0,0.3) (0,1,0) (-0.3,0,1) {MIRROR}\n"
    )
    size = {"width": 39 if depth < 7 else 5, "height": 27 if depth < 7 else 4}
    agree(variant, scene, depth=1, sampler="adaptive", adaptive_depth=depth, lens_radius=0.05, focal_distance=5, **size)


@pytest.mark.parametrize("variant", WHOLE_MODEL)
def test_a_region_of_many_children_differs_by_rounding_alone(render, variant):
    """VEC-1: the sums of a pixel may have another order."""
    scene = STAGE + LIGHTS + FLOOR + f"SPHERE (0,0,0) 1 {GLASS}\nSPHERE (1.5,0,1) 1 {GLASS}\n"
    job = {"depth": 5, "shadows": True, "sampler": "jittered", "samples": 2}
    whole, part = render(variant, scene, **job), render(variant, scene, region=(5, 3, 61, 40), **job)
    assert np.abs(part.array - whole.array[3:40, 5:61]).max() < 1e-14


def attempt(bench, variant, source, **parameters):
    """The Result of a picture in lanes, or of its refusal."""
    entry = bench.entry(variant)
    read = text.read(source, "scene of the test")
    wanted = Parameters(**{**SIZE, "vector": "on", **parameters})
    needed = needs(read, wanted)
    wanted = bench.sharing(entry, wanted, needed)
    return bench.run(entry, flatten(read), wanted, needed)


@pytest.mark.parametrize(
    "parameters",
    by_night(
        [{"walk": "stack"}, {"sphere": "textbook"}, {"offset": "none"}, {"triangle": "moller-trumbore"}],
        *("sphere", "offset", "triangle"),  # each a build of its own
        ids=lambda parameters: next(iter(parameters)),
    ),
)
def test_refuses_without_a_hierarchy_what_rays_have_no_lanes_for(bench, laned, parameters):
    scene = STAGE + LIGHTS + f"SPHERE (0,0,0) 1 {MIRROR}\n"
    result = attempt(bench, laned, scene, depth=2, accel="none", **parameters)
    assert result.status == "unsupported", (result.status, result.reason, result.stderr)
    assert "vector" in result.reason, result.reason


@pytest.mark.nightly("test_a_hierarchy_in_lanes_with_other_methods compares bytes by day; here C++ is built 4 times")
@pytest.mark.slow
@pytest.mark.parametrize("name", ["media", "open mesh", "csg mesh", "soft", "mix: all of it"])
@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_a_hierarchy_in_lanes_changes_no_byte(bench, laned, tmp_path, name, precision):
    """VEC-3, or it is refused: boxes of nodes, spheres and triangles of leaves side by side. Asked for a walk that goes
    ray by ray, pictures are so, too."""
    source, job = features(tmp_path)[name]
    job = {"walk": "recursion", **job}
    result = attempt(bench, laned, source, **job, precision=precision)
    if result.status == "unsupported":
        assert "vector" in result.reason
        pytest.skip(result.reason)
    assert result.status == "ok", (result.status, result.reason, result.stderr)
    plain = bench.result(laned, source, **SIZE, **job, precision=precision, accel="bvh")
    assert plain.said.used["methods"]["accel"] == "bvh"
    assert result.array.tobytes() == plain.array.tobytes() and result.said.rays == plain.said.rays


@pytest.mark.parametrize(
    ("name", "methods"),
    [
        ("mix: glass mesh and solid in water", {"fresnel": "unclamped"}),
        ("mesh", {"triangle": "moller-trumbore"}),
    ],
    ids=["rays that are no numbers", "triangles without a sheared frame"],
)
def test_a_hierarchy_in_lanes_with_other_methods(bench, laned, tmp_path, name, methods):
    """VEC-3; beyond the critical angle the bare formula sends rays of NaN into every lane of every node (NUM-5)."""
    source, job = features(tmp_path)[name]
    job = {**job, **SIZE, "accel": "bvh", **methods}
    result = attempt(bench, laned, source, **job)
    if result.status == "unsupported":
        pytest.skip(result.reason)
    assert result.status == "ok", (result.status, result.reason, result.stderr)
    plain = bench.result(laned, source, **job)
    assert (plain.said.rays["non_finite"] > 0) == ("fresnel" in methods)
    assert result.array.tobytes() == plain.array.tobytes() and result.said.rays == plain.said.rays


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_hits_of_a_hierarchy_in_lanes_change_no_byte(bench, laned, tmp_path, precision):
    """VEC-3, first hits: many spheres of all sizes, a fine mesh, boxes; rays at edges and vertices among them."""
    rng = np.random.default_rng([66, len(precision)])
    vertices, faces = ball(4)
    (tmp_path / "ball.obj").write_text(obj(vertices, faces))
    scene = random_scene(rng, sphere=300, box=9, spread=6)
    scene += f'MESH "{tmp_path}/ball.obj" (0.3,0.2,0.1) (10,20,30) 1.7 {MATERIAL}\n'
    read = text.read(scene, "scene of the test")
    corners = flatten(read)["mesh_vertices"][flatten(read)["mesh_triangles"]]
    origins = rng.normal(0, 4, (6000, 3))
    some = corners[rng.integers(0, len(corners), 6000)]
    share = rng.dirichlet([0.5, 0.5, 0.5], 6000)
    share[:1000] = [1, 0, 0]
    share[1000:3000, 2] = 0
    rays = np.hstack([origins, (share[:, :, None] * some).sum(axis=1) - origins])
    entry, found = bench.entry(laned), {}
    for vector in ("on", "off"):
        wanted = Parameters(kind="rays", precision=precision, vector=vector, accel="bvh")
        result = bench.run(entry, {**flatten(read), "rays": rays}, wanted, shapes(read))
        if result.status == "unsupported":
            pytest.skip(result.reason)
        assert result.status == "ok", result.reason
        found[vector] = result.array
    assert np.isfinite(found["on"][:, 0]).mean() > 0.5
    np.testing.assert_array_equal(found["on"], found["off"])
