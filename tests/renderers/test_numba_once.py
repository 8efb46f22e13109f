"""LLVM optimises a kernel of Numba once, and not each of its functions with all that they call."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from harness.renderer import job
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.needs import needs

pytest.importorskip("numba")
SCENE = """
CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,4)
AMBIENT (0.4,0.5,0.6)
LIGHT (3,4,5) (1,0.9,0.8) 0
SPHERE (0.2,0.6,-1) 0.8 (0.6,0.5,0.4) 0.5 1 (0,0,0) 4 1
SPHERE (-0.9,0.1,-1.3) 0.7 (0.3,0.5,0.4) 0.7 1 (0,0,0) 4 1
"""
NOTED = """
import sys
from numba.core.codegen import CPUCodeLibrary, JITCPUCodegen
from renderers import worker
from renderers.numba.main import main

optimise, add = CPUCodeLibrary._optimize_final_module, JITCPUCodegen._add_module

def noted(library):
    print("optimised", library.name, file=sys.stderr)
    optimise(library)

def noted_module(codegen, module):
    print("compiled", module.name, file=sys.stderr)
    add(codegen, module)

CPUCodeLibrary._optimize_final_module, JITCPUCodegen._add_module = noted, noted_module
worker.serve(main, sys.argv[1:])
"""


def render(folder, variant, **methods):
    """The picture, and what LLVM optimised and made machine code of, each in order."""
    scene = text.read(SCENE)
    wanted = Parameters(width=9, height=7, depth=2, threads=2, **methods)
    needed = needs(scene, wanted)
    job.write(folder / "job", flatten(scene), wanted, needed)
    flags = job.flags(folder / "job", folder, variant, None, wanted, needed)
    done = subprocess.run(
        [sys.executable, "-c", NOTED, *flags],
        env={**os.environ, "PYTHONPATH": os.getcwd()},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert any(json.loads(line)["event"] == "used" for line in done.stdout.splitlines())
    told = [line.split() for line in done.stderr.splitlines()]
    return np.load(folder / "image.npy"), *(
        [name for what, name in told if what == w] for w in ("optimised", "compiled")
    )


@pytest.mark.whole
@pytest.mark.slow
@pytest.mark.parametrize(
    "variant, methods, entries",
    [
        ("numba", {}, ["render_rows"]),
        ("numba", {"vector": "on"}, ["render_tiles"]),
        ("numba", {"walk": "recursion"}, ["render_rows"]),
        ("numba-parallel", {}, ["render_rows_parallel"]),
    ],
)
def test_only_the_entry_point_is_optimised(tmp_path, bench, variant, methods, entries):
    picture, optimised, compiled = render(tmp_path, variant, **methods)
    assert optimised == compiled == ["nrt", *entries]
    expected = bench.picture("python", SCENE, width=9, height=7, depth=2)
    assert np.abs(picture - expected).max() < 1e-9 and np.ptp(picture) > 0.1
