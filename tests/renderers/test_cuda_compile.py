"""The kernels of numba-cuda as NVIDIA's compilers make them, for GPUs that are not here: what they take and contain."""

import json
import re
import subprocess
import sys
from pathlib import Path

import cuda_on_host
import numpy as np
import pytest
from feature_scenes import features
from random_scenes import random_material, random_scene, random_stage

import renderers
from harness.contract import compile_report
from harness.renderer import job
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.generate.comparison import comparison
from harness.scene.needs import needs
from renderers.numba.gpu.occupancy import occupancy

LINK = Path(__file__).parents[1] / "support" / "link_kernels.py"
SIZE = {"width": 64, "height": 64}


@pytest.fixture(scope="module")
def inspect(tmp_path_factory):
    """inspect(scene text, target, **parameters): the kernels of the job. Skips without NVIDIA's compilers."""

    def flags(source, variant="numba-cuda", **parameters):
        scene, wanted = text.read(source), Parameters(**{**SIZE, **parameters})
        folder, needed = tmp_path_factory.mktemp("job"), needs(scene, wanted)
        job.write(folder / "job", flatten(scene), wanted, needed)
        return job.flags(folder / "job", folder, variant, None, wanted, needed)

    def run(source, target="sm_90", **parameters):
        command = [sys.executable, "-m", "renderers.numba.gpu.inspect", *flags(source, **parameters)]
        command.append(f"--targets={target}")
        done = subprocess.run(command, capture_output=True, text=True)
        said = [json.loads(line) for line in done.stdout.splitlines()]
        if done.returncode == 3 and "rayrace[cuda]" in said[-1]["reason"]:
            pytest.skip(said[-1]["reason"])
        assert done.returncode == 0, (said, done.stderr)
        return said

    run.flags = flags
    return run


@pytest.mark.parametrize("target", ["sm_75", "sm_90"])
def test_the_mirrors_of_the_comparison_take_48_registers(inspect, target):
    (kernel,) = inspect(comparison(), target, precision="float32", depth=10)
    assert kernel["registers"] <= 48 and kernel["spill_store_bytes"] == kernel["spill_load_bytes"] == 0
    assert kernel["float64_instructions"] == 0 and kernel["local_bytes"] == 0


@pytest.mark.parametrize("memory", ["global", "shared"])
def test_no_memory_makes_the_mirrors_spill(inspect, memory):
    for precision in ("float32", "float64"):
        (kernel,) = inspect(comparison(), precision=precision, depth=10, scene_memory=memory)
        assert kernel["spill_store_bytes"] == kernel["spill_load_bytes"] == 0
        assert (kernel["float64_instructions"] == 0) == (precision == "float32")


def test_the_studys_table_lies_in_the_local_memory_of_each_thread(inspect):
    """2047 rows at depth 10, of an origin, a direction and a weight at least (2.7.4)."""
    (kernel,) = inspect(comparison(), variant="study-cuda-global", depth=10)
    print(kernel["local_bytes"])
    assert kernel["local_bytes"] >= 2047 * 7 * 8


def test_nothing_is_contracted_unless_the_job_asks_for_it(inspect):
    """Without pow, whose own code rounds as it likes, there is no fused multiply-add at all (NUM-3)."""
    matte = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,5)\nLIGHT (3,4,5) (1,1,1) 0\n"
    matte += "SPHERE (0,0,0) 1 (0.5,0.4,0.3) 0 1 (0,0,0) 1 1\n"
    matte += "BOX (1,0,0) (1,0,0) (0,1,0) (0,0,1) (0.5,0.4,0.3) 0 1 (0,0,0) 1 1\n"
    for precision in ("float64", "float32"):
        strict, contract, fast = (
            inspect(matte, depth=0, precision=precision, floating_point=method)[0]
            for method in ("strict", "contract", "fast")
        )
        assert strict["contracted"] == 0 < min(contract["contracted"], fast["contracted"])
        assert fast["ptx_bytes"] != contract["ptx_bytes"]


def test_a_cap_on_registers_is_kept(inspect):
    (kernel,) = inspect(comparison(), precision="float64", depth=10, max_registers=40)
    assert kernel["registers"] <= 40 and kernel["spill_store_bytes"] > 0


@pytest.mark.parametrize(
    "name", ["media", "csg mesh", "adaptive", "lens", "glossy, the study's weight", "mix: all of it"]
)
def test_no_feature_brings_float64_into_float32(inspect, tmp_path, name):
    source, parameters = features(tmp_path)[name]
    for kernel in inspect(source, precision="float32", **parameters):
        assert kernel["float64_instructions"] == 0
        assert kernel["spill_store_bytes"] == 0 or name.startswith("mix"), kernel


@pytest.mark.parametrize(
    "parameters",
    [
        {"precision": "float32", "accel": "bvh", "scene_memory": "global"},
        {"precision": "float64", "accel": "none", "scene_memory": "shared"},
        {"precision": "float32", "accel": "none", "walk": "table", "total_threads": 1024},
        {"precision": "float64", "sampler": "adaptive"},
    ],
    ids=["tree", "tiles", "table", "adaptive"],
)
def test_trees_tables_and_tiles_compile(inspect, parameters):
    rng = np.random.default_rng(3)
    source = random_scene(
        rng, 900, 20, 20, 20, material=random_material, rest=random_stage(rng)
    ) + "SPHERE (0,0,0) 1 (0.1,0.1,0.1) 0.9 40 (0.9,0.8,1) 2.25 1\n"  # fmt: skip
    inspect(source, depth=3, shadows=True, **parameters)


@pytest.mark.whole
@pytest.mark.parametrize(
    ("capability", "threads", "registers", "shared", "share"),
    [  # worked out by hand from the rules of NVIDIA's calculator
        ((9, 0), 256, 32, 0, 1.0),  # 64 warps at 32 registers fill 65536
        ((9, 0), 256, 33, 0, 0.75),  # 40 a thread in steps of 8: 12 warps in each quarter, 6 blocks of 8
        ((9, 0), 256, 64, 0, 0.5),
        ((9, 0), 256, 255, 0, 0.125),
        ((9, 0), 32, 16, 0, 0.5),  # 32 blocks at most
        ((9, 0), 1024, 16, 100 * 1024, 1.0),  # two blocks of 101 KiB in 228
        ((9, 0), 1024, 16, 120 * 1024, 0.5),
        ((7, 5), 1024, 64, 0, 1.0),  # 32 warps at most
        ((7, 5), 96, 16, 0, 30 / 32),  # blocks of 3 warps: 10 of them
        ((8, 6), 256, 32, 48 * 1024, 16 / 48),  # two blocks of 49 KiB in 100
    ],
)
def test_occupancy(capability, threads, registers, shared, share):
    assert occupancy(capability, threads, registers, shared) == pytest.approx(share)


def test_occupancy_of_an_unknown_capability():
    assert occupancy((3, 5), 256, 32, 0) is None


@pytest.mark.parametrize(
    ("parameters", "option", "found"),
    [
        ({}, {"launch_bounds": [256, 1]}, ".maxntid 256"),
        ({"max_registers": 40}, {"max_registers": 40}, ""),
        ({"block_width": 8, "block_height": 4, "total_threads": 64}, {"launch_bounds": [32, 1]}, ".minnctapersm 1"),
    ],
)
def test_a_launch_is_linked_to_a_program(inspect, parameters, option, found):
    """The options of a launch reach the compiler, and what comes of them is a program that the driver would load."""
    inspect(comparison(spheres=2), **parameters)  # skips without the compilers
    flags = inspect.flags(comparison(spheres=2), **parameters)
    done = subprocess.run([sys.executable, LINK, *flags], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    (kernel,) = map(json.loads, done.stdout.splitlines())
    options = {name: value for name, value in kernel["options"].items() if name in option}
    assert options == option and found in kernel["ptx"] and (".maxntid" in kernel["ptx"]) == bool(found)
    assert bytes.fromhex(kernel["start"]) == b"\x7fELF" and kernel["bytes"] > 10000


def test_what_is_asked_of_a_device_is_known():
    """Names that no machine without a GPU would ever look up."""
    bindings = pytest.importorskip("cuda.bindings.driver")
    from numba.cuda import dispatcher

    sources = "".join(path.read_text() for path in (Path(renderers.__file__).parent / "numba" / "gpu").glob("*.py"))
    asked = set(re.findall(r"\b(?:here|device)\.([A-Z][A-Z_]+)\b", sources))
    assert len(asked) >= 5
    for name in asked:
        assert hasattr(bindings.CUdevice_attribute, "CU_DEVICE_ATTRIBUTE_" + name), name
    for name in re.findall(r"\bcompiled\.(\w+)", sources):
        assert hasattr(dispatcher._Kernel, name), name


@pytest.mark.parametrize(
    ("wait", "flag"),
    [("auto", None), ("spin", "SPIN"), ("yield", "YIELD"), ("block", "BLOCKING_SYNC")],
)
def test_how_to_wait_is_set_before_the_context_is_made(monkeypatch, wait, flag):
    """By Numba's driver, of which only the calls of cuda.bindings are replaced."""
    bindings = pytest.importorskip("cuda.bindings.driver")
    from numba.cuda.cudadrv import driver

    from renderers.numba.gpu import device

    stand = cuda_on_host.Driver(bindings)
    stand.CUresult, stand.flags = bindings.CUresult, None
    numbas = object.__new__(driver.Driver)
    numbas.is_initialized, numbas.initialization_error = False, None
    seen = []
    monkeypatch.setattr(driver, "driver", numbas)
    monkeypatch.setattr(driver, "binding", stand)
    monkeypatch.setattr(device.numba_cuda, "current_context", lambda: seen.append(stand.flags))
    monkeypatch.setattr(device, "held", {"wait": "auto"})
    device.begin(wait)
    right = None if flag is None else int(getattr(bindings.CUctx_flags, f"CU_CTX_SCHED_{flag}"))
    assert seen == [right]
    device.begin("auto")  # of another job of this process
    assert seen == [right, None if flag is None else 0]


def test_cases_of_the_report_are_what_they_say():
    found = compile_report.cases()
    everything = next(case for case in found if case.name == "everything")
    used = set(needs(everything.scene, everything.parameters))
    assert {"soft", "glossy", "lens", "csg", "polygon", "ellipsoid", "transmission", "attenuation"} <= used
    assert {case.parameters.precision for case in found} == {"float32", "float64"}
