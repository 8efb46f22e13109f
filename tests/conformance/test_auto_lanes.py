"""VEC-4: `vector` = `auto` makes, byte by byte, the picture of `on` or of `off`, says which, and refuses nothing."""

import numpy as np
import pytest
from random_scenes import random_scene
from tessellate import ball, obj

from harness.judge.hits import through_the_screen
from harness.renderer import registry
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.generate.generated import generated
from harness.scene.needs import needs, shapes

pytestmark = pytest.mark.slow
KNOWN = registry.entries()
AUTO = [name for name, entry in KNOWN.items() if "auto" in entry.methods.get("vector", ())]
ONE_CORE = [name for name in AUTO if KNOWN[name].variant.threads == 1]
SIZE = {"width": 70, "height": 41, "depth": 4}
GLASS = "SPHERE (0.1,0.2,0.3) 0.7 (0.4,0.5,0.3) 0.6 12 (0.9,0.8,0.9) 1.5 1\n"


def made(bench, variant, scene, vector, **parameters):
    """The Result of a picture, or of the first hits of 3000 rays."""
    entry = bench.entry(variant)
    wanted = Parameters(vector=vector, threads=entry.threads(), **{**SIZE, **parameters})
    needed, arrays = needs(scene, wanted), flatten(scene)
    if wanted.kind == "rays":
        needed, arrays = tuple(sorted(shapes(scene))), {**arrays, "rays": through_the_screen(scene, 3000, 8)}
    if entry.renderer.manifest.build:  # Numba has lanes in exact kernels alone
        wanted = bench.sharing(entry, wanted, needed)
    result = bench.run(entry, arrays, wanted, needed)
    assert result.status == "ok", (result.status, result.reason, result.stderr)
    return result


def taken(bench, variant, scene, **parameters):
    """What `auto` took, after its picture was compared with that of `on` or of `off`."""
    result = made(bench, variant, scene, "auto", **parameters)
    used = result.said.used["methods"]["vector"]
    plain = made(bench, variant, scene, used, **parameters)
    assert plain.said.used["methods"]["vector"] == used
    assert result.array.tobytes() == plain.array.tobytes()
    assert result.said.rays == plain.said.rays
    assert result.said.used["methods"] == plain.said.used["methods"]
    return used


@pytest.mark.parametrize("precision", ["float64", "float32"])
@pytest.mark.parametrize("variant", AUTO)
def test_takes_lanes_for_mirroring_spheres(bench, variant, precision):
    scene = generated("comparison", objects=24, lights=2)
    assert taken(bench, variant, scene, precision=precision, shadows=True) == "on"


@pytest.mark.parametrize(
    "parameters",
    [
        {"region": (30, 0, 37, 41)},  # too narrow
        {"walk": "stack", "accel": "none"},
        {"sphere": "textbook", "accel": "none"},
        {"accel": "bvh"},  # of few spheres
    ],
    ids=lambda parameters: next(iter(parameters)),
)
@pytest.mark.parametrize("variant", ONE_CORE)
def test_takes_one_ray_after_another_where_lanes_lack_something_or_lose(bench, variant, parameters):
    scene = generated("comparison", objects=12, lights=1)
    assert taken(bench, variant, scene, **parameters) == "off"


@pytest.mark.parametrize("variant", ONE_CORE)
def test_takes_lanes_for_glass_and_many_samples(bench, variant):
    scene = text.read(random_scene(np.random.default_rng(4), sphere=3, box=2) + GLASS, "scene of the test")
    assert taken(bench, variant, scene, sampler="jittered", samples=2, shadows=True) == "on"


@pytest.mark.parametrize("variant", ONE_CORE)
def test_first_hits_of_many_triangles(bench, variant, tmp_path):
    (tmp_path / "ball.obj").write_text(obj(*ball(3)))
    source = random_scene(np.random.default_rng(5), sphere=2)
    source += f'MESH "{tmp_path}/ball.obj" (0,0,0) (10,20,30) 1.5 (0.4,0.5,0.3) 0.6 12 (0,0,0) 1 1\n'
    used = taken(bench, variant, text.read(source, "scene of the test"), kind="rays", depth=0, width=3000, height=1)
    assert used == ("on" if registry.entries()[variant].renderer.manifest.name == "cpp" else "off")
