"""The phase `build` (renderers/README.md): said where a hierarchy is built, and by nobody else."""

import itertools

import pytest
from nightly import by_night

from harness.process import repetition
from harness.race import row
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.generate.generated import generated
from harness.scene.generate.icosphere import obj
from harness.scene.needs import needs

HAVE = ("python", "numba", "numba-parallel", "numba-cuda", "cpp", "cpp-threads")
SOLID = """CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,4)
LIGHT (3,4,5) (1,1,1) 0
AND MESH sphere.obj (0.1,0.2,-1) (13,29,31) 0.8 NOT SPHERE (0.5,0.5,-0.4) 0.5 END END (0.5,0.4,0.3) 0 1 (0,0,0) 1e6 1
"""


def phases(bench, entry, scene, tmp_path, **parameters):
    """Its phases, start and exit included."""
    size = 4 if entry.simulated else 24
    parameters = Parameters(width=size, height=size, depth=1, frames=1, threads=entry.threads(), **parameters)
    needed = needs(scene, parameters)
    parameters = bench.sharing(entry, parameters, needed)
    result = repetition.run(entry, flatten(scene), parameters, needed, cache=bench.caches / entry.variant.name)
    assert result.status == "ok", result.reason
    made = row.measured(result, tmp_path / "no.csv")
    assert not [text for text in made["warnings"] if "wall time" not in text]
    assert made["used"]["methods"]["accel"] == ("bvh" if "build" in _names(made["phases"]) else "none")
    return made["phases"]


def _names(told):
    return [name for name, _, _ in told]


def _seamless(told):
    return all(before[2] == after[1] for before, after in itertools.pairwise(told[1:-1]))


@pytest.fixture(params=by_night(HAVE, "numba-parallel", "cpp-threads"))
def entry(request, known):
    if known[request.param].unavailable:
        pytest.skip(known[request.param].unavailable)
    return known[request.param]


@pytest.mark.slow
def test_said_with_a_hierarchy_and_not_without(bench, entry, tmp_path):
    scene = generated("icosphere", size=1)
    built = phases(bench, entry, scene, tmp_path, accel="bvh")
    names = _names(built)
    assert names.index("load") + 1 == names.index("build") < names.index("render") and names.count("build") == 1
    assert names[names.index("build") + 1] in ("compile", "upload", "render")
    plain = phases(bench, entry, scene, tmp_path, accel="none")
    assert _names(plain) == [name for name in names if name != "build"]
    for told in (built, plain):
        assert _seamless(told)  # a phase begins where the one before it ended
        assert told[0][1] == 0 and sum(end - start for _, start, end in told) == pytest.approx(told[-1][2])


@pytest.mark.slow
def test_of_a_mesh_that_is_a_part(bench, entry, tmp_path):
    """Meshes in solids have hierarchies of their own."""
    (tmp_path / "sphere.obj").write_text(obj(1))
    scene = text.read(SOLID, tmp_path / "scene.txt")
    assert "build" in _names(phases(bench, entry, scene, tmp_path, accel="bvh"))
    assert "build" not in _names(phases(bench, entry, scene, tmp_path, accel="none"))
