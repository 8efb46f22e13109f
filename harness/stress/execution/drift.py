"""S9: directions that are not renormalised change their length with every bounce, until rays leave the surface."""

import math
from functools import cache

import mpmath as mp
import numpy as np

from harness.scene.model import Material, Scene, Sphere
from harness.stress.exact import triple
from harness.stress.row import Row, Trial, in_general_position, rounded, within
from harness.stress.view import DIGITS, WHITE, camera, cross, exact_rays, exactly, minus

SIDE = 16  # pixels
IMPACT = 0.3  # of eye rays, in radii, about
OFF = 1e-3  # relative

# A ray in a ball has the same angle at every bounce. If |d| is 1 + e, t = b + √Δ of SPH-1 is too long by half of e:
# the point overshoots by 3 e c along d, c = |d·n|, so |n| is 1 + 3 e c², and REF-3 makes e (1 + 12 c⁴) of e.
GROWTH = 1 + 12 * (1 - IMPACT**2) ** 2


def ball(depth, precision, rng):
    """The eye in a ball that reflects totally on its inside and absorbs a little."""
    turn, centre = in_general_position(rng), rounded(rng.uniform(-1, 1, 3), precision)
    inside = Material(WHITE, 1.0, 1.0, triple(rounded([0.98, 0.97, 0.95], precision)), 1e6, 1.0)
    sine = IMPACT / 0.5
    eye, ahead = 0.5 * turn[:, 0], math.sqrt(1 - sine**2) * turn[:, 0] + sine * turn[:, 1]
    u, v = 0.1 * turn[:, 2], 0.1 * np.cross(turn[:, 2], ahead)
    seen = camera(centre + eye, centre + eye + ahead, u, v, precision)
    sphere = Sphere(inside, triple(centre), 1.0)
    scene = Scene(seen, (sphere,), ambient=WHITE)
    truth = cache(lambda: bounces(seen, sphere, depth))

    def judge(result):
        off = np.abs(result.array.astype(float) / truth() - 1).max(axis=-1)
        return within(off, OFF)

    return Trial(scene, judge, parameters={"width": SIDE, "height": SIDE, "depth": depth})


@mp.workdps(DIGITS)
def bounces(seen, sphere, depth):
    """The true picture (SIDE, SIDE, 3): at every bounce the white surface, attenuated by all chords up to there."""
    picture = np.empty((SIDE, SIDE, 3))
    for j, i, eye, way in exact_rays(seen, SIDE, SIDE):
        f = minus(eye, exactly(sphere.centre))
        along, aside = mp.fdot(f, way), cross(f, way)
        half = mp.sqrt(mp.mpf(sphere.radius) ** 2 - mp.fdot(aside, aside))  # of each chord
        for channel, a in enumerate(exactly(sphere.material.attenuation)):
            first, rest = a ** (half - along), a ** (2 * half)
            picture[j, i, channel] = float(first * mp.fsum(rest**k for k in range(depth + 1)))
    return picture


def expected(level, u, methods):
    return min(1.0, u * (GROWTH**level if methods["renormalise"] == "off" else level + 1))


def limit(u, methods):
    """The depth at which points miss the surface by more than the offset, so rays leave the ball."""
    if methods["renormalise"] == "on" or methods["offset"] == "none":
        return None
    return math.log(methods["epsilon"] / u) / math.log(GROWTH)


ROWS = (
    Row(
        name="drift",
        code="S9",
        title="Directions that are not renormalised, between the walls of a ball",
        stress="bounces",
        failure="pixels off by more than 0.1 %, or whose rays got out",
        error="|Δ pixel| / pixel",
        levels=(1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 14.0, 20.0),
        logarithmic=False,
        method="renormalise",
        make=lambda level, precision, rng: ball(int(level), precision, rng),
        expected=expected,
        limit=limit,
    ),
)
