"""numba-cuda in Numba's simulator: memories, tiles, launch shapes and refusals, against numba on the processor.

The simulator runs threads one after the other and knows barriers. It cannot show a race, nor what a GPU's own cosine or
power returns; the compiled code is looked at in test_cuda_compile.py.
"""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from random_scenes import random_material, random_rays, random_scene, random_stage
from tessellate import ball, obj

from harness.process import repetition
from harness.race import row
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.needs import needs, shapes

TINY = {"width": 9, "height": 7, "depth": 2, "shadows": True, "block_width": 4, "block_height": 2}
TOLERANCE = 1e-12
ROOT = Path(__file__).parents[2]
PAIRS = "test_every_pair has it by day"


@pytest.fixture(autouse=True)
def simulate(monkeypatch):
    monkeypatch.setenv("RAYRACE_CUDASIM", "1")


ONE_ARRAY = """
import time
import numpy as np
from renderers.numba import needs
needs.SIMULATED = True
from numba import cuda as numba_cuda
from renderers.numba.gpu.device import cuda

def slowly(*asked, empty=np.empty):
    time.sleep(0.02)
    return empty(*asked)

def kernel(found):
    found[cuda.threadIdx.x] = id(cuda.shared.array(1, np.int64))

found = np.zeros(8, np.int64)
np.empty = slowly
numba_cuda.jit(kernel)[1, 8](found)
print(len(set(found.tolist())))
"""


def test_threads_of_a_block_share_an_array():
    """Also if one is interrupted while it makes the array."""
    done = subprocess.run(
        [sys.executable, "-c", ONE_ARRAY],
        env={**os.environ, "NUMBA_ENABLE_CUDASIM": "1", "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert done.stdout == "1\n", done.stdout + done.stderr


def crowd(seed, **counts):
    rng = np.random.default_rng(seed)
    print("seed", seed)
    return random_scene(rng, **counts, spread=1.8, material=random_material, rest=random_stage(rng))


def compare(bench, source, **jobs):
    """Picture and counts of numba-cuda are numba's; its Result."""
    on_gpu = bench.result("numba-cuda", source, exact=True, **{**TINY, **jobs})
    here = bench.result("numba", source, exact=False, **{**TINY, **jobs, "scene_memory": "auto"})
    np.testing.assert_allclose(on_gpu.array, here.array, rtol=0, atol=TOLERANCE)
    assert on_gpu.said.rays == here.said.rays
    if here.dropped is not None:
        np.testing.assert_allclose(on_gpu.dropped, here.dropped, rtol=0, atol=TOLERANCE)
    return on_gpu


@pytest.mark.alone
def test_parts_of_a_batch_are_of_one_render(bench):
    jobs = {**TINY, "width": 2, "height": 2, "frames": 2}
    once = bench.result("numba-cuda", crowd(30, sphere=1), exact=True, **jobs)
    often = bench.result("numba-cuda", crowd(30, sphere=1), exact=True, **jobs, least_frame=0.3)
    assert once.array.tobytes() == often.array.tobytes() and once.said.rays == often.said.rays
    for frame in often.said.frames[1:]:
        print(frame)
        assert frame["renders"] > 1
        seconds = (frame["end"] - frame["start"]) / frame["renders"]
        assert 0.5 * seconds < sum(frame["parts"].values()) <= seconds


MIXED = {"sphere": 5, "box": 3, "polygon": 3, "ellipsoid": 3}


@pytest.mark.parametrize("memory", ["auto", "global", "constant", "shared"])
def test_the_same_picture_from_every_memory(bench, memory):
    used = compare(bench, crowd(31, **MIXED), scene_memory=memory).said.used["methods"]
    assert used["scene_memory"] == ("constant" if memory == "auto" else memory)
    assert (used["constant_bytes"] > 0) == (used["scene_memory"] == "constant")
    assert not used["streamed"] and used["accel"] == "none"


FIVE = "(0,0,0) (1,0,0) (1.3,0.7,0) (0.5,1.4,0) (-0.4,0.8,0)"
# As many of one kind as take several tiles of 4 KiB, the last one part full; more than 48 KiB with the rest.
LARGE = {
    "sphere": ({"sphere": 1000}, ""),
    "box": ({"box": 150}, ""),
    "polygon": ({"polygon": 190}, f"POLYGON 5 {FIVE} (0.5,0.6,0.7) 0.4 20 (0,0,0) 9 1\n"),
    "ellipsoid": ({"ellipsoid": 250}, ""),
    "mixed": ({"sphere": 300, "box": 60, "polygon": 40, "ellipsoid": 60}, ""),
}  # fmt: skip


@pytest.mark.parametrize("kind", LARGE)
def test_a_scene_larger_than_shared_memory_is_streamed(bench, kind):
    counts, more = LARGE[kind]
    jobs = {"width": 5, "height": 3, "scene_memory": "shared", "depth": 1, "accel": "none", "block_width": 3}
    used = compare(bench, crowd(32, **counts) + more, **jobs).said.used["methods"]
    assert used["streamed"] and used["shared_bytes"] <= 49152 and used["walk"] == "stack"


@pytest.mark.nightly("test_a_scene_larger_than_shared_memory_is_streamed has each shape by day; it takes about 15 s")
def test_a_mesh_is_streamed_beside_glass_and_a_csg_solid(bench, tmp_path):
    (tmp_path / "ball.obj").write_text(obj(*ball(3)))
    source = random_stage(np.random.default_rng(5)) + (
        f'\nMESH "{tmp_path / "ball.obj"}" (0.2,0.1,0) (10,20,30) 1.1 (0.1,0.1,0.1) 0.9 40 (0.9,0.8,1) 2.25 1\n'
        "AND SPHERE (0.9,-0.3,1.1) 0.6 NOT SPHERE (1.1,0,1.3) 0.5 END END (0.5,0.4,0.3) 0.5 20 (0,0,0) 9 1\n"
    )
    jobs = {"width": 4, "height": 3, "depth": 3, "accel": "none", "block_width": 2}
    used = compare(bench, source, scene_memory="shared", **jobs).said.used["methods"]
    assert used["streamed"]


@pytest.mark.parametrize("accel", ["none", "bvh"])
def test_rays_streamed_or_through_a_tree(bench, accel):
    source = crowd(33, sphere=900)
    rays = random_rays(np.random.default_rng(33), 21)
    memory = "shared" if accel == "none" else "global"
    found = bench.hits("numba-cuda", source, rays, accel=accel, scene_memory=memory)
    np.testing.assert_allclose(found, bench.hits("numba", source, rays), rtol=0, atol=TOLERANCE)


@pytest.mark.parametrize(
    ("launch", "threads"),
    [
        ({"block_width": 1, "block_height": 1}, 63),
        ({"block_width": 16, "block_height": 16}, 256),
        ({"block_width": 5, "block_height": 3, "total_threads": 15}, 15),
        ({"block_width": 2, "block_height": 2, "total_threads": 21}, 20),
        ({"block_width": 3, "block_height": 1, "total_threads": 100000}, 63),
        ({"region": (2, 1, 8, 6), "block_width": 4, "block_height": 4}, 64),
    ],
)
def test_the_same_picture_from_every_launch(bench, launch, threads):
    used = compare(bench, crowd(34, **MIXED), **launch).said.used["methods"]
    assert used["total_threads"] == threads


def test_streamed_with_fewer_threads_than_pixels(bench):
    jobs = {"width": 5, "height": 5, "depth": 1, "accel": "none", "scene_memory": "shared"}
    compare(bench, crowd(35, sphere=850), **jobs, block_width=2, block_height=2, total_threads=8)


@pytest.mark.nightly(PAIRS)
@pytest.mark.parametrize("walk", ["table", "stack"])
def test_walks_of_glass(bench, walk):
    glass = "SPHERE (0,0,0) 1.4 (0.1,0.1,0.1) 0.9 40 (0.9,0.8,1) 2.25 1\n"
    used = compare(bench, crowd(36, sphere=3) + glass, walk=walk, depth=3).said.used["methods"]
    assert used["walk"] == walk and used["local_bytes"] > 0


@pytest.mark.parametrize("launch", [{}, {"total_threads": 16}, {"sampler": "uniform", "samples": 2}])
@pytest.mark.parametrize("glass", ["", "SPHERE (0,0,0) 1.4 (0.1,0.1,0.1) 0.9 40 (0.9,0.8,1) 2.25 1\n"])
def test_rays_are_cut_off(bench, glass, launch):
    result = compare(bench, crowd(39, **MIXED) + glass, depth=3, cutoff=0.2, **launch)
    assert result.dropped.max() > 0 and result.said.used["methods"]["cutoff"] == 0.2


def test_rays_are_cut_off_while_tiles_are_streamed(bench):
    jobs = {"width": 5, "height": 5, "accel": "none", "scene_memory": "shared", "block_width": 2}
    result = compare(bench, crowd(40, sphere=850), cutoff=2.0**-4, **jobs)
    assert result.dropped.max() > 0 and result.said.used["methods"]["streamed"]


@pytest.mark.nightly(PAIRS)
@pytest.mark.parametrize("method", ["textbook", "stable"])
def test_methods_of_spheres(bench, method):
    used = compare(bench, crowd(41, **MIXED), sphere=method).said.used["methods"]
    assert used["sphere"] == method and used["floating_point"] == "strict"


@pytest.mark.nightly(PAIRS)
def test_single_precision_is_near(bench):
    source = crowd(37, sphere=4, box=2)
    pictures = [bench.picture(name, source, **TINY, precision="float32") for name in ("numba-cuda", "numba")]
    assert pictures[0].dtype == np.float32
    assert np.median(np.abs(pictures[0] - pictures[1])) < 1e-6


REFUSED = {
    "constant": ({"sphere": 1500}, {"scene_memory": "constant", "accel": "none"}, "constant: the scene takes"),
    "tree in shared": ({"sphere": 1500}, {"scene_memory": "shared", "accel": "bvh"}, "shared: the scene takes"),
    "adaptive": ({"sphere": 1200}, {"scene_memory": "shared", "sampler": "adaptive"}, "adaptive samples cannot be"),
    "table of tiles": ({"sphere": 1200}, {"scene_memory": "shared", "walk": "table"}, "walk table cannot be streamed"),
    "registers": ({"sphere": 1}, {"max_registers": 128, "block_width": 32, "block_height": 32}, "max_registers 128"),
    "corners": ({"sphere": 1100}, {"scene_memory": "shared", "polygon": 70}, "70 vertices, and a tile holds 56"),
    "solids": ({"solids": 500}, {"scene_memory": "shared"}, "CSG solids cannot be streamed"),
    "cut-off": ({"sphere": 2}, {"walk": "table", "cutoff": 0.1}, "cutoff: with the walks chain and stack"),
    "fast": ({"sphere": 2}, {"floating_point": "fast"}, "the simulator of a GPU is strict"),
    "waiting": ({"sphere": 2}, {"gpu_wait": "block"}, "gpu_wait block: the simulator of a GPU has no driver"),
    "table": ({"sphere": 2}, {"walk": "table", "depth": 15, "glass": True}, "work memory takes"),
}  # fmt: skip


@pytest.mark.whole
@pytest.mark.parametrize("name", REFUSED)
def test_refused_with_the_reason(known, tmp_path, name):
    counts, jobs, reason = REFUSED[name]
    solids = dict(counts).pop("solids", 0)
    source = crowd(38, **{} if solids else counts)
    for k in range(solids):
        source += f"AND SPHERE ({k},0,0) 1.1 SPHERE ({k},1,0) 0.9 END (0.5,0.6,0.7) 0.4 20 (0,0,0) 9 1\n"
    if corners := jobs.pop("polygon", 0):
        angles = 2 * np.pi * np.arange(corners) / corners
        ring = " ".join(f"({np.cos(a):.17g},{np.sin(a):.17g},0)" for a in angles)
        source += f"POLYGON {corners} {ring} (0.5,0.6,0.7) 0.4 20 (0,0,0) 9 1\n"
    if jobs.pop("glass", False):
        source += "SPHERE (0,0,0) 1.4 (0.1,0.1,0.1) 0.9 40 (0.9,0.8,1) 2.25 1\n"
    scene, parameters = text.read(source), Parameters(**{**TINY, **jobs})
    result = repetition.run(known["numba-cuda"], flatten(scene), parameters, needs(scene, parameters))
    assert result.status == "unsupported" and reason in result.reason, (result.status, result.reason)


def coloured(count, shift=0):
    """Spheres of `count` colours in a grid, the colours given round by `shift`."""
    rng = np.random.default_rng(9)
    colours = rng.uniform(0.2, 0.9, (count, 3))
    lines = ["CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,5)\nAMBIENT (1,1,1)"]
    for k in range(count):
        place = f"({k % 4 * 0.5 - 0.75},{k // 4 * 0.5 - 0.75},0)"
        colour = ",".join(f"{x:.17g}" for x in colours[(k + shift) % count])
        lines.append(f"SPHERE {place} 0.3 ({colour}) 0 1 (0,0,0) 1 1")
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("block", [2, 4])
def test_the_index_fault_gives_each_block_the_colours_from_another_row_on(bench, block):
    """The exhibit's picture is the one that its explanation predicts, to the last bit: AIR is the table's last row."""
    count, size = 15, {"width": 16, "height": 16, "depth": 0}
    faulty = bench.picture(
        "numba-cuda-index-fault", coloured(count), exact=True, **size, block_width=block, block_height=block
    )
    right = bench.picture("numba", coloured(count), exact=True, **size)
    assert np.abs(faulty - right).max() > 0.1
    table = np.vstack([bench_materials(coloured(count)), np.zeros(3)])  # AIR's colour is none
    which = objects(bench, coloured(count), size)
    for j in range(16):
        for i in range(16):
            shift = i // block * block + j // block * block
            expected = table[(which[j, i] + shift) % (count + 1)] if which[j, i] >= 0 else 0
            np.testing.assert_array_equal(faulty[j, i], expected)


def bench_materials(source):
    return flatten(text.read(source))["materials"][:, :3]


def objects(bench, source, size):
    """Which object each pixel shows; -1 for none."""
    x = 2 * (np.arange(size["width"]) + 0.5) / size["width"] - 1
    y = 1 - 2 * (np.arange(size["height"]) + 0.5) / size["height"]
    towards = np.array([(a, b, -5.0) for b in y for a in x])
    rays = np.hstack([np.tile((0.0, 0.0, 5.0), (len(towards), 1)), towards])
    return bench.hits("numba", source, rays)[:, 7].astype(int).reshape(size["height"], size["width"])


def test_the_studys_choices_are_a_variant(known, bench):
    """Global memory and the table, whatever the job leaves open; the picture is right, other choices are refused."""
    source, size = crowd(41, sphere=5), {"width": 6, "height": 5, "depth": 2, "block_width": 4, "block_height": 2}
    result = bench.result("study-cuda-global", source, exact=True, **size)
    np.testing.assert_allclose(result.array, bench.picture("numba", source, **size), rtol=0, atol=TOLERANCE)
    used = result.said.used["methods"]
    assert (used["walk"], used["walk_rows"], used["scene_memory"], used["accel"]) == ("table", 7, "global", "none")
    assert row.unranked(known["study-cuda-global"], result.said).startswith("exhibit of a cost: ")
    scene, stacked = text.read(source), Parameters(**size, walk="stack")
    refused = repetition.run(known["study-cuda-global"], flatten(scene), stacked, needs(scene, stacked))
    assert refused.status == "unsupported" and "walk stack" in refused.reason


def test_exhibits_are_wrong_and_in_no_ranking(known, bench):
    scene = text.read(coloured(15))
    parameters = Parameters(width=16, height=16, depth=0, block_width=4, block_height=4)
    right = bench.picture("numba", coloured(15), exact=True, width=16, height=16, depth=0)
    for name in ("numba-cuda-index-fault", "numba-cuda-barrier-fault"):
        result = repetition.run(known[name], flatten(scene), parameters, (*shapes(scene), "ambient"))
        assert result.status == "ok", result.reason
        assert not np.allclose(result.array, right, rtol=0, atol=1e-9, equal_nan=False), name
        assert row.unranked(known[name], result.said).startswith("exhibit: ")
