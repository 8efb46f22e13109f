from dataclasses import replace

import pytest

from harness.scene.model import Air, Box, Camera, Ellipsoid, Light, Material, Polygon, Scene, Sphere
from harness.scene.needs import needs, shapes

CAMERA = Camera((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
LIGHT = Light((5, 5, 5), (1, 1, 1), 0.0)
BLACK, WHITE, GREY = (0.0,) * 3, (1.0,) * 3, (0.5,) * 3
AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
MATT = Material(WHITE, 0.0, 1.0, BLACK, 1e6, 1.0)
MIRROR = Material(BLACK, 1.0, 30.0, BLACK, 1e6, 1.0)
GLASS = replace(MIRROR, attenuation=WHITE, eps_r=2.25)
TINTED = replace(GLASS, attenuation=GREY)
REDLESS = replace(GLASS, attenuation=(0.0, 1.0, 1.0))


def scene(*materials, lights=(LIGHT,), **given):
    return Scene(CAMERA, tuple(Sphere(m, (0, 0, 0), 1.0) for m in materials), lights, **given)


@pytest.mark.parametrize(
    ("given", "depth", "shadows", "expected"),
    [
        (scene(), 5, True, ""),
        (scene(MATT), 0, False, "diffuse sphere"),
        (scene(MATT), 5, False, "diffuse sphere"),
        (scene(MATT), 0, True, "diffuse shadows sphere"),
        (scene(MATT, lights=()), 0, True, "sphere"),
        (scene(MATT, lights=(), ambient=GREY), 0, True, "ambient sphere"),
        (scene(MIRROR), 0, False, "phong sphere"),
        (scene(MIRROR), 1, False, "phong reflection sphere"),
        (scene(MIRROR, lights=()), 1, False, "reflection sphere"),
        (scene(MIRROR, MATT), 1, True, "diffuse phong reflection shadows sphere"),
        (scene(GLASS), 0, False, "phong sphere"),
        (scene(GLASS), 1, False, "phong reflection sphere transmission"),
        (scene(TINTED), 0, False, "phong sphere"),
        (scene(TINTED), 1, False, "attenuation phong reflection sphere transmission"),
        (scene(REDLESS), 1, False, "attenuation phong reflection sphere transmission"),
        (scene(replace(TINTED, k_s=0.0)), 1, False, "sphere"),
        (scene(replace(MATT, attenuation=GREY)), 1, False, "diffuse sphere"),
        (scene(MATT, air=Air(attenuation=GREY)), 0, False, "attenuation diffuse sphere"),
        (scene(MATT, air=Air(eps_r=2.0)), 0, False, "diffuse sphere"),
        (scene(MATT, background=GREY), 0, False, "diffuse sphere"),
    ],
)
def test_needs(given, depth, shadows, expected):
    assert needs(given, depth, shadows) == tuple(expected.split())


def test_shapes():
    things = (
        Box(MATT, (0, 0, 0), AXES),
        Polygon(MATT, AXES),
        Ellipsoid(MATT, (0, 0, 0), AXES),
        Ellipsoid(MATT, (0, 0, 0), AXES),
    )
    assert shapes(Scene(CAMERA, things)) == {"box", "polygon", "ellipsoid"}
    assert needs(Scene(CAMERA, things), 0, False) == ("box", "ellipsoid", "polygon")
