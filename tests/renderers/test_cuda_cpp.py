"""cuda-cpp without a GPU: host and kernel on the processor, what compilers say of the kernel, and what it refuses."""

import json

import cuda_on_host
import numpy as np
import pytest
import rendered_here
from feature_scenes import features
from random_scenes import random_rays
from rendered_here import SMALL, flags

from harness.renderer import builder
from harness.scene.generate.comparison import comparison
from harness.stress.geometry.cracks import make_wall
from harness.system import cuda
from renderers import worker
from renderers.opencl import method, run
from renderers.opencl.cuda.occupancy import occupancy

INSTALL = "pip install 'rayrace[cuda]'"
real = pytest.importorskip("cuda.bindings.driver", reason=INSTALL)


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
    monkeypatch.setattr(compiler, "version", lambda: "unavailable: the kernel is compiled for the processor")
    monkeypatch.setattr(run, "sessions", {})

    def render(source, variant="cuda-cpp", rays=None, **parameters):
        return rendered_here.render(tmp_path, capsys, session.Session, source, variant, rays, **parameters)

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


STREAMED = {
    "a shape of each kind, and a solid": ("mix: all of it", {}),
    "a stack, of glass": ("media", {}),
    "a chain, and fewer threads than pixels": ("spheres", {"total_threads": 24, "cutoff": 0.01}),
    "float32": ("mix: glass, mirrors, shadows", {"precision": "float32"}),
}


@pytest.mark.parametrize("case", STREAMED)
def test_a_scene_larger_than_shared_memory_on_the_processor(host, monkeypatch, tmp_path, case):
    """Tile by tile the picture and the counts are, to the last bit, those from global memory."""
    name, more = STREAMED[case]
    source, parameters = features(tmp_path)[name]
    host.driver.device = {**cuda_on_host.DEVICE, "MAX_SHARED_MEMORY_PER_BLOCK": 0}
    monkeypatch.setattr(method, "TILE", 600)
    job = {**parameters, "accel": "none", "sampler": "one", **more}
    right, direct = host(source, **job, scene_memory="global")
    mine, said = host(source, **job, scene_memory="shared")
    used = said["used"]["methods"]
    assert used["scene_memory"] == "shared" and used["streamed"] and not direct["used"]["methods"]["streamed"]
    assert mine.tobytes() == right.tobytes() and said["rays"] == direct["rays"]


def test_rays_on_the_processor(bench, host, tmp_path):
    source = features(tmp_path)["mix: glass mesh and solid in water"][0]
    rays = random_rays(np.random.default_rng(4), 30)
    mine, _ = host(source, rays=rays)
    np.testing.assert_allclose(mine, bench.hits("cpp", source, rays), rtol=0, atol=1e-9)


@pytest.mark.parametrize("memory", ["global", "shared"])
@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_no_ray_passes_between_polygons_on_the_processor(host, precision, memory):
    """POL-2, POL-4: rays from inside a closed wall at its edges and vertices."""
    rng = np.random.default_rng(20261128)
    trial = make_wall(3.0, precision, rng)
    rays = trial.rays[rng.permutation(len(trial.rays))[:1500]]
    job = {"precision": precision, "scene_memory": memory}
    hits, _ = host(trial.scene, rays=rays, **job)
    naive, _ = host(trial.scene, rays=rays, triangle="moller-trumbore", **job)
    assert np.isfinite(hits[:, 0]).all()
    assert np.isinf(naive[:, 0]).mean() > 0.01


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
        "scene_memory shared: the scene takes": {"scene_memory": "shared", "accel": "bvh"},
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
        run.run(worker.Job(flags(tmp_path, comparison(spheres=1), "cuda-cpp")), session.Session)
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
        told = flags(tmp_path, source, "cuda-cpp", block_width=16, block_height=16, **parameters)
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
def test_tiles_spill_nothing(inspect, precision):
    """A scene of 64 KiB and more takes shared memory for one tile, whatever its size."""
    targets = "sm_75", "sm_90", "sm_100"
    kernels = inspect(comparison(spheres=2000), *targets, depth=10, precision=precision, scene_memory="shared")
    assert [kernel["target"] for kernel in kernels] == [*targets]
    for kernel in kernels:
        assert kernel["shared_bytes"] == 8 * 256 + method.TILE and kernel["constant_bytes"] == 0
        assert kernel["spill_store_bytes"] == kernel["spill_load_bytes"] == kernel["local_bytes"] == 0
        assert (kernel["float64_instructions"] == 0) == (precision == "float32")


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


@pytest.mark.slow
def test_nor_do_tiles_of_every_shape(inspect, tmp_path, monkeypatch):
    from renderers.opencl.cuda import inspect as inspector

    monkeypatch.setattr(inspector, "SHARED_BYTES", 0)
    source, parameters = features(tmp_path)["mix: all of it"]
    more = {"precision": "float32", "scene_memory": "shared", "accel": "none", "sampler": "one"}
    (kernel,) = inspect(source, **{**parameters, **more})
    assert kernel["shared_bytes"] == 8 * 256 + method.TILE and kernel["float64_instructions"] == 0


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
