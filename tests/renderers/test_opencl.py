"""opencl on whatever device there is, memories, work-groups, faults, and what it refuses."""

import os
from types import SimpleNamespace

import numpy as np
import pytest
from feature_scenes import features
from random_scenes import random_material, random_scene, random_stage

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
    assert f": {told['name']}" in fitness_gpu.of_opencl().found
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


def test_a_scene_too_large_for_local_memory(bench):
    wanted = Parameters(**SMALL, scene_memory="shared", accel="none", threads=bench.entry("opencl").threads())
    scene = text.read(crowd(43, sphere=60000), "crowd")
    result = bench.run(bench.entry("opencl"), flatten(scene), wanted, needs(scene, wanted))
    assert result.status == "unsupported", result
    assert "scene_memory shared: the scene takes" in result.reason and "; use global" in result.reason


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
    assert "no OpenCL" in fitness_gpu.of_opencl().found or "PLATFORM_NOT_FOUND" in fitness_gpu.of_opencl().found
    scene = text.read(rolled(0), "colours")
    wanted = Parameters(width=4, height=4)
    result = repetition.run(entry, flatten(scene), wanted, needs(scene, wanted), timeout=60)
    assert result.status == "unsupported" and "no OpenCL" in result.reason and "install" in result.reason, result
    assert os.environ[opencl.FOLDER] == str(tmp_path)
