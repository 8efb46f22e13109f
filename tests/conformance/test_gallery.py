"""float32 is right wherever the gallery is looked at: every scene, at odd sizes, by every compiled renderer."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.judge import judge, reference
from harness.renderer import registry
from harness.renderer.parameters import Parameters
from harness.scene import load
from harness.scene.flatten import flatten
from harness.scene.needs import needs

SCENES = Path(__file__).parents[2] / "experiments" / "scenes" / "gallery"
SEED = 23
KNOWN = registry.entries()
WAYS = {  # of compiled renderers; called so that the plan of tests of a part of all variants does not take them
    f"{name}, vector {vector}": (name, vector)
    for name in ("cpp", "cpp-threads", "numba", "numba-parallel")
    for vector in KNOWN[name].methods.get("vector", ("off",))
    if vector != "auto"  # which takes one of the two: test_auto_lanes.py
}
# As the gallery is shown, with fewer samples.
JOBS = {
    "csg": {"depth": 6},
    "edges": {"depth": 6, "sampler": "adaptive"},
    "focus": {"depth": 2, "sampler": "jittered", "samples": 2, "lens_radius": 0.18, "focal_distance": 4.2},
    "glossy": {"depth": 4, "sampler": "jittered", "samples": 2, "glossy_rays": 2},
    "mesh": {"depth": 6},
    "mirrors-and-glass": {"depth": 8},
    "shadows": {"depth": 2, "sampler": "jittered", "samples": 2, "feelers": 2},
    "two-lights": {"depth": 6},
}
ODD = 2 * np.random.default_rng(SEED).integers(8, 180, (7, 2)) + 1
SIZES = [(320, 240), *map(tuple, ODD.tolist())]
# The rim of the lens of csg.txt: here it is 15 to 16 u thick, u of float32.
RIM = {"width": 320, "height": 240, "region": (190, 148, 199, 155), "depth": 6, "shadows": True}


@pytest.fixture(scope="module")
def references(bench):
    """The reference of a scene and size in float64: all are judged by that of `cpp`, itself included, whose float64
    others confirm (test_agreement.py)."""
    made = {}

    def find(name, wanted):
        key = name, wanted.width, wanted.height
        if key not in made:
            scene = load(SCENES / f"{name}.txt")
            needed = needs(scene, wanted)
            job = replace(wanted, vector="off", kernel="general", threads=1)
            made[key] = bench.reference(bench.entry("cpp"), flatten(scene), job, needed)
            assert isinstance(made[key], reference.Reference), made[key]
        return made[key]

    return find


@pytest.mark.slow
@pytest.mark.parametrize("size", SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", JOBS)
def test_float32_is_right(bench, references, name, way, size):
    print("seed", SEED)
    variant, vector = WAYS[way]
    entry, scene = bench.entry(variant), load(SCENES / f"{name}.txt")
    wanted = Parameters(
        width=size[0], height=size[1], shadows=True, seed=1, precision="float32", vector=vector,
        threads=entry.threads(), kernel="general", **JOBS[name],
    )  # fmt: skip
    result = bench.run(entry, flatten(scene), wanted, needs(scene, wanted))
    if result.status == "unsupported":
        pytest.skip(result.reason)
    assert result.status == "ok", (result.status, result.reason, result.stderr)
    verdict = judge.judge(result.array, references(name, wanted), "float32")
    print(name, way, size, verdict)
    assert verdict.wrong is None, verdict.wrong
    assert verdict.max_outside > 1e-9, "float32 that agrees to 1e-9 was computed in float64"


def test_the_rim_of_a_lens(bench, serial):
    """CSG-4: what is thinner than 16 u is not there in float32, nor in float64 where the job asks for the same."""
    scene = load(SCENES / "csg.txt")
    plain = bench.picture(serial, scene, **RIM)
    merged = bench.picture(serial, scene, **RIM, sliver=2.0**-20)
    off = np.abs(merged - plain).max(axis=-1)
    assert np.argwhere(off > 1e-3).tolist() == [[3, 5]] and off.max() == pytest.approx(0.206, abs=1e-3)
    if "float32" in bench.known[serial].methods.get("precision", ()):
        rough = bench.picture(serial, scene, **RIM, precision="float32")
        np.testing.assert_allclose(rough, merged, rtol=0, atol=1e-4)


def test_a_sliver_is_thinner_than_the_job_says(bench, serial):
    """Slabs of 0.9 and 1.1 times the limit, AND of two boxes with edges of 8, at right angles and aslant."""
    sliver, size = 2.0**-20, 8
    eye = np.array([0.3, 0.4, 5])
    towards = np.array([[0, 0, -1], [0.3, -0.2, -1], [-0.5, 0.4, -1]])
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    rays = np.hstack([np.tile(eye, (3, 1)), towards])
    for thick, seen in ((0.9, False), (1.1, True)):
        low = thick * sliver * size
        solid = f"BOX (-4,-4,-2) (8,0,0) (0,8,0) (0,0,2)\n  BOX (-4,-4,{-low:.17g}) (8,0,0) (0,8,0) (0,0,2)"
        scene = f"CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,5)\nAND\n  {solid}\nEND\n(1,1,1) 0 1 (0,0,0) 1 1\n"
        assert np.isfinite(bench.hits(serial, scene, rays, sliver=sliver)[:, 0]).tolist() == [seen] * 3
        assert np.isfinite(bench.hits(serial, scene, rays)[:, 0]).all()
