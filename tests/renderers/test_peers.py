"""Peers make the pictures of SPEC.md: spheres by Taichi, JAX, Cython, mypyc and PyPy, meshes by Embree.

Where one is not installed its tests are skipped, and say why.
"""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from random_scenes import random_material, random_scene, random_stage
from tessellate import ball, obj

from harness.judge import judge, reference
from harness.process import repetition
from harness.renderer import registry
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.needs import needs, shapes

SCENES = Path(__file__).parents[2] / "experiments" / "scenes"
FOLDERS = ("taichi", "jax", "typed", "embree", "naive")
SPHERES = ("taichi", "taichi-parallel", "jax", "cython", "mypyc", "pypy")
SINGLE = ("taichi", "jax")  # those of them that have float32
SEED = 8
# The eye is inside the large sphere: what it sees is lit and mirrored from within.
INSIDE = (
    "CAMERA (0.1,-0.2,0) (2.1,0,-0.2) (0,2.1,0) (0.4,0.9,6.1)\nAMBIENT (0.4,0.5,0.3)\nBACKGROUND (0.5,0.6,0.8)\n"
    "AIR 1.21 1.1 (1,1,1)\nLIGHT (1.1,2.3,4.2) (0.9,0.8,0.7) 0\nSPHERE (0,0,0) 9 (0.7,0.5,0.3) 0.6 20 (0,0,0) 9 1.2\n"
    "SPHERE (0.3,0.2,0.1) 1.1 (0.2,0.6,0.3) 0.8 7.5 (0,0,0) 400 1\nSPHERE (-1.2,0.9,0.4) 0.5 (1,0,1) 0 1 (0,0,0) 1 1\n"
)


@cache
def source(name):
    if name == "seed":
        print("seed", SEED)
        rng = np.random.default_rng(SEED)
        return random_scene(rng, 9, 0, 0, 0, material=random_material, rest=random_stage(rng))
    return INSIDE if name == "inside" else (SCENES / name).read_text()


@pytest.fixture(scope="module")
def agrees(bench, known):
    """A function that renders and asserts: right by the judge, as many rays as SPEC.md wants."""
    made = {}

    def check(variant, source, **parameters):
        result = bench.result(variant, source, exact=True, **parameters)
        wanted, scene = Parameters(**parameters), text.read(source, "scene of the test")
        needed = needs(scene, wanted)
        maker = reference.choose(known[variant], known, wanted, needed)
        key = source, wanted.picture(), maker.name
        if key not in made:
            made[key] = bench.reference(maker, flatten(scene), wanted, needed)
        found = made[key]
        verdict = judge.judge(result.array, found, wanted.precision)
        print(f"{variant} against {found.maker}: {verdict} {result.said.rays}")
        assert verdict.wrong is None, verdict.wrong
        assert judge.compare_rays(result.said.rays, found.rays, wanted.precision) is None
        assert result.said.rays["non_finite"] == 0 and result.said.rays["primary"] == result.array[..., 0].size
        assert result.said.used["methods"]["precision"] == wanted.precision
        return result

    return check


@pytest.mark.parametrize("name", ["comparison.txt", "inside", "seed"])
@pytest.mark.parametrize("variant", SPHERES)
def test_pictures_of_spheres(agrees, variant, name):
    result = agrees(variant, source(name), width=40, height=32, depth=6, shadows=True)
    assert result.array.std() > 1e-3, "the scene shows nothing"
    agrees(variant, source(name), width=40, height=32, depth=0)


@pytest.mark.parametrize("variant", SINGLE)
def test_float32(agrees, variant):
    result = agrees(variant, source("comparison.txt"), width=64, height=64, depth=5, shadows=True, precision="float32")
    assert result.array.dtype == np.float32


@pytest.mark.parametrize("variant", SPHERES)
def test_a_region_and_a_moved_sample(agrees, bench, variant):
    jobs = {"width": 37, "height": 29, "depth": 4, "shadows": True, "sample_x": 0.25, "sample_y": 0.875}
    whole = agrees(variant, source("inside"), **jobs).array
    for x0, y0, x1, y1 in ((0, 0, 1, 1), (36, 28, 37, 29), (5, 3, 30, 28)):
        part = bench.picture(variant, source("inside"), exact=True, region=(x0, y0, x1, y1), **jobs)
        assert part.tobytes() == whole[y0:y1, x0:x1].tobytes()


@pytest.mark.parametrize("variant", ["taichi-parallel", "jax"])
def test_threads_change_no_byte(bench, variant):
    jobs = {"width": 61, "height": 47, "depth": 6, "shadows": True, "exact": True}
    one, *more = (bench.result(variant, source("comparison.txt"), threads=n, **jobs) for n in (1, 2, 7))
    assert one.said.used["methods"]["threads"] == 1
    assert all(other.array.tobytes() == one.array.tobytes() for other in more)


def test_one_source_makes_one_picture(bench):
    """Cython, mypyc and PyPy neither fuse nor reorder, so their bytes are alike."""
    jobs = {"width": 48, "height": 40, "depth": 10, "shadows": True, "exact": True}
    cython, *others = (bench.picture(name, source("comparison.txt"), **jobs) for name in ("cython", "mypyc", "pypy"))
    assert all(np.array_equal(cython, other) for other in others)


@pytest.mark.parametrize("variant", ["cython", "mypyc"])
def test_what_was_compiled_is_found_again(bench, known, variant, tmp_path):
    entry, scene = bench.entry(variant), text.read(INSIDE, "scene of the test")
    wanted = Parameters(width=4, height=4, depth=1)
    for expected in ("cold", "warm"):
        result = repetition.run(entry, flatten(scene), wanted, needs(scene, wanted), cache=tmp_path)
        assert result.said.used["methods"]["compile_cache"] == expected, result.reason


@pytest.fixture(scope="module")
def meshes(tmp_path_factory):
    """Text of a scene with a closed mesh and an open one, mirrors."""
    folder = tmp_path_factory.mktemp("meshes")
    vertices, triangles = ball(3)
    (folder / "ball.obj").write_text(obj(vertices, triangles))
    (folder / "open.obj").write_text(obj(vertices, triangles[: len(triangles) // 2]))
    return (
        "CAMERA (0.1,-0.2,0) (2.1,0,-0.2) (0,2.1,0) (0.4,0.9,6.1)\nAMBIENT (0.2,0.2,0.3)\nBACKGROUND (0.1,0.2,0.1)\n"
        "LIGHT (4.1,5.3,6.2) (0.9,0.8,0.7) 0\nLIGHT (-3.7,2.9,4.4) (0.5,0.4,0.6) 0\n"
        f'MESH "{folder / "ball.obj"}" (-0.7,0.1,0.2) (10,20,30) 1.1 (0.7,0.5,0.3) 0.6 20 (0,0,0) 9 1\n'
        f'MESH "{folder / "open.obj"}" (1.1,0.3,-0.6) (40,20,70) 0.9 (0.2,0.5,0.6) 0.5 9 (0,0,0) 4 1.1\n'
    )


@pytest.mark.parametrize("job", [{"depth": 0}, {"depth": 4, "shadows": True}])
def test_pictures_of_meshes(agrees, meshes, job):
    result = agrees("embree", meshes, width=64, height=56, precision="float32", **job)
    assert result.array.std() > 1e-3, "the scene shows nothing"


def test_first_hits(bench, meshes):
    scene = text.read(meshes, "scene of the test")
    rng = np.random.default_rng(SEED)
    print("seed", SEED)
    origins, targets = rng.normal(0, 4, (4000, 3)), rng.normal(0, 0.9, (4000, 3))
    rays = np.hstack([origins, targets - origins])
    wanted, arrays = Parameters(kind="rays", precision="float32"), {**flatten(scene), "rays": rays}
    mine, theirs = (
        repetition.run(bench.entry(name), arrays, wanted, shapes(scene), cache=bench.caches / name).array
        for name in ("embree", "cpp")
    )
    same = mine[:, 7] == theirs[:, 7]
    print(f"{(~same).sum()} rays of {len(rays)} hit another thing")
    assert (~same).sum() <= 4, "more than pass by a silhouette"
    hit = same & (mine[:, 7] >= 0)
    assert hit.sum() > 500
    limits = 64 * 2.0**-24 * np.abs(rays[hit, :3]).max(axis=1)  # roundings, of what coordinates are as large as
    grazing = np.abs(np.einsum("ij,ij->i", theirs[hit, 4:7], (targets - origins)[hit])) < 0.1 * theirs[hit, 0]
    off = np.abs(mine[hit, :4] - theirs[hit, :4]).max(axis=1)
    print(f"off by {(off / limits)[~grazing].max():.2g} of the limit")
    assert (off[~grazing] <= limits[~grazing]).all()
    turned = np.abs(mine[hit, 4:7] - theirs[hit, 4:7]).max(axis=1) > 1e-5
    assert turned.sum() <= 4, "more than hit an edge, and the triangle beside it"
    assert np.array_equal(np.isinf(mine[:, 0]), mine[:, 7] == -1)


@pytest.mark.parametrize("variant", (*SPHERES, "embree"))
def test_what_a_peer_lacks_is_refused(bench, variant):
    """By itself too, and not only by its manifest."""
    entry, scene = bench.entry(variant), text.read(INSIDE, "scene of the test")
    for change, reason in (({}, "transmission"), ({"precision": "mp60"}, "precision")):
        wanted = Parameters(width=4, height=4, **change)
        result = repetition.start(entry, flatten(scene), wanted, ("transmission",) if not change else ())
        assert result.status == "unsupported" and reason in result.reason, (result.status, result.reason)


@pytest.mark.whole
@pytest.mark.parametrize("folder", FOLDERS)
def test_a_peer_that_is_not_here_says_how_to_get_it(monkeypatch, folder):
    monkeypatch.setattr(registry, "_is_installed", lambda module: False)
    monkeypatch.setattr(registry.shutil, "which", lambda program: None)
    entries = [entry for entry in registry.entries().values() if entry.renderer.manifest.name == folder]
    assert entries
    for entry in entries:
        print(entry.name, entry.unavailable)
        assert "(pip install " in entry.unavailable or "(apt install " in entry.unavailable


@pytest.mark.parametrize("floating_point", ["strict", "contract"])
def test_naive_pictures_in_float64(agrees, floating_point):
    size = {"width": 64, "height": 48, "floating_point": floating_point}
    assert agrees("naive", source("comparison.txt"), **size, depth=6).said.rays["reflected"] > 0
    agrees("naive", source("seed"), **size, depth=0, region=(3, 5, 41, 44))


def test_a_naive_ray_beyond_the_critical_angle_is_not_a_number(bench):
    """REF-2 without its test: the eye is in glass, and sees its surface from within at a flat angle."""
    glass = (
        "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,1)\nLIGHT (0,3,5) (1,1,1) 0\n"
        "SPHERE (0,0,-50) 60 (0.2,0.6,0.3) 0.5 20 (0,0,0) 9 1\n"
    )
    result = bench.result("naive", glass, exact=True, width=32, height=32, depth=2)
    assert result.said.rays["non_finite"] == np.isnan(result.array).any(axis=-1).sum() > 0
