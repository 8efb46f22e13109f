"""S5: ellipsoids as flat as a coin, or as long as a needle."""

from functools import cache

import numpy as np

from harness.scene.model import Ellipsoid
from harness.stress import exact
from harness.stress.row import Finding, Row, Trial, directions, in_general_position, rounded

RAYS = 5_000
AWAY = 3.0  # distance of the origins, in longest semi-axes
FORMULAS = "textbook", "stable"
WIDEST = 1.3  # rays are aimed at points of the ellipsoid scaled by this


class Truth:
    """The first hits of rays (R, 6) with an ellipsoid, and their outward normals."""

    def __init__(self, rays, centre, axes):
        """axes: (3, 3), a semi-axis in each row. The ellipsoid is |f + t δ|² = det² in the frame of the unit sphere."""
        scale, (o, d, c, a) = exact.whole(rays[:, :3], rays[:, 3:], centre, axes)
        self.inverse = exact.cross(np.roll(a, -1, axis=0), np.roll(a, -2, axis=0))  # its rows times det
        det = exact.dot(a[0], self.inverse[0])
        self.f, self.d = (o - c) @ self.inverse.T, d @ self.inverse.T
        self.hits = exact.quadric(self.f, self.d, det * det, scale + 64)

    def normals(self, rays):
        """Unit vectors (R, 3) at the hits of the rays with these numbers, float64."""
        there = (self.f[rays] << self.hits.bits) + self.hits.t[rays, None] * self.d[rays]
        normals = there @ self.inverse
        largest = np.abs(normals).max(axis=1, keepdims=True)
        floats = (normals / largest).astype(np.float64)  # the quotient of two integers is rounded once
        return floats / np.linalg.norm(floats, axis=1, keepdims=True)


def make_trial(axes, precision, rng) -> Trial:
    """Rays at an ellipsoid in general position. axes: lengths of its three semi-axes."""
    spread = max(axes)
    axes = rounded(in_general_position(rng) * np.array(axes)[:, None], precision)
    centre = rounded(rng.normal(size=3), precision)
    aims = centre + WIDEST * rng.uniform(0, 1, (RAYS, 1)) ** (1 / 3) * directions(rng, RAYS) @ axes
    origins = rounded(centre + AWAY * spread * directions(rng, RAYS), precision)
    arms = aims - origins
    rays = np.hstack([origins, rounded(arms / np.linalg.norm(arms, axis=1, keepdims=True), precision)])
    truth = cache(lambda: Truth(rays, centre, axes))

    def judge(result):
        return compare(truth(), result.array)

    ellipsoid = Ellipsoid(exact.MATERIAL, exact.triple(centre), tuple(exact.triple(axis) for axis in axes))
    return Trial(exact.scene(ellipsoid), judge, rays)


def compare(truth: Truth, hits: np.ndarray) -> Finding:
    """Failures are wrong hits and misses; errors are the angles between normals, in radians."""
    finding = truth.hits.compare(hits)
    (both,) = np.nonzero((hits[:, 7] >= 0) & exact.are_proper(hits) & truth.hits.hit)
    true, normals = truth.normals(both), hits[both, 4:7]
    sine = np.linalg.norm(np.cross(true, normals), axis=1)
    return Finding(finding.count, finding.failures, np.arctan2(sine, (true * normals).sum(axis=1)))


def flat(level, precision, rng):
    return make_trial((1.0, 1.0, 1 / level), precision, rng)


def long(level, precision, rng):
    return make_trial((1.0, 1.0, level), precision, rng)


def limit(u, methods):
    """As in S1: in the frame of the unit sphere the origin is AWAY times the ratio of the axes away."""
    return (u**-0.5 if methods.get("sphere") in FORMULAS else 1 / u) / AWAY


THIN = {
    "code": "S5",
    "stress": "longest / shortest semi-axis",
    "failure": "rays that hit or miss wrongly",
    "levels": (1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e10),
    "error": "angle of the normal, rad",
    "method": "sphere",
    "source": "as S1, in the frame where the ellipsoid is the unit sphere",
    "limit": limit,
}
# In the frame of the unit sphere f is off by u times its length, which is AWAY times the ratio of the axes, and the
# naive formulas lose that ratio once more (S1). A hit of a coin moves along its flat side, where the normal hardly
# changes; a hit of a needle moves round it.
ROWS = (
    Row(
        "flat-ellipsoid",
        title="An ellipsoid as flat as a coin",
        make=flat,
        expected=lambda level, u, methods: u * (level if methods.get("sphere") in FORMULAS else 1),
        **THIN,
    ),
    Row(
        "long-ellipsoid",
        title="An ellipsoid as long as a needle",
        make=long,
        expected=lambda level, u, methods: u * (level**2 if methods.get("sphere") in FORMULAS else level),
        **THIN,
    ),
)
