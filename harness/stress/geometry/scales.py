"""S6: scenes so small or large that squares of lengths overflow or underflow."""

import numpy as np

from harness.scene.model import Mesh, Sphere
from harness.stress import exact
from harness.stress.row import ROUNDOFF, Row, Trial, directions, in_general_position, rounded

RAYS = 2_000
WORST = 0.01  # a hit whose relative error of t is larger is a failure
TYPES = {"float32": np.float32, "float64": np.float64}
BAND = 0.03  # of a triangle's side: no ray is aimed nearer to it


def smallest(level, precision):
    """The scale at the share `level` of the decades from 1 down to the smallest normal number."""
    return float(np.finfo(TYPES[precision]).smallest_normal) ** level


def largest(level, precision):
    """The scale at the share `level` of the decades from 1 up to the largest number."""
    return float(np.finfo(TYPES[precision]).max) ** level


def sphere(scale, precision, rng) -> Trial:
    """A sphere of radius `scale`, about, 3 scales from the rays' origins."""
    away = directions(rng, 1)[0]
    radius = float(rounded(scale * rng.uniform(0.8, 1.2), precision))
    origins = rng.normal(0, 0.1, (RAYS, 3))
    arms = 3 * away + 1.2 * np.sqrt(rng.uniform(0, 1, (RAYS, 1))) * directions(rng, RAYS) - origins
    rays = rounded(np.hstack([scale * origins, arms / np.linalg.norm(arms, axis=1, keepdims=True)]), precision)
    centre = rounded(3 * scale * away, precision)
    thing = Sphere(exact.MATERIAL, exact.triple(centre), radius)
    return exact.trial(rays, lambda: exact.sphere(rays, centre, radius), thing, worst=WORST)


def triangle(scale, precision, rng) -> Trial:
    """A triangle of size `scale`, 3 scales from the rays' origins; half of the rays pass beside it."""
    corners = in_general_position(rng) * np.array([[1.0], [0.7], [0.8]]) + rng.normal(0, 0.1, 3)
    weights = rng.dirichlet((1, 1, 1), RAYS) * (1 - 3 * BAND) + BAND
    beside = rng.uniform(0, 1, RAYS) < 0.5
    row = rng.integers(0, 3, RAYS)
    weights[beside, row[beside]] -= weights[beside, row[beside]] + rng.uniform(BAND, 0.5, beside.sum())
    aims = weights / weights.sum(axis=1, keepdims=True) @ corners
    origins = aims - 3 * directions(rng, RAYS)
    rays = rounded(np.hstack([scale * origins, (aims - origins) / 3]), precision)
    corners = rounded(scale * corners, precision)
    thing = Mesh(exact.MATERIAL, corners, np.array([[0, 1, 2]], np.int32), False)
    # As scene/surface.py does: a triangle whose normal underflows or overflows is removed (TRI-2).
    with np.errstate(over="ignore", invalid="ignore"):
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        has_area = normal @ normal > 0
    there = [thing] if has_area else []
    return exact.trial(rays, lambda: exact.triangle(rays, corners[None]), *there, worst=WORST)


SCALE = {
    "code": "S6",
    "failure": "rays that hit or miss wrongly, or hit at a t that is off by more than a hundredth",
    "error": "|Δt| / t",
    "logarithmic": False,
    "source": "range of the numbers: IEEE 754",
    "expected": lambda level, u, methods: u,
}
# The formulas for a sphere have squares of lengths. The t of a triangle has products of three lengths in either method,
# and the normal, made at load in float64, the square of an area.
SPHERE = {
    "levels": (0.1, 0.2, 0.3, 0.4, 0.45, 0.48, 0.52, 0.56, 0.6, 0.8),
    "method": "sphere",
    "limit": lambda u, methods: 1 / 2,
    **SCALE,
}
TRIANGLE = {
    "levels": (0.1, 0.2, 0.24, 0.26, 0.28, 0.32, 0.36, 0.4, 0.5, 0.8),
    "method": "triangle",
    "limit": lambda u, methods: 1 / 4 if u == ROUNDOFF["float64"] else 1 / 3,
    **SCALE,
}
BELOW = "decades of the scale below 1 / those of the type of numbers"
ABOVE = "decades of the scale above 1 / those of the type of numbers"


def row(name, title, stress, scale, make, shape):
    def trial(level, precision, rng):
        return make(scale(level, precision), precision, rng)

    return Row(name, title=title, stress=stress, make=trial, **shape)


ROWS = (
    row("scale-down", "A small scene, a sphere", BELOW, smallest, sphere, SPHERE),
    row("scale-up", "A large scene, a sphere", ABOVE, largest, sphere, SPHERE),
    row("mesh-scale-down", "A small scene, a triangle", BELOW, smallest, triangle, TRIANGLE),
    row("mesh-scale-up", "A large scene, a triangle", ABOVE, largest, triangle, TRIANGLE),
)
