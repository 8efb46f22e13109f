"""S17: energy. A lossless ball in a white world is white, except for the light that the depth cuts off."""

import math
from functools import cache

import mpmath as mp
import numpy as np

from harness.scene.model import Scene, Sphere
from harness.stress.exact import triple
from harness.stress.light.optics import reflectance
from harness.stress.row import ROUNDOFF, Row, Trial, in_general_position, rounded, within
from harness.stress.view import DIGITS, WHITE, camera, cross, exact_rays, exactly, fan, glass, minus

SIDE, FAN = 12, 128  # pixels
GRAZING = 2  # depth at the rim
DISTANCE = 4.0  # of the eye, in radii
GLASS, AIR = (2.25, 1.0), (1.0, 1.0)
GATE = {"float32": 1e-5, "float64": 1e-12}


def trial(seen, ball, depth, width, height, precision):
    """Pixels must be 1 - (1 - R) R^(depth - 1): the last term is the light still in the ball when rays end."""
    scene = Scene(seen, (ball,), background=WHITE)
    reference = cache(lambda: truth(scene, depth, width, height))

    def judge(result):
        white, clearance = reference()
        off = np.abs(result.array.astype(float) - white[..., None]).max(axis=-1)
        allowed = GATE[precision] + 8 * sensitivity(clearance, ROUNDOFF[precision])
        return within(off, allowed)

    return Trial(scene, judge, parameters={"width": width, "height": height, "depth": depth})


@mp.workdps(DIGITS)
def truth(scene, depth, width, height):
    """For each pixel its value, and the distance of its ray's impact from 1 radius: (height, width) each."""
    (ball,) = scene.objects
    white, clearance = np.empty((height, width)), np.empty((height, width))
    for j, i, eye, way in exact_rays(scene.camera, width, height):
        aside = cross(minus(eye, exactly(ball.centre)), way)
        impact2 = mp.fdot(aside, aside) / mp.mpf(ball.radius) ** 2
        clearance[j, i] = abs(1 - mp.sqrt(impact2))
        r = reflectance(AIR, GLASS, mp.sqrt(max(0, 1 - impact2)))  # 1 for a ray that misses, which also sees white
        white[j, i] = 1 - (1 - r) * r ** (depth - 1)
    return white, clearance


def sensitivity(clearance, u):
    """|Δ pixel| by rounding: R rises to 1 with the square root of the clearance.

    Rounding an eye ray moves its impact by u for each radius of distance; leaving the surface moves it by the offset,
    36 u (OFF-1).
    """
    slope = 2 * (1.5**2 + 1) / math.sqrt(1.5**2 - 1)  # of T by the cosine, at grazing incidence
    moved = (DISTANCE + 36) * u
    return slope * moved / np.sqrt(2 * np.maximum(clearance, moved))


def place(precision, rng):
    """An eye (3,), a rotation (3, 3) whose third column points from the ball to the eye, and a ball of radius 1."""
    turn, centre = in_general_position(rng), rounded(rng.uniform(-1, 1, 3), precision)
    return centre + DISTANCE * turn[:, 2], turn, Sphere(glass(*GLASS), triple(centre), 1.0)


def by_depth(depth, precision, rng):
    """Eye rays over most of the ball, up to an impact of 0.95."""
    eye, turn, ball = place(precision, rng)
    half = 0.66  # the screen's corner is almost on the rim
    seen = camera(eye, np.array(ball.centre), half * turn[:, 0], half * turn[:, 1], precision)
    return trial(seen, ball, depth, SIDE, SIDE, precision)


def by_impact(clearance, precision, rng):
    """Eye rays that graze the ball: their impact is about 1 - clearance."""
    eye, turn, ball = place(precision, rng)
    sine = (1 - clearance) / DISTANCE
    near = max(clearance, 256 * ROUNDOFF[precision])  # else rounding would move the rim
    towards = -math.sqrt(1 - sine * sine) * turn[:, 2] + sine * turn[:, 0]
    seen = fan(eye, towards, turn[:, 1], 0.3 * math.sqrt(near) / DISTANCE, 0.5 * near / DISTANCE, precision)
    return trial(seen, ball, GRAZING, FAN, 1, precision)


ROWS = (
    Row(
        name="furnace",
        code="S17",
        title="A lossless ball in a white world, by depth",
        stress="depth",
        failure="pixels off by more than 1e-12 (float32: 1e-5)",
        error="|Δ pixel|",
        levels=(1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0, 20.0),
        logarithmic=False,
        make=lambda level, precision, rng: by_depth(int(level), precision, rng),
        expected=lambda level, u, methods: 4 * u,
    ),
    Row(
        name="furnace-grazing",
        code="S17",
        title="A lossless ball in a white world, at its rim",
        stress="1 - impact / radius",
        failure="pixels off by more than 1e-12 (float32: 1e-5) and 8 times what rounding explains",
        error="|Δ pixel|",
        levels=(0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 1e-10),
        make=by_impact,
        expected=lambda level, u, methods: float(sensitivity(level, u)),
        # Closer to the rim the sign of d·n, which tells entering from leaving (MED-3), is lost: pixels turn black.
        limit=lambda u, methods: 2 * u,
    ),
)
