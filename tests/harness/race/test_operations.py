"""Floating-point operations: those of a sphere that is missed by hand, and the picture stays what it is."""

import json

import numpy as np
import pytest
from compilers import needs_compiler
from feature_scenes import features
from fixtures import a_copy

from harness.plan.plan import Cell
from harness.race import counting
from harness.race.host import ThisHost
from harness.renderer import events
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.needs import needs

STAGE = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,5)\nLIGHT (3,4,5) (1,1,1) 0\n"
MISSED = 8, 8  # sums and products: 3 + 2 + 2 and 3 + 3 of f, f·d and f·f, 1 and 2 of (1 - 64 u) f·f - b² (NOTES.md)


def counted(entry, source, cache, **parameters):
    scene, wanted = text.read(source, "scene of the test"), Parameters(**{"width": 16, "height": 16, **parameters})
    rest = {"processes": 1, "timeout": 300.0, "point": {}, "objects": 1, "lights": 1}
    cell = Cell("k", entry, "scene", "version", wanted, needs(scene, wanted), **rest)
    return counting.operations(cell, flatten(scene), ThisHost(), cache)


def spheres(number):
    """So many spheres beside the view, each in general position."""
    return "".join(f"SPHERE (9{n}.3,{n}.7,-{n}.1) 1.1 (0.5,0.4,0.3) 0 1 (0,0,0) 1 1\n" for n in range(number))


@needs_compiler("c++")
@pytest.mark.parametrize("precision", ["float64", "float32"])
@pytest.mark.parametrize("vector", ["off", "on"])
def test_a_missed_sphere_takes_what_its_formula_has(known, tmp_path, precision, vector):
    method = {"depth": 0, "accel": "none", "precision": precision, "vector": vector, "threads": 2}
    few, many = (counted(known["cpp-threads"], STAGE + spheres(n), tmp_path, **method) for n in (2, 5))
    assert (many["sums"] - few["sums"], many["products"] - few["products"]) == tuple(3 * n * 16 * 16 for n in MISSED)
    assert all(many[name] == few[name] for name in ("divisions", "roots", "functions"))


def test_a_renderer_without_such_a_build_has_none(known, tmp_path):
    assert counted(known["python"], STAGE + spheres(1), tmp_path) is None


@needs_compiler("c++")
def test_a_build_that_fails_or_says_nothing_has_a_reason(known, tmp_path):
    broken = a_copy(known, "cpp", tmp_path / "broken", "job/counted.hpp", "struct Operations {", "struct {")
    found = counted(broken, STAGE + spheres(1), tmp_path)
    assert found["unavailable"].startswith("failed: ") and "counted.hpp" in found["unavailable"]
    silent = a_copy(known, "cpp", tmp_path / "silent", "renderer.toml", '["-DCOUNT_OPERATIONS"]', '["-DNOTHING"]')
    found = counted(silent, STAGE + spheres(1), tmp_path)
    assert found == {"unavailable": "the build that counts reported no operations"}


@pytest.mark.slow
@needs_compiler("c++")
def test_pictures_of_all_features_have_the_same_bytes(known, tmp_path):
    told = known["cpp"].renderer.manifest
    for name, (source, more) in features(tmp_path).items():
        scene = text.read(source, "scene of the test")
        wanted = Parameters(**{"width": 24, "height": 18, "kernel": "general", "threads": 1, **more})
        pictures = []
        for options in ((), told.operations.options):
            entry = counting.under(known["cpp"], options, {}, [])
            result = ThisHost().run(entry, flatten(scene), wanted, needs(scene, wanted), timeout=600, cache=tmp_path)
            assert result.status == "ok", (name, result.reason)
            pictures.append(result.array)
        np.testing.assert_array_equal(*pictures, err_msg=name)
        assert result.said.operations["products"] > 0, name


@pytest.mark.parametrize("value", [-1, 0.5, None, "1", True, 2**63])
def test_an_operation_count_is_a_whole_number(value):
    said = events.Said()
    rest = ", ".join(f'"{name}": 1' for name in events.OPERATIONS[1:])
    events.take(said, f'{{"event": "operations", "sums": {json.dumps(value)}, {rest}}}'.encode(), 1)
    assert said.operations is None and said.faults
