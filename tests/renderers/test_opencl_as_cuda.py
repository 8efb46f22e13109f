"""The kernel of opencl is CUDA C++ too: NVRTC compiles it, for GPUs that are not here."""

import re

import numpy as np
import pytest
from feature_scenes import features

from harness.renderer import job as jobs
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.generate.comparison import comparison
from harness.scene.needs import needs
from renderers import worker
from renderers.opencl import load, method, program

INSTALL = "no NVRTC: pip install 'rayrace[cuda]'"
nvrtc = pytest.importorskip("cuda.bindings.nvrtc", reason=INSTALL)
try:
    nvrtc.nvrtcVersion()
except RuntimeError:  # cuda-bindings without the library
    pytest.skip(INSTALL, allow_module_level=True)


@pytest.fixture
def ptx(tmp_path):
    """ptx(scene text, target, memory, **parameters): the kernel of the job as NVRTC makes it."""

    def compile(source, target, memory="global", **parameters):
        scene, wanted = text.read(source, "scene"), Parameters(width=64, height=64, **parameters)
        needed = needs(scene, wanted)
        jobs.write(tmp_path / "job", flatten(scene), wanted, needed)
        told = worker.Job(jobs.flags(tmp_path / "job", tmp_path, "opencl", None, wanted, needed))
        laid = load.Scene(told, np.dtype(told.precision).type)
        walk = method.walk_of(told, np.load(told.array("materials")))
        sizes = {"CROSSINGS": laid.crossings, "PARTS": laid.parts, "TREE": 0}
        sizes |= {"NUMBERS": laid.numbers.joined().size, "INTEGERS": laid.integers.joined().size}
        places = {f"MEMORY_{memory.upper()}": 1, f"WALK_{walk.name.upper()}": 1}
        return _ptx(program.source(program.names(told, **places, **sizes)), target)

    return compile


def _ptx(source, target):
    _, handle = nvrtc.nvrtcCreateProgram(source.encode(), b"kernel.cu", 0, [], [])
    options = [f"--gpu-architecture={target}".encode(), b"--fmad=false"]
    (status,) = nvrtc.nvrtcCompileProgram(handle, len(options), options)
    log = bytearray(nvrtc.nvrtcGetProgramLogSize(handle)[1])
    nvrtc.nvrtcGetProgramLog(handle, log)
    assert status == nvrtc.nvrtcResult.NVRTC_SUCCESS, log.decode()
    answer = bytearray(nvrtc.nvrtcGetPTXSize(handle)[1])
    nvrtc.nvrtcGetPTX(handle, answer)
    return answer.decode()


@pytest.mark.parametrize("memory", ["global", "constant", "shared"])
@pytest.mark.parametrize("target", ["compute_75", "compute_90", "compute_100"])
def test_the_mirrors_in_every_memory(ptx, target, memory):
    """In float32 without an instruction of float64."""
    found = ptx(comparison(), target, memory, depth=10, precision="float32")
    assert ".entry render_pixels" in found and f".target sm_{target[8:]}" in found
    assert not re.search(r"\.f64\b", found)


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_matte_shapes_fuse_nothing(ptx, precision):
    matte = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,5)\nLIGHT (3,4,5) (1,1,1) 0\n"
    matte += "SPHERE (0,0,0) 1 (0.5,0.4,0.3) 0 1 (0,0,0) 1 1\n"
    matte += "BOX (1,0,0) (1,0,0) (0,1,0) (0,0,1) (0.5,0.4,0.3) 0 1 (0,0,0) 1 1\n"
    assert not re.search(r"\bfma\.", ptx(matte, "compute_90", depth=0, precision=precision))


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["mix: soft shadows and gloss through a lens", "adaptive", "csg mesh", "mix: all of it"]
)
def test_features(ptx, tmp_path, name):
    source, parameters = features(tmp_path)[name]
    assert not re.search(r"\.f64\b", ptx(source, "compute_90", precision="float32", **parameters))
