"""S15: Snell and Fresnel at the critical angle of total reflection, and past it."""

import math
from functools import cache

import mpmath as mp
import numpy as np

from harness.scene.model import Box, Scene
from harness.stress.exact import triple
from harness.stress.light.optics import reflectance
from harness.stress.row import ROUNDOFF, Finding, Row, Trial, in_general_position, rounded, within
from harness.stress.view import DIGITS, WHITE, cross, exact_rays, exactly, fan, glass, unit

RAYS = 256  # pixels of one row
GLASS, AIR = (2.25, 1.0), (1.0, 1.0)
INDEX = 1.5
NOISE = 64  # u; rays closer to the critical angle than this, relative, may be on either side of it


def block(past, precision, rng, spread, tilt):
    """The eye in a block of glass before white; rays meet a face at the angle whose sine is (1 + past)/INDEX. Pixels
    show the transmitted light, as reflected rays end in the glass (depth 1)."""
    turn, eye = in_general_position(rng), rng.uniform(-1, 1, 3)
    corner = rounded(eye + turn @ [-40, -40, -75], precision)
    edges = tuple(triple(edge) for edge in rounded(80 * turn.T, precision))
    sine = (1 + past) / INDEX
    towards = math.sqrt(1 - sine * sine) * turn[:, 2] + sine * turn[:, 0]
    seen = fan(eye, towards, turn[:, 1], spread, tilt, precision)
    scene = Scene(seen, (Box(glass(*GLASS), triple(corner), edges),), background=WHITE)
    return scene, {"width": RAYS, "height": 1, "depth": 1}


@mp.workdps(DIGITS)
def truth(scene):
    """For each ray its relative distance from the critical angle, and T: (2, RAYS)."""
    (box,) = scene.objects
    normal = unit(cross(*map(exactly, box.edges[:2])))
    pairs = []
    for _, _, _, way in exact_rays(scene.camera, RAYS, 1):
        cosine = abs(mp.fdot(normal, way))
        pairs.append((float(1 - INDEX * mp.sqrt(1 - cosine**2)), float(1 - reflectance(GLASS, AIR, cosine))))
    return np.array(pairs).T


def critical(before, precision, rng):
    """Rays about `before` from the critical angle; on either side of it where rounding is larger."""
    near = max(before, 32 * ROUNDOFF[precision])
    scene, parameters = block(-before, precision, rng, 0.5 * math.sqrt(near), 0.5 * near)
    u = ROUNDOFF[precision]
    reference = cache(lambda: truth(scene))

    def judge(result):
        distance, let_through = reference()
        off = np.abs(result.array[0].astype(float) - let_through[:, None]).max(axis=-1)
        allowed = 8 * sensitivity(np.maximum(np.abs(distance), u), u)
        return within(off, allowed)

    return Trial(scene, judge, parameters=parameters)


def past(level, precision, rng):
    """Rays past the critical angle by `level`, relative: all light is reflected, so pixels are exactly 0."""
    scene, parameters = block(level, precision, rng, 0.3 * math.sqrt(level), 0.0)
    reference = cache(lambda: truth(scene))

    def judge(result):
        judged = reference()[0] < -NOISE * ROUNDOFF[precision]
        return Finding(judged.sum(), (~(result.array[0] == 0).all(axis=-1) & judged).sum())

    return Trial(scene, judge, parameters=parameters)


def sensitivity(before, u):
    """|ΔR| for an error u of the cosine: R falls with the square root of the distance to the critical angle."""
    return (INDEX + 1 / INDEX) * math.sqrt(2) * INDEX**2 * u / np.sqrt(before)


ROWS = (
    Row(
        name="critical",
        code="S15",
        title="Reflectance just before the critical angle",
        stress="distance to the critical angle, relative, in its sine",
        failure="rays without a reflectance, or off by more than 8 times what rounding explains",
        error="|ΔR|",
        levels=(1e-2, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-10, 1e-12, 1e-14, 1e-16),
        method="fresnel",
        make=critical,
        expected=lambda level, u, methods: float(sensitivity(max(level, u), u)),
        limit=lambda u, methods: u if methods["fresnel"] == "unclamped" else None,
    ),
    Row(
        name="total-reflection",
        code="S15",
        title="Reflectance past the critical angle",
        stress="distance past the critical angle, relative, in its sine",
        failure="rays that are not wholly reflected",
        levels=(1e-5, 1e-4, 1e-3, 1e-2, 0.03, 0.1, 0.2, 0.3, 0.4),
        method="fresnel",
        make=past,
    ),
)
