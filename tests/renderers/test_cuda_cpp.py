"""cuda-cpp without a GPU: host and kernel on the processor, what compilers say of the kernel, and what it refuses."""

import json
import tempfile
from pathlib import Path

import cuda_on_host
import numpy as np
import pytest
from feature_scenes import features
from random_scenes import random_rays

from harness.renderer import builder
from harness.renderer import job as jobs
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.generate.comparison import comparison
from harness.scene.needs import needs
from harness.scene.needs import shapes as shapes_of
from harness.system import cuda
from renderers import worker
from renderers.opencl import method, run
from renderers.opencl.cuda.occupancy import occupancy

INSTALL = "pip install 'rayrace[cuda]'"
real = pytest.importorskip("cuda.bindings.driver", reason=INSTALL)
SMALL = {"width": 15, "height": 11, "block_width": 4, "block_height": 3}


def flags(folder, source, variant="cuda-cpp", rays=None, **parameters):
    """The flags of a job, written to a new folder in `folder`, where its output belongs too."""
    folder = Path(tempfile.mkdtemp(dir=folder)) / "job"
    scene = text.read(source, "scene")
    wanted = Parameters(**{**SMALL, **parameters, **({} if rays is None else {"kind": "rays"})})
    needed = needs(scene, wanted) if rays is None else shapes_of(scene)
    jobs.write(folder, flatten(scene) if rays is None else {**flatten(scene), "rays": rays}, wanted, needed)
    return jobs.flags(folder, folder, variant, None, wanted, needed)


@pytest.fixture
def host(tmp_path, monkeypatch, capsys):
    """host(scene text, variant, rays, **parameters): the array made on the processor, and the events by name."""
    from renderers.opencl.cuda import compiler, device, session

    compiling = builder.find_compiler("c++")
    if compiling is None:
        pytest.skip(builder.missing("c++"))
    driver = cuda_on_host.Driver(real)
    for module in (session, device):
        monkeypatch.setattr(module, "driver", driver)
    (tmp_path / "made").mkdir()
    monkeypatch.setattr(compiler, "compile_source", cuda_on_host.compile_source(tmp_path / "made", compiling))
    monkeypatch.setattr(run, "sessions", {})

    def render(source, variant="cuda-cpp", rays=None, **parameters):
        job = worker.Job(flags(tmp_path, source, variant, rays, **parameters))
        method.check(job)
        run.run(job, session.Session)
        said = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
        name = next(event["file"] for event in said if event["event"] == "output")
        return np.load(Path(job.out) / name), {event["event"]: event for event in said}

    render.driver = driver
    return render


@pytest.mark.parametrize(
    ("name", "more"),
    [
        ("spheres", {"scene_memory": "constant", "gpu_wait": "block"}),
        ("spheres", {"scene_memory": "shared", "total_threads": 24}),
        ("media", {"accel": "bvh"}),
        ("adaptive", {"scene_memory": "global"}),
        ("mix: soft shadows and gloss through a lens", {"cutoff": 0.01}),
    ],
)
def test_the_picture_on_the_processor(bench, host, tmp_path, name, more):
    """Host, arguments and CUDA C++ make the picture of the C++."""
    source, parameters = features(tmp_path)[name]
    mine, said = host(source, **parameters, **more)
    right = bench.result("cpp", source, **SMALL, **parameters, **{k: v for k, v in more.items() if k == "cutoff"})
    np.testing.assert_allclose(mine, right.array, rtol=0, atol=1e-9)
    assert {kind: said["rays"][kind] for kind in right.said.rays} == right.said.rays
    used = said["used"]["methods"]
    assert used["scene_memory"] == more.get("scene_memory", used["scene_memory"]) and used["registers"] == 40
    assert said["frame"]["parts"]["kernel"] > 0 and said["device"]["compute_capability"] == [9, 0]
    asleep = int(real.CUctx_flags.CU_CTX_SCHED_BLOCKING_SYNC)
    assert host.driver.flags == (asleep if more.get("gpu_wait") == "block" else 0)
    if "total_threads" in more:
        assert used["total_threads"] == 24


def test_rays_on_the_processor(bench, host, tmp_path):
    source = features(tmp_path)["mix: glass mesh and solid in water"][0]
    rays = random_rays(np.random.default_rng(4), 30)
    mine, _ = host(source, rays=rays)
    np.testing.assert_allclose(mine, bench.hits("cpp", source, rays), rtol=0, atol=1e-9)


def test_the_index_fault_on_the_processor(bench, host, tmp_path):
    """Each block has its colours from other rows, so the picture is wrong, and in blocks."""
    job = {"width": 16, "height": 8, "block_width": 4, "block_height": 4, "depth": 0}
    mine, said = host(comparison(spheres=6), "cuda-cpp-index-fault", **job)
    right = bench.result("cpp", comparison(spheres=6), width=16, height=8, depth=0).array
    assert said["used"]["methods"]["scene_memory"] == "shared"
    np.testing.assert_allclose(mine[:4, :4], right[:4, :4], rtol=0, atol=1e-9)
    assert not np.allclose(mine, right)


def test_what_a_device_refuses(host, monkeypatch, capsys):
    refused = {
        "no CUDA device 7; there are: 0 Host": {"device": "7"},
        'no CUDA device "other"; there are: 0 Host': {"device": "other"},
        "block 64x32: a block of Host has at most 1024 threads": {"block_width": 64, "block_height": 32},
        "scene_memory shared: the scene takes": {"scene_memory": "shared", "accel": "none"},
    }
    for reason, parameters in refused.items():
        with pytest.raises(SystemExit) as refusal:
            host(comparison(spheres=2000), **parameters)
        assert refusal.value.code == worker.UNSUPPORTED and reason in capsys.readouterr().out.replace('\\"', '"')


def test_without_a_driver(tmp_path, capsys):
    from renderers.opencl.cuda import session

    try:
        real.cuInit(0)
        pytest.skip("there is a driver")
    except RuntimeError:
        pass
    with pytest.raises(SystemExit) as refusal:
        run.run(worker.Job(flags(tmp_path, comparison(spheres=1))), session.Session)
    assert refusal.value.code == worker.UNSUPPORTED and "no CUDA device" in capsys.readouterr().out


def test_the_simulator_is_of_numba_alone(known, monkeypatch):
    monkeypatch.setenv(cuda.SIMULATOR, "1")
    monkeypatch.setattr(cuda, "devices", lambda: 0)
    assert known["numba-cuda"].simulated and not known["cuda-cpp"].simulated
    assert known["cuda-cpp"].unavailable == "no CUDA device"


@pytest.fixture
def inspect(tmp_path, capsys):
    """inspect(scene text, target, **parameters): what NVRTC says of the kernels of a job, by their names."""
    from renderers.opencl.cuda import inspect as inspector

    def ask(source, *targets, **parameters):
        told = flags(tmp_path, source, block_width=16, block_height=16, **parameters)
        try:
            inspector.main([*told, "--targets=" + ",".join(targets or ("sm_90",))])
        except SystemExit:
            reason = capsys.readouterr().out
            if INSTALL in reason:
                pytest.skip(INSTALL)
            raise AssertionError(reason) from None
        return [json.loads(line) for line in capsys.readouterr().out.splitlines()]

    return ask


@pytest.mark.parametrize("memory", ["global", "constant", "shared"])
def test_the_mirrors_spill_nothing_in_any_memory(inspect, memory):
    """In float32 without an instruction of float64, for three GPUs."""
    targets = "sm_75", "sm_90", "sm_100"
    kernels = inspect(comparison(), *targets, depth=10, precision="float32", scene_memory=memory)
    assert [(kernel["name"], kernel["target"]) for kernel in kernels] == [("render_pixels", name) for name in targets]
    for kernel in kernels:
        assert kernel["registers"] <= 96 and kernel["spill_store_bytes"] == kernel["spill_load_bytes"] == 0
        assert kernel["float64_instructions"] == kernel["local_bytes"] == 0 < kernel["occupancy"]
        assert (kernel["constant_bytes"] > 0) == (memory == "constant")
        assert (kernel["shared_bytes"] > 2048) == (memory == "shared") and kernel["shared_bytes"] >= 2048


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_nothing_is_contracted_unless_the_job_asks_for_it(inspect, precision):
    matte = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,5)\nLIGHT (3,4,5) (1,1,1) 0\n"
    matte += "SPHERE (0,0,0) 1 (0.5,0.4,0.3) 0 1 (0,0,0) 1 1\n"
    matte += "BOX (1,0,0) (1,0,0) (0,1,0) (0,0,1) (0.5,0.4,0.3) 0 1 (0,0,0) 1 1\n"
    (strict,), (contract,) = (
        inspect(matte, depth=0, precision=precision, floating_point=name) for name in ("strict", "contract")
    )
    assert strict["contracted"] == 0 < contract["contracted"]
    assert (strict["float64_instructions"] > 0) == (precision == "float64")


def test_a_cap_on_registers_is_kept(inspect):
    (kernel,) = inspect(comparison(), precision="float64", depth=10, max_registers=64)
    assert kernel["registers"] <= 64 and kernel["spill_store_bytes"] > 0


def test_a_compiler_that_refuses(tmp_path, capsys):
    from renderers.opencl.cuda import compiler

    for source, target, reason in (
        ("__device__ int f() { return no_such; }", "sm_90", "no_such"),
        ("", "sm_10", "NVRTC, for sm_10"),
    ):
        with pytest.raises(SystemExit) as refusal:
            compiler.compile_source(source, target, "strict")
        said = capsys.readouterr().out
        if INSTALL in said:
            pytest.skip(INSTALL)
        assert refusal.value.code == worker.UNSUPPORTED and reason in said


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["mix: soft shadows and gloss through a lens", "adaptive", "csg mesh", "mix: all of it"]
)
def test_no_feature_brings_float64_into_float32(inspect, tmp_path, name):
    source, parameters = features(tmp_path)[name]
    kernels = inspect(source, precision="float32", **parameters)
    assert {kernel["name"] for kernel in kernels} >= {"render_pixels"}
    assert not any(kernel["float64_instructions"] for kernel in kernels)


@pytest.mark.parametrize(
    ("target", "threads", "registers", "shared", "share"),
    [  # worked out by hand from the rules of NVIDIA's calculator
        ("sm_90", 256, 32, 0, 1.0),
        ("sm_90", 256, 33, 0, 0.75),
        ("sm_90", 32, 16, 0, 0.5),
        ("sm_90", 1024, 16, 120 * 1024, 0.5),
        ("sm_75", 96, 16, 0, 30 / 32),
        ("sm_86", 256, 32, 48 * 1024, 16 / 48),
        ("sm_35", 256, 32, 0, None),
    ],
)
def test_occupancy(target, threads, registers, shared, share):
    assert occupancy(target, threads, registers, shared) == share
