"""S1, S2, S4: spheres that are far away or small, and rays that graze them. The stress is distance / radius."""

import numpy as np

from harness.scene.model import Sphere
from harness.stress import exact
from harness.stress.row import Row, Trial, directions, rounded

RAYS = 20_000
WIDEST = 1.5  # of the impact parameters, in radii
FIXED = 1024.0  # distance of the small spheres
NEAR = 10.0  # distance of the sphere that is grazed, in radii
FORMULAS = ("textbook", "stable")
SOURCE = "Haines, Günther, Akenine-Möller, Ray Tracing Gems ch. 7; study 2.3.2"


def make_trial(rays, centre, radius, unit=None) -> Trial:
    """unit: of |Δt|; None: the radius."""
    ball = Sphere(exact.MATERIAL, exact.triple(centre), float(radius))
    return exact.trial(rays, lambda: exact.sphere(rays, centre, radius), ball, unit=unit or radius)


def beside(rng, along, lengths):
    """Vectors (R, 3) at right angles to the unit vectors `along`, of these lengths, the angle about them at random."""
    side = np.cross(along, directions(rng, len(along)))
    return side * (np.asarray(lengths) / np.linalg.norm(side, axis=1))[:, None]


def towards(origins, targets, precision):
    """Rays (R, 6) whose directions are rounded to the precision; origins: already rounded to it."""
    arms = targets - origins
    return np.hstack([origins, rounded(arms / np.linalg.norm(arms, axis=1, keepdims=True), precision)])


def around(rng, distance, radius, precision) -> Trial:
    """A sphere in general position, at any distance.

    Rounding would move a ray from far away by more than a radius. So all rays pass through (0, 0, 0) exactly, as
    `distance` is a power of two, and the sphere lies beside that point, such that the angles between the rays and its
    centre make the impact parameters uniform from 0 to WIDEST.
    """
    centre = rounded(WIDEST * radius * directions(rng, 1)[0], precision)
    axis = centre / np.linalg.norm(centre)
    sine = rng.uniform(0, 1, RAYS)
    along = rng.choice((-1, 1), RAYS) * np.sqrt(1 - sine**2)
    d = along[:, None] * axis + beside(rng, np.tile(axis, (RAYS, 1)), sine)
    d = rounded(d / np.linalg.norm(d, axis=1, keepdims=True), precision)
    return make_trial(np.hstack([-distance * d, d]), centre, radius)


def far(level, precision, rng):
    distance = 2.0 ** round(np.log2(level))
    return around(rng, distance, float(rounded(distance / level, precision)), precision)


def small(level, precision, rng):
    return around(rng, FIXED, float(rounded(FIXED / level, precision)), precision)


def far_at_origin(level, precision, rng):
    away = directions(rng, RAYS)
    origins = rounded(level * away, precision)
    return make_trial(towards(origins, beside(rng, away, rng.uniform(0, WIDEST, RAYS)), precision), np.zeros(3), 1.0)


def far_along_axis(level, precision, rng):
    x = np.tile([1.0, 0, 0], (RAYS, 1))
    origins = rounded(level * x + beside(rng, x, rng.uniform(0, WIDEST, RAYS)), precision)
    return make_trial(np.hstack([origins, -x]), np.zeros(3), 1.0)


def grazing(level, precision, rng):
    """Every impact parameter is 1 - level radii, except for rounding."""
    radius = float(rounded(rng.uniform(0.7, 1.4), precision))
    centre = rounded(rng.normal(size=3), precision)
    away = directions(rng, RAYS)
    origins = rounded(centre + NEAR * radius * away, precision)
    # A ray is aimed at a point of the plane through the centre; its line passes the centre closer than that point.
    impact = 1 - level
    lengths = np.full(RAYS, impact / np.sqrt(1 - (impact / NEAR) ** 2)) * radius
    ulp = float(np.spacing(np.float32(NEAR * radius) if precision == "float32" else NEAR * radius))
    return make_trial(towards(origins, centre + beside(rng, away, lengths), precision), centre, radius, ulp)


def far_error(level, u, methods):
    return u * level**2 if methods.get("sphere") in FORMULAS else u * level


def far_limit(u, methods):
    """1/u; its square root for the naive formulas, its square for `wide`, which has twice the digits."""
    return {"wide": u**-2}.get(methods.get("sphere"), u**-0.5 if methods.get("sphere") in FORMULAS else 1 / u)


def grazing_error(level, u, methods):
    """Δ is off by u (D/r)² with the naive formulas, else by u D/r; t is off by this / (2 √(2 level))."""
    off = NEAR**2 if methods.get("sphere") in FORMULAS else NEAR
    return off / (2 * (2 * level) ** 0.5) / (2 * NEAR)  # an ulp of t is about 2 u t, and t about NEAR radii


def grazing_limit(u, methods):
    return u * (NEAR**2 if methods.get("sphere") in FORMULAS else NEAR)


LEVELS = (1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e10, 1e12)
FAR = {
    "code": "S1",
    "stress": "distance / radius",
    "failure": "rays that hit or miss wrongly",
    "error": "|Δt| / radius",
    "method": "sphere",
    "source": SOURCE,
    "expected": far_error,
    "limit": far_limit,
}
ROWS = (
    Row("far-sphere", title="A sphere far away", levels=LEVELS, make=far, **FAR),
    # From 1/u on no ray of this precision would hit, so the last levels are left out.
    Row(
        "far-sphere-at-origin",
        title="A sphere far away, its centre at (0, 0, 0)",
        levels=LEVELS[:8],
        make=far_at_origin,
        **FAR,
    ),
    Row(
        "far-sphere-aligned",
        title="A sphere far away, its centre at (0, 0, 0), rays along an axis",
        levels=LEVELS[:8],
        make=far_along_axis,
        aligned="far-sphere",
        **FAR,
    ),
    Row("small-sphere", title="A small sphere at a fixed distance", levels=LEVELS, make=small, **FAR | {"code": "S2"}),
    Row(
        "grazing",
        code="S4",
        title="Rays that graze a sphere",
        stress="distance from the rim / radius",
        failure="rays that hit or miss wrongly",
        levels=(1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14),
        make=grazing,
        error="|Δt| / ulp of t",
        method="sphere",
        source=SOURCE,
        expected=grazing_error,
        limit=grazing_limit,
    ),
)
