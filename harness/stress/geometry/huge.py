"""S3: a sphere so large that it serves as the ground, and rays from just above it."""

import mpmath as mp
import numpy as np

from harness.scene.model import Sphere
from harness.stress import exact
from harness.stress.row import Row, Trial, directions, rounded

RAYS = 20_000
STEEPNESS = 20.0, 70.0  # of the rays, degrees below the horizon
WORST = 0.1  # a hit whose relative error of t is larger is a failure
DIGITS = 50


def make_trial(rng, eye, up, centre, radius, precision) -> Trial:
    """Rays from `eye` down to the ground. up: unit vector (3,)."""
    side = np.cross(up, directions(rng, RAYS))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    fall = np.radians(rng.uniform(*STEEPNESS, (RAYS, 1)))
    rays = np.hstack([np.tile(eye, (RAYS, 1)), rounded(np.cos(fall) * side - np.sin(fall) * up, precision)])
    ground = Sphere(exact.MATERIAL, exact.triple(centre), radius)
    return exact.trial(rays, lambda: exact.sphere(rays, centre, radius), ground, worst=WORST)


def generic(level, precision, rng):
    """The eye is 1 above the ground of the rounded numbers, which rounding moves by u R."""
    up = directions(rng, 1)[0]
    radius = float(rounded(level * rng.uniform(0.9, 1.1), precision))
    centre = rounded(-radius * up, precision)
    with mp.workdps(DIGITS):
        ground = float(radius - mp.sqrt(mp.fsum(mp.mpf(float(x)) ** 2 for x in centre)))
    return make_trial(rng, rounded((ground + 1) * up, precision), up, centre, radius, precision)


def along_axis(level, precision, rng):
    radius = float(rounded(level, precision))
    up = np.array([0.0, 1.0, 0.0])
    return make_trial(rng, up, up, np.array([0.0, -radius, 0.0]), radius, precision)


def expected(level, u, methods):
    """k is off by u² f·f with `wide`, which also has the rounding of t, else by u f·f."""
    return u + u * u * level if methods.get("sphere") == "wide" else u * level


def limit(u, methods):
    """The level at which `expected` is WORST."""
    return WORST / u**2 if methods.get("sphere") == "wide" else WORST / u


GROUND = {
    "code": "S3",
    "stress": "radius / height of the eye",
    "failure": "rays that miss the ground, or hit it at a t that is off by more than a tenth",
    "levels": (1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e10, 1e12),
    "error": "|Δt| / t",
    "method": "sphere",
    "source": "Mitsuba 3 solves spheres in double; twosum and twoproduct: Knuth, Dekker 1971",
    "expected": expected,
    "limit": limit,
}
ROWS = (
    Row("huge-sphere", title="A huge sphere as the ground", make=generic, **GROUND),
    Row(
        "huge-sphere-aligned",
        title="A huge sphere as the ground, its centre straight below (0, 0, 0)",
        make=along_axis,
        aligned="huge-sphere",
        **GROUND,
    ),
)
