"""opencl on whatever device there is, memories, work-groups, faults, and what it refuses."""

import os
from types import SimpleNamespace

import numpy as np
import pytest
import rendered_here
from feature_scenes import features
from random_scenes import random_material, random_rays, random_scene, random_stage

from harness.machine import fitness_gpu
from harness.process import repetition
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.needs import needs
from harness.system import opencl

SMALL = {"width": 48, "height": 40, "depth": 2, "shadows": True}
MIXED = {"sphere": 5, "box": 3, "polygon": 3, "ellipsoid": 3}
# As the study: a sphere of each of four materials, in local light alone.
COLOURS = """
CAMERA (0,0,2) (1,0,0) (0,1,0) (0,0,2)
AMBIENT (0.5,0.5,0.5)
LIGHT (3,4,5) (0.6,0.6,0.6) 0
SPHERE (-0.5,0.4,-1) 0.6 ({0}) 0.1 9 (0,0,0) 2 1
SPHERE (0.6,0.5,-1) 0.5 ({1}) 0.1 9 (0,0,0) 2 1
SPHERE (-0.5,-0.6,-1) 0.5 ({2}) 0.1 9 (0,0,0) 2 1
SPHERE (0.5,-0.5,-1) 0.6 ({3}) 0.1 9 (0,0,0) 2 1
"""
MATERIALS = "0.9,0.1,0.1", "0.1,0.8,0.2", "0.2,0.2,0.9", "0.7,0.7,0.1"


@pytest.fixture(scope="module")
def scenes(tmp_path_factory):
    return features(tmp_path_factory.mktemp("meshes"))


def crowd(seed, **counts):
    rng = np.random.default_rng(seed)
    print("seed", seed)
    return random_scene(rng, **counts, spread=1.8, material=random_material, rest=random_stage(rng))


def test_nothing_changes_a_byte_that_only_says_how_to_launch(bench):
    """Memories, groups that are no power of two or do not fill the picture, few threads, and the same again."""
    scene = crowd(41, **MIXED)
    right = bench.result("opencl", scene, exact=True, **SMALL)
    used = right.said.used["methods"]
    assert used["scene_memory"] == "constant" and used["constant_bytes"] > 0 and used["block"] == "16x16"
    assert used["blocks"] == 3 * 3 and used["total_threads"] == 9 * 256 and used["largest_group"] >= 256
    ways = [{"scene_memory": memory} for memory in ("global", "constant", "shared")]
    ways += [{"block_width": 5, "block_height": 3}, {"block_width": 64, "block_height": 1}]
    ways += [{"block_width": 8, "block_height": 8, "total_threads": 200}, {"accel": "bvh"}, {"walk": "table"}, {}]
    for way in ways:
        other = bench.result("opencl", scene, exact=True, **SMALL, **way)
        told = other.said.used["methods"]
        if "walk" in way:  # which adds up in another order
            np.testing.assert_allclose(other.array, right.array, rtol=0, atol=1e-12)
        else:
            assert other.array.tobytes() == right.array.tobytes(), way
        assert other.said.rays == right.said.rays, way
        if "total_threads" in way:
            assert told["blocks"] == 4 and told["total_threads"] == 256
        if way.get("scene_memory") == "shared":
            assert told["shared_bytes"] > used["shared_bytes"]


def test_the_device_is_told(bench):
    """By its name and number too, as the doctor lists them; that it is a processor, if it is."""
    told = bench.result("opencl", crowd(42, sphere=2), exact=True, **SMALL).said.device
    assert told["name"] and told["simulated"] is False and told["multiprocessors"] >= 1
    assert f": {told['name']}" in fitness_gpu.of_opencl().value
    for way in ("0", told["name"][3:9].upper()):
        assert bench.result("opencl", crowd(42, sphere=2), exact=True, **SMALL, device=way).said.device == told
    if "PoCL" in told["driver"] or "Portable" in told["driver"]:
        assert told["type"] == "cpu"


def rolled(shift):
    return COLOURS.format(*(MATERIALS[(number + shift) % 4] for number in range(4)))


@pytest.mark.parametrize("block", [4, 8])
def test_the_index_fault_is_the_checkered_picture(bench, block):
    """Each group takes its colours from rows that begin at its place in the picture: predicted to the last bit."""
    job = {"width": 32, "height": 32, "depth": 0, "shadows": False, "block_width": block, "block_height": block}
    faulty = bench.picture("opencl-index-fault", rolled(0), **job)
    shifted = [bench.picture("opencl", rolled(shift), exact=True, **job) for shift in range(4)]
    for row in range(0, 32, block):
        for column in range(0, 32, block):
            tile = np.s_[row : row + block, column : column + block]
            shift = (row + column) // block % 4
            assert faulty[tile].tobytes() == shifted[shift][tile].tobytes(), (row, column)
    assert not np.array_equal(faulty, shifted[0])


def test_the_barrier_fault_shows_where_groups_really_run(bench):
    """PoCL runs the threads of a group one after another up to the next barrier: the first see a scene half filled."""
    job = {"width": 32, "height": 32, "depth": 0, "shadows": False}
    right = bench.picture("opencl", rolled(0), exact=True, **job)
    wrong = bench.picture("opencl-barrier-fault", rolled(0), **job)
    assert not np.array_equal(right, wrong)


REFUSED = {
    "device 99": ({"device": "99"}, "no OpenCL device 99; there are: 0 "),
    "another name": ({"device": "no such thing"}, 'no OpenCL device "no such thing"; there are: 0 '),
    "a table": ({"walk": "table", "depth": 40}, "walk table: a pixel takes"),
    "a chain": ({"walk": "chain", "depth": 2}, "walk chain: a ray of this scene can have"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_it_refuses(bench, scenes, name):
    job, reason = REFUSED[name]
    scene = text.read(scenes["transmission"][0], name)
    wanted = Parameters(**{"width": 8, "height": 8, "threads": bench.entry("opencl").threads(), **job})
    result = bench.run(bench.entry("opencl"), flatten(scene), wanted, needs(scene, wanted))
    assert result.status == "unsupported" and reason in result.reason, result


def test_a_scene_larger_than_local_memory_is_streamed(bench):
    job = {"width": 10, "height": 6, "depth": 1, "shadows": True, "accel": "none", "block_width": 4, "block_height": 4}
    scene = crowd(43, sphere=60000)
    right, streamed = (
        bench.result("opencl", scene, exact=True, **job, scene_memory=name) for name in ("global", "shared")
    )
    assert streamed.said.used["methods"]["streamed"] and not right.said.used["methods"]["streamed"]
    assert streamed.array.tobytes() == right.array.tobytes() and streamed.said.rays == right.said.rays


@pytest.fixture
def here(bench, tmp_path, monkeypatch, capsys):
    """here(scene text, rays, **parameters): array and events of a job in this process.

    No scene fits into local memory. Tiles have 75 numbers, as many as two boxes or five triangles take.
    """
    bench.entry("opencl")
    from renderers.opencl import method, session

    of_device = session.Session.room_of_memories
    monkeypatch.setattr(session.Session, "room_of_memories", lambda self: {**of_device(self), "shared": 0})

    def render(source, rays=None, **parameters):
        monkeypatch.setattr(method, "TILE", 300 if parameters.get("precision") == "float32" else 600)
        return rendered_here.render(tmp_path, capsys, session.Session, source, "opencl", rays, **parameters)

    return render


MANY = crowd(46, sphere=40)
# Of a scene: more parameters, and the walk that the job takes.
STREAMED = {
    "a chain": ("40 spheres", {"cutoff": 0.01, "precision": "float32"}, "chain"),
    "a stack, of glass": ("media", {"shadows": True}, "stack"),
    "a mesh of glass in water": ("mix: glass mesh and solid in water", {}, "stack"),
    "soft shadows and gloss": ("mix: soft shadows and gloss through a lens", {"precision": "float32"}, "stack"),
    "several samples": ("mix: jittered glass, soft shadows", {}, "stack"),
    "every shape": ("mix: all of it", {"sampler": "one", "precision": "float32"}, "stack"),
}
GROUPS = {
    "rows left over": {"block_width": 5, "block_height": 3},
    "a thread alone": {"block_width": 1, "block_height": 1},
    "more threads than pixels": {"block_width": 16, "block_height": 16},
    "fewer threads than pixels": {"block_width": 4, "block_height": 3, "total_threads": 30},
    "a region": {"block_width": 8, "block_height": 4, "region": (3, 2, 14, 9)},
}


def of_both(here, source, **job):
    """Renders from global memory and through tiles: array and counts are the same bytes. Returns `used` of tiles."""
    (right, direct), (mine, said) = (here(source, **job, scene_memory=name) for name in ("global", "shared"))
    used = said["used"]["methods"]
    assert used["scene_memory"] == "shared" and used["streamed"] and not direct["used"]["methods"]["streamed"]
    assert mine.tobytes() == right.tobytes() and said.get("rays") == direct.get("rays")
    return used


@pytest.mark.parametrize("case", STREAMED)
def test_tiles_change_no_bit_of_the_picture(here, scenes, case):
    name, more, walk = STREAMED[case]
    source, parameters = {**scenes, "40 spheres": (MANY, {"depth": 2, "shadows": True})}[name]
    used = of_both(here, source, **{**parameters, **more}, accel="none")
    assert used["walk"] == walk


@pytest.mark.parametrize("group", GROUPS)
def test_tiles_change_no_bit_whatever_the_groups(here, group):
    of_both(here, MANY, depth=2, shadows=True, **GROUPS[group], accel="none")


def test_tiles_change_no_bit_of_hits(here, scenes):
    source, _ = scenes["mix: all of it"]
    rays = random_rays(np.random.default_rng(7), 50)
    of_both(here, source, rays=rays, accel="none", block_width=4, block_height=4)


def test_auto_takes_no_tree_in_local_memory(here):
    """As numba-cuda: a tree of shapes that do not fit would leave nothing to choose but to refuse."""
    assert of_both(here, crowd(44, sphere=150), depth=1)["accel"] == "none"


UNSTREAMED = {
    "a table": ({"walk": "table", "depth": 2}, "walk table cannot be streamed"),
    "adaptive samples": ({"sampler": "adaptive"}, "adaptive samples cannot be streamed"),
    "a tree": ({"accel": "bvh"}, "scene_memory shared: the scene takes"),
    "solids alone": ({"solids": 40}, "CSG solids cannot be streamed"),
    "many corners": ({"corners": 13}, "a polygon has 13 vertices, and a tile holds 11; use global"),
}  # fmt: skip


@pytest.mark.parametrize("name", UNSTREAMED)
def test_what_cannot_be_streamed(here, capsys, name):
    job, reason = UNSTREAMED[name]
    job = {"depth": 1, "accel": "none", **job}
    source = COLOURS.partition("SPHERE")[0] if "solids" in job else crowd(45, sphere=150)
    for k in range(job.pop("solids", 0)):
        source += f"AND SPHERE ({k},0,0) 1.1 SPHERE ({k},1,0) 0.9 END (0.5,0.6,0.7) 0.4 20 (0,0,0) 9 1\n"
    if corners := job.pop("corners", 0):
        angles = 2 * np.pi * np.arange(corners) / corners
        ring = " ".join(f"({np.cos(a):.17g},{np.sin(a):.17g},0)" for a in angles)
        source += f"POLYGON {corners} {ring} (0.5,0.6,0.7) 0.4 20 (0,0,0) 9 1\n"
    assert reason in refusal(capsys, lambda: here(source, scene_memory="shared", **job))


def refusal(capsys, call):
    with pytest.raises(SystemExit) as refused:
        call()
    assert refused.value.code == 3
    return capsys.readouterr().out


def test_a_device_without_float64_or_with_small_groups(capsys):
    pytest.importorskip("pyopencl")
    from renderers.opencl import device

    small = SimpleNamespace(name="Small", double_fp_config=0, max_work_group_size=64, max_work_item_sizes=[64, 64, 64])
    job = SimpleNamespace(precision="float64", block_width=8, block_height=8)
    assert "Small has no float64" in refusal(capsys, lambda: device.check(small, job))
    job.precision = "float32"
    device.check(small, job)
    job.block_height = 9
    assert "block 8x9: a work-group of Small has at most 64" in refusal(capsys, lambda: device.check(small, job))


def test_a_compiler_that_fails(bench, capsys):
    bench.entry("opencl")
    from renderers.opencl import session

    job = SimpleNamespace(floating_point="strict", precision="float64")
    here = session.Session("")
    told = refusal(capsys, lambda: here.program("__kernel void f(__global float *x) { x[0] = no_such_name; }", job))
    assert "the compiler of" in told and "error" in told


def test_without_a_driver(bench, monkeypatch, tmp_path):
    """Unavailable, with the remedy; a driver that finds no device is a row with its reason."""
    entry = bench.entry("opencl")
    monkeypatch.setenv(opencl.FOLDER, str(tmp_path))
    assert entry.unavailable == opencl.MISSING
    (tmp_path / "broken.icd").write_text("libno-such-driver.so\n")
    assert entry.unavailable is None
    assert "no OpenCL" in fitness_gpu.of_opencl().value or "PLATFORM_NOT_FOUND" in fitness_gpu.of_opencl().value
    scene = text.read(rolled(0), "colours")
    wanted = Parameters(width=4, height=4)
    result = repetition.run(entry, flatten(scene), wanted, needs(scene, wanted), timeout=60)
    assert result.status == "unsupported" and "no OpenCL" in result.reason and "install" in result.reason, result
    assert os.environ[opencl.FOLDER] == str(tmp_path)
