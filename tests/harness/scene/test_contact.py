"""Which scenes have clear solids that touch (MED-9), and which surface of several in one place is there (MED-7)."""

import numpy as np
import pytest
from random_scenes import words
from stage import turned
from tessellate import ball, obj

from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.contact import contact, precedence
from harness.scene.flatten import flatten
from harness.scene.media import media
from harness.scene.needs import needs

CAMERA = "CAMERA (0,0,90) (1,0,0) (0,1,0) (0,0,9)\n"
MATT = " (1,1,1) 1 1 (0,0,0) 1e6 1\n"
GLASS = " (0,0,0) 1 1 (1,1,1) 2.25 1\n"
WATER = " (0,0,0) 1 1 (1,1,1) 1.77 1\n"


def touches(content):
    scene = text.read(CAMERA + content)
    found = contact(scene)
    assert ("contact" in needs(scene, Parameters())) == found
    assert len(flatten(scene)["precedence"]) == (len(scene.objects) if found else 0)
    return found


def placed(rng):
    """A function from points of a frame in general position to words."""
    turn, away = turned(rng), rng.normal(size=3)
    return lambda *point: words(turn @ point + away), lambda *vector: words(turn @ vector)


@pytest.mark.parametrize("seed", range(5))
def test_what_touches(seed, tmp_path):
    print("seed", seed)
    rng = np.random.default_rng(seed)
    at, along = placed(rng)
    floor = f"POLYGON 4 {at(-5, 0, -5)} {at(5, 0, -5)} {at(5, 0, 5)} {at(-5, 0, 5)}{MATT}"
    box = f"BOX {at(0, 0, 0)} {along(1, 0, 0)} {along(0.2, 1, 0)} {along(0, 0, 1)}"
    beside = f"BOX {at(0, 0, 1)} {along(1, 0, 0)} {along(0.2, 1, 0)} {along(0, 0, 1)}"
    ellipsoid = f"ELLIPSOID {at(0, 0.5, 0)} {along(1, 0, 0)} {along(0, 0.5, 0)} {along(0, 0, 2)}"
    vertices, triangles = ball(2)
    top = vertices[:, 1].min()
    (tmp_path / "ball.obj").write_text(obj(vertices, triangles))
    assert touches(floor + box + GLASS)
    assert touches(box + GLASS + floor)
    assert touches(box + GLASS + beside + WATER)
    assert touches(box + GLASS + beside + MATT)
    assert not touches(box + MATT + beside + MATT)
    assert touches(floor + f"SPHERE {at(0.3, 1, 0.2)} 1{GLASS}")
    assert touches(f"SPHERE {at(0.3, 1, 0.2)} 1{GLASS}SPHERE {at(0.3, 2.5, 0.2)} 0.5{GLASS}")
    assert touches(f"SPHERE {at(0.3, 1, 0.2)} 1{GLASS}SPHERE {at(0.3, 1, 0.2)} 1{WATER}")
    assert touches(f"SPHERE {at(0.3, 1, 0.2)} 1{GLASS}SPHERE {at(0.3, 1.5, 0.2)} 0.5{WATER}")
    assert touches(floor + ellipsoid + GLASS)
    assert touches(f"AND {box} NOT SPHERE {at(0.5, 0.5, 0.5)} 0.3 END END{GLASS}{beside}{WATER}")
    assert touches(f"AND SPHERE {at(0, 0, 0)} 2 NOT SPHERE {at(0, 0, 0)} 1 END END{GLASS}SPHERE {at(0, 0, 0)} 1{WATER}")
    mesh = f'MESH "{tmp_path}/ball.obj" (0,{-top},0) (0,0,0) 1{GLASS}'
    ground = "POLYGON 4 (-5,{0},-5) (5,{0},-5) (5,{0},5) (-5,{0},5)" + MATT
    assert not touches(mesh + ground.format(-0.1))
    assert touches(mesh + f"BOX (-1,-1,-1) (2,0,0) (0,1,0) (0,0,2){GLASS}") == bool(
        np.isclose(vertices[triangles][:, :, 1], top).all(axis=1).any()
    )


@pytest.mark.parametrize("seed", range(5))
def test_what_does_not(seed):
    print("seed", seed)
    rng = np.random.default_rng([9, seed])
    at, along = placed(rng)
    floor = f"POLYGON 4 {at(-5, 0, -5)} {at(5, 0, -5)} {at(5, 0, 5)} {at(-5, 0, 5)}{MATT}"
    box = f"BOX {at(0, 0.01, 0)} {along(1, 0, 0)} {along(0.2, 1, 0)} {along(0, 0, 1)}"
    assert not touches(floor + box + GLASS)
    assert not touches(floor + f"BOX {at(0, -0.3, 0)} {along(1, 0, 0)} {along(0.2, 1, 0.1)} {along(0, 0.1, 1)}{GLASS}")
    assert not touches(floor + f"SPHERE {at(0.3, 0.9, 0.2)} 1{GLASS}")
    assert not touches(f"SPHERE {at(0, 0, 0)} 2{GLASS}SPHERE {at(0.3, 0.1, 0.2)} 1{WATER}")
    assert not touches(f"SPHERE {at(0, 0, 0)} 2{GLASS}SPHERE {at(1.3, 0.1, 0.2)} 1{WATER}")
    inside = f"ELLIPSOID {at(0.1, 0, 0)} {along(0.4, 0, 0)} {along(0, 0.5, 0)} {along(0, 0, 0.3)}"
    assert not touches(f"SPHERE {at(0, 0, 0)} 2{GLASS}{inside}{WATER}")
    assert not touches(f"SPHERE {at(0, 0, 0)} 1{GLASS}SPHERE {at(3, 0, 0)} 1{GLASS}")


@pytest.mark.parametrize("seed", range(10))
def test_ellipsoids_that_touch(seed):
    """In the frame where one is the unit sphere, the other's form M fits it at x if M (x - c) is along x."""
    print("seed", seed)
    rng = np.random.default_rng([11, seed])
    frame, away = turned(rng) @ np.diag(rng.uniform(0.2, 2, 3)) @ turned(rng), rng.normal(size=3)

    def pair(centre, axes):
        ellipsoids = ((np.zeros(3), np.eye(3), GLASS), (centre, axes, WATER))
        return "".join(
            f"ELLIPSOID {words(c @ frame + away)} {' '.join(words(axis) for axis in a @ frame)}{material}"
            for c, a, material in ellipsoids
        )

    axes = turned(rng) @ np.diag(rng.uniform(0.2, 2, 3)) @ turned(rng)
    x = rng.normal(size=3)
    x /= np.linalg.norm(x)
    across = x @ axes.T @ axes  # M⁻¹ x
    across /= np.sqrt(across @ x)
    for side in (-1, 1):  # within each other, across each other, or beside each other
        assert touches(pair(x - side * across, axes))
        gap = 0.01 * x
        assert not touches(pair(x - side * across + gap, axes))
        assert not touches(pair(x - side * across - gap, axes))
    spin = turned(rng)
    assert touches(pair(np.zeros(3), spin @ np.diag([1, 1, 2.0]) @ spin.T))  # along a circle
    assert touches(pair(np.zeros(3), spin @ np.diag([0.5, 1, 2.0]) @ spin.T))  # at two points
    assert touches(pair(np.zeros(3), spin))
    assert not touches(pair(np.zeros(3), spin @ np.diag([0.9, 1.1, 2.0]) @ spin.T))  # across each other
    assert not touches(pair(np.zeros(3), spin @ np.diag([1.1, 1.2, 2.0]) @ spin.T))


@pytest.mark.parametrize("seed", range(5))
def test_opaque_faces_in_one_place_count_where_they_are_seen(seed):
    print("seed", seed)
    rng = np.random.default_rng([10, seed])
    at, along = placed(rng)
    card = f"POLYGON 4 {at(0.2, 1, 0.2)} {at(0.7, 1, 0.2)} {at(0.7, 1, 0.7)} {at(0.2, 1, 0.7)}{MATT}"
    beside = f"POLYGON 4 {at(0.7, 1, 0.2)} {at(1.7, 1, 0.2)} {at(1.7, 1, 0.7)} {at(0.7, 1, 0.7)}{MATT}"
    box = f"BOX {at(0, 0, 0)} {along(1, 0, 0)} {along(0, 1, 0)} {along(0, 0, 1)}{MATT}"
    ball = f"SPHERE {at(0, 0, 0)} 1{MATT}"

    def eye(*point):
        return f"CAMERA {at(*point)} (1e-3,0,0) (0,1e-3,0) (0,0,1e-3)\n"

    for place, seen in (((0, 5, 0), True), ((0, -5, 0), False)):
        assert bool(contact(text.read(eye(*place) + box + card))) == seen
        assert contact(text.read(eye(*place) + card + card))
        assert not contact(text.read(eye(*place) + card + beside))
    assert contact(text.read(eye(0, 5, 0) + ball + ball)) and not contact(text.read(eye(0, 5, 0) + ball + box))


def test_precedence_hangs_on_no_order():
    floor = "POLYGON 4 (-5,0,-5) (5,0,-5) (5,0,5) (-5,0,5)" + MATT
    card = "POLYGON 4 (0,0,0) (0.5,0,0) (0.5,0,0.5) (0,0,0.5) (1,0,0) 0 1 (0,0,0) 1e6 1\n"
    film = "POLYGON 4 (0,0,0) (2,0,0) (2,0,2) (0,0,2)" + GLASS
    small, large = "BOX (0,0,0) (1,0,0) (0,1,0) (0,0,1)", "BOX (-1,0,0) (1,0,0) (0,1,0) (0,0,1.5)"
    things = [small + GLASS, large + WATER, film, floor, card]  # from the last that precedes to the first
    rng = np.random.default_rng(1)
    for _ in range(10):
        order = rng.permutation(len(things))
        scene = text.read(CAMERA + "".join(things[k] for k in order))
        numbers = precedence(scene)
        ranked = order[np.argsort(numbers)].tolist()
        assert ranked == [1, 0, 2, 3, 4]
        equal = text.read(CAMERA + "".join(small + m for m in ((GLASS, WATER), (WATER, GLASS))[order[0] % 2]))
        assert equal.objects[media(equal)[-1][0]].material.eps_r == 2.25  # the denser ranks higher
