"""S20: one sample that is NaN spoils its pixel: how many pixels are lost as samples grow, and whether it is counted."""

import math

import numpy as np

from harness.scene.model import Air, Scene, Sphere
from harness.stress.exact import triple
from harness.stress.row import Finding, Row, Trial, in_general_position, rounded
from harness.stress.view import WHITE, camera, eye_rays, glass

SIDE, MANY = 10, 40  # pixels, each with one bubble at a random place in it
PIXEL = 0.2  # width at the screen
EYE = 60.0  # distance: bubbles at the edge look as in the middle
APART = 1.8  # radii from the bubble's centre to the edge of its pixel: their bounding boxes do not meet (MED-2)
KILLS = 1 - 1 / 2.25  # share of a bubble's disk past the critical angle of glass
SHARE = 2e-3  # of samples that are NaN, in the row whose level is the number of samples
SURE = 1e-4  # of a bubble's radius: a sample closer than this to the limit may be on either side of it


def bubbles(radius, side, samples, precision, rng):
    """The scene and parameters of side x side bubbles of air in glass, before white. Fresnel's formula is NaN for a ray
    whose impact on a bubble is from 1/1.5 to 1 radius, unless x ≤ 0 is tested (REF-2)."""
    turn, centre = in_general_position(rng), rounded(rng.uniform(-1, 1, 3), precision)
    radius = float(rounded(radius, precision))
    free = PIXEL / 2 - APART * radius
    balls = []
    for x, y in np.ndindex(side, side):
        where = PIXEL * (np.array([x, y]) - (side - 1) / 2) + rng.uniform(-free, free, 2)
        balls.append(Sphere(glass(1.0), triple(rounded(centre + turn[:, :2] @ where, precision)), radius))
    half = PIXEL * side / 2
    seen = camera(centre + EYE * turn[:, 2], centre, half * turn[:, 0], half * turn[:, 1], precision)
    scene = Scene(seen, tuple(balls), background=WHITE, air=Air(2.25, 1.0))
    parameters = {"width": side, "height": side, "depth": 1, "sampler": "uniform", "samples": samples}
    return scene, parameters


def past_critical(scene, side):
    """The rays through pixels' centres past the critical angle, and those that may be: bool (side, side) each."""
    eye, way = eye_rays(scene.camera, side, side)
    past, unsure = np.zeros(way.shape[:2], bool), np.zeros(way.shape[:2], bool)
    for ball in scene.objects:
        impact = np.linalg.norm(np.cross(np.subtract(ball.centre, eye), way), axis=-1) / ball.radius
        past |= (impact > 1 / 1.5) & (impact < 1)
        unsure |= (abs(impact - 1 / 1.5) < SURE) | (abs(impact - 1) < SURE)
    return past, unsure


def pixels(level, precision, rng):
    """The level is the number of samples a side of a pixel."""
    radius = PIXEL * math.sqrt(SHARE / (KILLS * math.pi))
    scene, parameters = bubbles(radius, SIDE, int(level), precision, rng)

    def judge(result):
        lost = ~np.isfinite(result.array).all(axis=-1)
        return Finding(lost.size, lost.sum(), np.array([lost.mean()]))

    return Trial(scene, judge, parameters=parameters)


def counted(level, precision, rng):
    """One sample a pixel, so the picture shows which samples are NaN; the level is their share by the geometry."""
    root = math.sqrt(level)
    radius = PIXEL * root / (math.sqrt(KILLS * math.pi) + 2 * APART * root)
    scene, parameters = bubbles(radius, MANY, 1, precision, rng)

    def judge(result):
        seen = int((~np.isfinite(result.array).all(axis=-1)).sum())
        past, unsure = past_critical(scene, MANY)
        low, high = int((past & ~unsure).sum()), int((past | unsure).sum())
        count = result.said.rays["non_finite"]
        # The renderer's count must equal the NaN pixels, and these must agree with the geometry.
        missing = max(abs(count - seen), low - seen, seen - high, 0)
        return Finding(MANY * MANY, missing)

    return Trial(scene, judge, parameters={**parameters, "fresnel": "unclamped"})


def killed(level, u, methods):
    """Predicts the share of lost pixels; samples closer together than a bubble is wide lose no more."""
    return min(1.0, SHARE * level**2) if methods["fresnel"] == "unclamped" else 0.0


ROWS = (
    Row(
        name="nan",
        code="S20",
        title="Pixels lost to single NaN samples, by the number of samples",
        stress="samples a side of a pixel",
        failure="pixels that are NaN",
        error="share of the pixels",
        levels=(1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0),
        method="fresnel",
        make=pixels,
        expected=killed,
        limit=lambda u, methods: SHARE**-0.5 if methods["fresnel"] == "unclamped" else None,
    ),
    Row(
        name="nan-counted",
        code="S20",
        title="NaN samples that are not counted",
        stress="share of samples that are NaN",
        failure="NaN samples that are neither visible nor counted",
        levels=(1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.2, 0.4),
        method="floating_point",
        make=counted,
    ),
)
