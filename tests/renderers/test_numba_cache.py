"""Numba's cache on disk: its own key sees neither an edit of a module that the kernel calls nor a change of options."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from harness.renderer import job, registry
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.needs import needs

pytest.importorskip("numba")
RENDERERS = Path(__file__).parents[2] / "renderers"
SCENE = (
    "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,4)\nAMBIENT (1,1,1)\nSPHERE (0.2,0.6,-1) 0.8 (0.6,0.5,0.4) 0 1 (0,0,0) 4 1\n"
)
MIRRORS = """
CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,4)
AMBIENT (0.4,0.5,0.6)
SPHERE (0.2,0.6,-1) 0.8 (0.6,0.5,0.4) 0.5 1 (0,0,0) 4 1
SPHERE (-0.9,0.1,-1.3) 0.7 (0.3,0.5,0.4) 0.7 1 (0,0,0) 4 1
"""


@pytest.fixture
def render(tmp_path):
    """render(variant, precision, ..) with a copy of the renderers that may be edited: the picture, "cold" or "warm"."""
    shutil.copytree(RENDERERS, tmp_path / "renderers", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "neutral").mkdir()

    def run(variant="numba", precision="float64", source=SCENE, depth=0, **methods):
        scene = text.read(source)
        wanted = Parameters(width=9, height=9, depth=depth, precision=precision, threads=2, **methods)
        given = (*needs(scene, wanted), *wanted.carried(()))
        shutil.rmtree(tmp_path / "job", ignore_errors=True)
        job.write(tmp_path / "job", flatten(scene), wanted, given)
        flags = job.flags(tmp_path / "job", tmp_path, variant, tmp_path / "cache", wanted, given)
        done = subprocess.run(
            [sys.executable, "-m", "renderers.numba.main", *flags],
            cwd=tmp_path / "neutral",
            env={**os.environ, "PYTHONPATH": str(tmp_path)},
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr
        used = next(json.loads(line) for line in done.stdout.splitlines() if '"used"' in line)
        return np.load(tmp_path / "image.npy"), used["methods"]["compile_cache"]

    run.folder = tmp_path / "renderers" / "numba"
    return run


@pytest.mark.slow
def test_an_edit_of_any_module_is_seen(render):
    first, state = render()
    assert state == "cold"
    again, state = render()
    assert state == "warm" and np.array_equal(first, again)
    camera = render.folder / "camera.py"
    source = camera.read_text()
    edited = source.replace("u, v, e = row(camera, 1), row(camera, 2)", "u, v, e = row(camera, 2), row(camera, 1)")
    assert edited != source
    camera.write_text(edited)
    turned, state = render()
    assert state == "cold" and not np.array_equal(first, turned)
    camera.write_text(source)
    back, state = render()
    assert state == "warm" and np.array_equal(first, back)


@pytest.mark.slow
@pytest.mark.whole
@pytest.mark.parametrize("variant", ["numba", "numba-parallel"])
def test_a_function_that_calls_itself_is_kept(render, bench, variant):
    asked = {"variant": variant, "source": MIRRORS, "depth": 3, "walk": "recursion"}
    (first, cold), (again, warm) = render(**asked), render(**asked)
    assert (cold, warm) == ("cold", "warm") and np.array_equal(first, again)
    expected = bench.picture("python", MIRRORS, width=9, height=9, depth=3)
    assert np.abs(first - expected).max() < 1e-9 and np.ptp(first) > 0.01


@pytest.mark.slow
def test_variants_and_precisions_are_kept_apart(render):
    states = [render(variant)[1] for variant in 2 * ("numba", "numba-parallel")]
    assert states == ["cold", "cold", "warm", "warm"]
    picture, state = render("numba", "float32")
    assert state == "cold" and picture.dtype == np.float32


# Of a matte sphere in ambient light they change nothing.
IDLE = {
    **{"offset": "fixed", "triangle": "moller-trumbore", "slab": "plain", "merge": "none", "fresnel": "unclamped"},
    **{"phong": "unclamped", "glossy_weight": "study"},
}


@pytest.mark.slow
def test_methods_that_do_not_matter_share_one_kernel(render):
    first, state = render()
    assert state == "cold"
    for method, value in IDLE.items():
        other, state = render(**{method: value})
        assert state == "warm" and other.tobytes() == first.tobytes(), method
    assert render(sphere="stable")[1] == "cold"


OTHERS = {
    **{"floating_point": ("contract", "fast"), "sphere": ("textbook",), "vector": ("on",), "accel": ("bvh",)},
    **{"walk": ("stack",), "kernel": ("needed+lens", "needed+shadows")},
}


@pytest.mark.nightly("test_every_pair has each option with one cache by day; here Numba compiles 10 kernels")
@pytest.mark.slow
def test_options_are_kept_apart(render):
    """No process loads the code of one with another option, and the first finds its own again."""
    first, state = render()
    assert state == "cold"
    claimed = registry.entries()["numba"].methods
    for method, values in OTHERS.items():
        for value in values if method in claimed else ():
            other, state = render(**{method: value})
            assert state == "cold", (method, value)
            np.testing.assert_allclose(other, first, rtol=0, atol=1e-9)
            again, state = render(**{method: value})
            assert state == "warm" and again.tobytes() == other.tobytes(), (method, value)
    again, state = render()
    assert state == "warm" and again.tobytes() == first.tobytes()
