"""S6: scenes so small or large that squares leave the range of the numbers."""

from functools import cache

import numpy as np

from harness.scene.model import Mesh, Sphere
from harness.stress import exact
from harness.stress.row import ROUNDOFF, Row, Trial, directions, in_general_position, rounded

RAYS = 2_000
WORST = 0.01  # a hit that is off by more of its t is none
TYPES = {"float32": np.float32, "float64": np.float64}
BAND = 0.03  # of a triangle's side: no ray is aimed nearer to it


def smallest(level, precision):
    """The scale that is the share `level` of all decades below 1, down to the smallest number with all its digits."""
    return float(np.finfo(TYPES[precision]).smallest_normal) ** level


def largest(level, precision):
    return float(np.finfo(TYPES[precision]).max) ** level


def sphere(scale, precision, rng) -> Trial:
    """At 3 scales from the rays' origins, one scale in radius."""
    away = directions(rng, 1)[0]
    radius = float(rounded(scale * rng.uniform(0.8, 1.2), precision))
    origins = rng.normal(0, 0.1, (RAYS, 3))
    arms = 3 * away + 1.2 * np.sqrt(rng.uniform(0, 1, (RAYS, 1))) * directions(rng, RAYS) - origins
    rays = rounded(np.hstack([scale * origins, arms / np.linalg.norm(arms, axis=1, keepdims=True)]), precision)
    centre = rounded(3 * scale * away, precision)
    thing = Sphere(exact.MATERIAL, exact.triple(centre), radius)
    return make_trial(thing, rays, lambda: exact.sphere(rays, centre, radius))


def triangle(scale, precision, rng) -> Trial:
    """Makes a triangle of size `scale`, 3 scales from the rays' origins; half of the rays pass beside it."""
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
    # What the harness does with a mesh that it reads: a triangle whose normal cannot be worked out goes (TRI-2).
    with np.errstate(over="ignore", invalid="ignore"):
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        has_area = normal @ normal > 0
    return make_trial(thing if has_area else None, rays, lambda: exact.triangle(rays, corners[None]))


def make_trial(thing, rays, truth) -> Trial:
    truth = cache(truth)

    def judge(result):
        return truth().compare(result.array, None, WORST)

    return Trial(exact.scene(*([thing] if thing else [])), judge, rays)


SCALE = {
    "code": "S6",
    "failure": "rays that hit or miss wrongly, or hit at a t that is off by more than a hundredth",
    "error": "|Δt| / t",
    "logarithmic": False,
    "source": "range of the numbers: IEEE 754",
    "expected": lambda level, u, methods: u,
}
# A sphere has squares of lengths. The t of a triangle has products of three, in either method; the normal, made at load
# in float64, the square of an area.
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
ROWS = (
    Row(
        "scale-down",
        title="A small scene, a sphere",
        stress=BELOW,
        make=lambda level, precision, rng: sphere(smallest(level, precision), precision, rng),
        **SPHERE,
    ),
    Row(
        "scale-up",
        title="A large scene, a sphere",
        stress=ABOVE,
        make=lambda level, precision, rng: sphere(largest(level, precision), precision, rng),
        **SPHERE,
    ),
    Row(
        "mesh-scale-down",
        title="A small scene, a triangle",
        stress=BELOW,
        make=lambda level, precision, rng: triangle(smallest(level, precision), precision, rng),
        **TRIANGLE,
    ),
    Row(
        "mesh-scale-up",
        title="A large scene, a triangle",
        stress=ABOVE,
        make=lambda level, precision, rng: triangle(largest(level, precision), precision, rng),
        **TRIANGLE,
    ),
)
