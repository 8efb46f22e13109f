"""What can be proved of scenes without a picture, and that no more is."""

from dataclasses import replace

import numpy as np
import seeds

from harness.reduction.proof import Proof
from harness.renderer.parameters import Parameters
from harness.scene.model import Camera, Light, Material, Polygon, Scene, Sphere
from harness.scene.text import read

JOB = Parameters(width=40, height=30, depth=4, shadows=True)
MATTE, MIRROR = "0 10 (0,0,0) 1e6 1", "0.8 10 (0,0,0) 1e6 1"
VIEW = "CAMERA (0.3,0.2,0) (1,0.1,0) (-0.06,0.6,0) 3\n"
WALL = f"POLYGON 4 (-9,-9,-3) (9,-9,-3.1) (9,9,-3.2) (-9,9,-3.1) (0.5,0.6,0.4) {MATTE}\n"
LAMP = "LIGHT (3,4,6) (0.9,0.8,0.7) 0\n"
BEHIND = "LIGHT (0.3,0.2,-9) (0.9,0.8,0.7) 0.5\n"
HIDDEN = f"SPHERE (0.2,0.1,40) 0.3 (0.2,0.5,0.2) {MIRROR}\n"
BALL = f"SPHERE (0.1,0.2,-1) 0.4 (0.2,0.5,0.2) {MIRROR}\n"


def proof(*words, **job):
    return Proof(read(VIEW + "".join(words)), replace(JOB, **job))


def test_a_light_behind_a_wall():
    assert proof(WALL, LAMP, BEHIND).light(1) and not proof(WALL, LAMP, BEHIND).light(0)
    assert proof(WALL, BEHIND, shadows=False).light(0)
    assert not proof(WALL, BALL, BEHIND).light(0)  # a ball in front of the wall could be lit, were there no wall
    assert not proof(WALL, BEHIND, lens_radius=0.1).light(0)
    through = "LIGHT (0.3,0.2,-3.3) (0.9,0.8,0.7) 0.5\n"
    assert proof(WALL, through).light(0) and not proof(WALL, through, feelers=2).light(0)


def test_a_light_in_an_opaque_solid():
    inside = "LIGHT (0.2,0.2,-1.1) (0.9,0.8,0.7) 0.1\n"
    assert proof(BALL, WALL, inside).light(0)
    assert not proof(BALL, WALL, inside, shadows=False).light(0)
    assert proof(BALL, WALL, inside, feelers=3).light(0)
    assert not proof(BALL, WALL, inside.replace(" 0.1\n", " 0.31\n"), feelers=3).light(0)
    assert not proof(BALL.replace("0.8 10 (0,0,0)", "0.8 10 (0.1,0,0)"), WALL, inside).light(0)
    # The numbers of the feelers of a second soft light are those of its place (SOF-2).
    assert proof(BALL, inside, inside).light(0) and not proof(BALL, inside, inside, feelers=3).light(0)


def test_an_object_that_no_ray_reaches():
    assert proof(WALL, LAMP, HIDDEN).thing(1) and not proof(WALL, LAMP, HIDDEN).thing(0)
    assert not proof(BALL, WALL, LAMP, HIDDEN).thing(2)  # the ball could mirror it
    assert proof(BALL, WALL, LAMP, HIDDEN, depth=0).thing(2)
    behind = f"SPHERE (0.3,0.2,5) 0.1 (0.2,0.5,0.2) {MATTE}\n"
    assert not proof(WALL, LAMP, behind).thing(1)  # it could throw a shadow
    assert proof(WALL, LAMP, behind, shadows=False).thing(1)
    assert not proof(WALL, LAMP, behind, shadows=False, lens_radius=0.1).thing(1)
    core = f"BOX (0,0.1,-1.1) (0.1,0,0) (0,0.1,0) (0,0,0.1) (1,0,0) {MIRROR}\n"
    assert proof(BALL, core, WALL, LAMP).thing(1) and not proof(BALL, core, WALL, LAMP).thing(0)


def test_depth_beyond_the_last_bounce():
    assert [bool(proof(WALL, BALL, LAMP).depth(depth)) for depth in (0, 1, 2)] == [False, True, True]
    assert proof(WALL, LAMP).depth(0) and proof(WALL, LAMP, HIDDEN).depth(0)
    assert not proof(BALL, WALL.replace(MATTE, MIRROR), LAMP).depth(1)
    assert not proof(BALL.replace("0.4", "40"), LAMP).depth(1)  # the eye is in it


def test_what_is_proved_is_so_of_random_scenes():
    """Rays to random points of spheres and lights at random: none contradicts a proof."""
    (seed, *_) = seeds.numbers("proof")
    print("seed", seed)
    rng = np.random.default_rng(seed)
    proved = 0
    for _ in range(60):
        camera = Camera((0, 0, 0), (1, 0, 0), (0, 0.7, 0), (0, 0, float(rng.uniform(1, 4))))
        matte = Material((0.5, 0.5, 0.5), 0.0, 10.0, (0, 0, 0), 1e6, 1.0)
        balls = tuple(
            Sphere(matte, tuple(rng.uniform(-6, 6, 3)), float(rng.uniform(0.1, 1))) for _ in range(rng.integers(1, 6))
        )
        lamp = Light(tuple(rng.uniform(-5, 5, 3)), (1, 1, 1), 0.0)
        scene = Scene(camera, balls, (lamp,))
        found = Proof(scene, JOB)
        eye = np.add(camera.centre, camera.e)
        x, y = rng.uniform(-1, 1, (2, 4000, 1))
        rays = x * camera.u + y * np.array(camera.v) - camera.e
        hits = [_nearest(ball, eye, rays) for ball in balls]
        first = np.min(hits, axis=0)
        points = (eye + first[:, None] * rays)[np.isfinite(first)]
        for place, ball in enumerate(balls):
            if found.thing(place):
                proved += 1
                assert not np.isfinite(hits[place]).any()
                feelers = _nearest(ball, points, np.subtract(lamp.position, points))
                assert not (feelers < 1).any()
    assert proved > 5


def _nearest(ball, origin, rays):
    """Where each ray first meets a sphere, in its own lengths; inf where it does not."""
    away = origin - np.array(ball.centre)
    a, b = (rays * rays).sum(-1), (rays * away).sum(-1)
    inside = b * b - a * ((away * away).sum(-1) - ball.radius**2)
    t = (-b - np.sqrt(np.maximum(inside, 0))) / a
    return np.where((inside >= 0) & (t > 1e-9), t, np.inf)


def test_polygons_of_more_than_one_orientation():
    """A light is proved dark only if it is behind each of them."""
    wall = read(VIEW + WALL + BEHIND)
    turned = Polygon(wall.objects[0].material, ((-1, -1, -2), (-1, 1, -2), (-1, 0, -12)))
    both = replace(wall, objects=(*wall.objects, turned))
    assert Proof(wall, JOB).light(0)
    assert not Proof(both, JOB).light(0)
