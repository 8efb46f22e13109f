from dataclasses import replace

import numpy as np
import pytest

from harness.renderer.parameters import Parameters
from harness.scene.model import (
    Air,
    Box,
    Camera,
    Csg,
    Ellipsoid,
    Light,
    Material,
    Mesh,
    Operator,
    Polygon,
    Scene,
    Sphere,
)
from harness.scene.needs import FAR_FLOAT32, LENS_CUT, farthest, needs, shapes

CAMERA = Camera((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
LIGHT = Light((5, 5, 5), (1, 1, 1), 0.0)
BLACK, WHITE, GREY = (0.0,) * 3, (1.0,) * 3, (0.5,) * 3
AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
MATT = Material(WHITE, 0.0, 1.0, BLACK, 1e6, 1.0)
MIRROR = Material(BLACK, 1.0, 30.0, BLACK, 1e6, 1.0)
BRUSHED = replace(MIRROR, roughness=0.25)
GLASS = replace(MIRROR, attenuation=WHITE, eps_r=2.25)
TINTED = replace(GLASS, attenuation=GREY)
REDLESS = replace(GLASS, attenuation=(0.0, 1.0, 1.0))


LAMP = replace(LIGHT, radius=0.5)
MURKY = replace(TINTED, k_s=0.0)  # clear, but nothing gets in


def scene(*materials, lights=(LIGHT,), eye=(0.0, 0.0, 5.0), **given):
    """Spheres of radius 1, four apart along x, from the origin."""
    camera = replace(CAMERA, e=eye)
    spheres = tuple(Sphere(m, (4.0 * i, 0.0, 0.0), 1.0) for i, m in enumerate(materials))
    return Scene(camera, spheres, lights, **given)


@pytest.mark.parametrize("precision", ["float32", "float64", "mp60"])
def test_lengths_beyond_float32(precision):
    """Of any part of the scene; no renderer supports them in float32 (NUM-6)."""
    near = scene(MATT)
    ball = Sphere(None, (0.0, -2e9, 0.0), 1.0)
    far = [
        scene(MATT, lights=(replace(LIGHT, position=(0.0, 2e9, 0.0)),)),
        scene(MATT, eye=(0.0, 0.0, -2e9)),
        replace(near, objects=(Sphere(MATT, (0.0, 0.0, 0.0), 2e9),)),
        replace(near, objects=(Csg(MATT, (ball, Operator.NOT)),)),
        replace(near, objects=(Polygon(MATT, ((0.0, 0.0, 0.0), (2e9, 0.0, 0.0), (0.0, 1.0, 0.0))),)),
    ]
    parameters = Parameters(precision=precision)
    assert FAR_FLOAT32 not in needs(near, parameters)
    assert farthest(near) == 5
    for one in far:
        assert (FAR_FLOAT32 in needs(one, parameters)) == (precision == "float32") and farthest(one) >= 2e9


@pytest.mark.parametrize(
    ("radius", "apart", "cut"),
    [(0.0, 0.0, False), (0.5, 0.0, True), (0.5, 0.4, True), (0.5, -0.4, True), (0.5, 0.6, False), (0.5, -0.6, False)],
)
@pytest.mark.parametrize("clear", [True, False])
def test_a_lens_partly_inside_glass(radius, apart, cut, clear):
    """The eye so far outside of a ball (apart > 0), whose surface lies along the axis of the view there."""
    material = Material((0.0, 0.0, 0.0), 1.0, 1.0, (1.0, 1.0, 1.0) if clear else (0.0, 0.0, 0.0), 2.25, 1.0)
    given = scene(material)
    eye = np.add(given.camera.centre, given.camera.e)
    ball = Sphere(material, tuple(eye + 10 * np.array(given.camera.u) / np.linalg.norm(given.camera.u)), 10 - apart)
    given = replace(given, objects=(ball,))
    assert (LENS_CUT in needs(given, Parameters(lens_radius=radius))) == (cut and clear)


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
        (scene(MURKY), 1, False, "sphere"),
        (scene(MURKY, eye=(0.0, 0.0, 0.5)), 0, False, "attenuation media sphere"),
        (scene(GLASS, eye=(0.0, 0.0, 0.5)), 0, False, "media phong sphere"),
        (scene(TINTED, eye=(0.0, 0.0, 0.5)), 0, False, "attenuation media phong sphere"),
        (scene(TINTED, eye=(0.0, 0.0, 1.0)), 0, False, "phong sphere"),  # on it is not in it
        (scene(replace(MATT, attenuation=GREY)), 1, False, "diffuse sphere"),
        (scene(MATT, air=Air(attenuation=GREY)), 0, False, "attenuation diffuse sphere"),
        (scene(MATT, air=Air(eps_r=2.0)), 0, False, "diffuse sphere"),
        (scene(MATT, background=GREY), 0, False, "diffuse sphere"),
    ],
)
def test_needs(given, depth, shadows, expected):
    assert needs(given, Parameters(depth=depth, shadows=shadows)) == tuple(expected.split())


@pytest.mark.parametrize(
    ("given", "parameters", "expected"),
    [
        (scene(MIRROR), {"depth": 1, "glossy_rays": 4}, "phong reflection sphere"),
        (scene(BRUSHED), {"depth": 1, "glossy_rays": 4}, "glossy phong reflection sphere"),
        (scene(BRUSHED), {"depth": 1}, "phong reflection sphere"),
        (scene(BRUSHED), {"depth": 0, "glossy_rays": 4}, "phong sphere"),
        (
            scene(replace(MATT, roughness=0.5), MIRROR),
            {"depth": 1, "glossy_rays": 4},
            "diffuse phong reflection sphere",
        ),
        (scene(MATT), {"depth": 1, "glossy_rays": 4}, "diffuse sphere"),
        (scene(MATT, lights=(LIGHT, LAMP)), {"shadows": True, "feelers": 1}, "diffuse shadows soft sphere"),
        (scene(MATT, lights=(LIGHT, LAMP)), {"shadows": True}, "diffuse shadows sphere"),
        (scene(MATT, lights=(LIGHT, LAMP)), {"feelers": 9}, "diffuse sphere"),
        (scene(MATT), {"shadows": True, "feelers": 9}, "diffuse shadows sphere"),
        (scene(lights=(LAMP,)), {"shadows": True, "feelers": 9}, ""),
        (scene(), {"sampler": "uniform"}, "supersampling"),
        (scene(), {"sampler": "jittered", "samples": 1}, "supersampling"),
        (scene(), {"sampler": "adaptive"}, "adaptive"),
        (scene(), {"sampler": "one", "samples": 9}, ""),
        (scene(), {"lens_radius": 0.1}, "lens"),
        (scene(TINTED), {"depth": 0, "lens_radius": 0.1}, "attenuation lens phong sphere"),
        (scene(MURKY), {"depth": 0, "lens_radius": 0.1}, "attenuation lens sphere"),
    ],
)
def test_needs_of_parameters(given, parameters, expected):
    assert needs(given, Parameters(**{"depth": 5, **parameters})) == tuple(expected.split())


def test_clear_things_without_an_inside_attenuate_nothing():
    polygon = Scene(CAMERA, (Polygon(TINTED, AXES),))
    assert needs(polygon, Parameters(depth=1)) == ("polygon", "reflection", "transmission")
    triangle = np.eye(3), np.array([[0, 1, 2]], np.int32)
    assert needs(Scene(CAMERA, (Mesh(TINTED, *triangle, False),)), Parameters(depth=1, lens_radius=1.0)) == (
        "lens", "mesh", "reflection", "transmission",
    )  # fmt: skip


def test_media_are_needed_if_solids_touch():
    glass, below = (
        Sphere(GLASS, (0.0, 0.0, 0.0), 1.0),
        Polygon(MATT, ((-9.0, -1.0, -9.0), (9.0, -1.0, 9.0), (0, -1.0, 9))),
    )
    above = Polygon(MATT, tuple((x, y - 0.5, z) for x, y, z in below.vertices))
    camera = replace(CAMERA, e=(0.0, 0.0, 5.0))
    expected = ("polygon", "reflection", "sphere", "transmission")
    assert needs(Scene(camera, (glass, above)), Parameters(depth=1)) == expected
    assert needs(Scene(camera, (glass, below)), Parameters(depth=1)) == ("contact", "media", *expected)
    tinted = replace(glass, material=TINTED)  # ranked, but nothing gets in
    assert needs(Scene(camera, (tinted, below)), Parameters(depth=0)) == ("contact", "media", "polygon", "sphere")


def test_shapes():
    things = (
        Box(MATT, (0, 0, 0), AXES),
        Polygon(MATT, AXES),
        Ellipsoid(MATT, (0, 0, 0), AXES),
        Ellipsoid(MATT, (9, 0, 0), AXES),
    )
    assert shapes(Scene(CAMERA, things)) == {"box", "polygon", "ellipsoid"}
    assert needs(Scene(CAMERA, things), Parameters(depth=0)) == ("box", "ellipsoid", "polygon")


def test_shapes_of_parts():
    ball, solid = Sphere(None, (0, 0, 0), 1.0), Mesh(None, np.eye(3), np.array([[0, 1, 2]]), True)
    assert shapes(Scene(CAMERA, (Csg(MATT, (ball,)),))) == {"csg"}
    assert shapes(Scene(CAMERA, (Csg(MATT, (ball, solid, Operator.AND)),))) == {"csg", "mesh"}
    assert shapes(Scene(CAMERA, (Csg(MATT, (ball,)), Sphere(MATT, (9, 9, 9), 1.0)))) == {"csg", "sphere"}
    assert shapes(Scene(CAMERA, (replace(solid, material=MATT),))) == {"mesh"}
