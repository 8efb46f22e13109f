from dataclasses import replace

import pytest

from harness.renderer.parameters import Parameters
from harness.scene import text, warnings
from harness.scene.methods import doubts

PLAIN = """CAMERA (0,0,0) (1,0,0) (0,1,0) 4
LIGHT (1,2,3) (1,1,1) 0
SPHERE (0,0,0) 1 (1,1,1) 0.5 20 (0,0,0) 9 1
"""
SOFT, ROUGH = PLAIN.replace("(1,1,1) 0\n", "(1,1,1) 0.5\n"), PLAIN.replace("9 1\n", "9 1 0.25\n")
MATT = ROUGH.replace("0.5 20", "0 20")  # a roughness, and nothing that it could be of
JOB = Parameters(depth=3, shadows=True)


@pytest.mark.parametrize(
    ("source", "values", "expected"),
    [
        (PLAIN, {}, None),
        (PLAIN, {"glossy_rays": 2}, "glossy_rays does nothing"),
        (MATT, {"glossy_rays": 2}, "glossy_rays does nothing"),
        (MATT, {}, None),
        (ROUGH, {"glossy_rays": 2}, None),
        (ROUGH, {}, "rendered as perfect mirrors"),
        (ROUGH, {"depth": 0}, None),
        (PLAIN, {"feelers": 2}, "feelers does nothing"),
        (SOFT, {"feelers": 2}, None),
        (SOFT, {}, "rendered as points"),
        (SOFT, {"shadows": False}, None),
    ],
)
def test_what_does_nothing_and_what_is_left_out(source, values, expected):
    found = doubts(text.read(source, "scene.txt"), [replace(JOB, **values)])
    assert len(found) == bool(expected) and all(expected in what for what, _ in found)


def test_what_one_of_the_pictures_has_is_not_left_out():
    scene = text.read(ROUGH, "scene.txt")
    assert not doubts(scene, [JOB, replace(JOB, glossy_rays=1)])
    assert not doubts(scene, [JOB], free={"glossy_rays"}) and not doubts(scene, [])


def test_a_warning_names_the_file_and_the_remedy():
    (warning,) = warnings(text.read(PLAIN, "scene.txt"), [replace(JOB, glossy_rays=1)])
    assert warning.startswith("scene.txt: glossy_rays does nothing") and "roughness above 0" in warning
