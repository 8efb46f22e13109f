"""S14: rays beside the edges of a polygon, and level with its vertices."""

from functools import cache

import numpy as np

from harness.scene.model import Polygon
from harness.stress import exact
from harness.stress.row import Finding, Row, Trial, directions, in_general_position, rounded

RAYS = 8_000
DIAMOND = np.array([[0.0, 0, 0], [2, -1, 0], [4, 0, 0], [2, 1, 0]])
SIZE = 4.0
AWAY = 3.0  # distance of the origins
STEEPEST = 0.3  # smallest cosine between ray and normal


def points(level, rng):
    """Points of the diamond's plane (R, 3): just inside or outside the edges, or level with a vertex."""
    off = level * SIZE * rng.choice((-1, 1), RAYS)
    number = rng.integers(0, 4, RAYS)
    start, edge = DIAMOND[number], np.roll(DIAMOND, -1, axis=0)[number] - DIAMOND[number]
    outward = np.cross(edge, [0, 0, 1]) / np.linalg.norm(edge, axis=1, keepdims=True)
    beside = start + rng.uniform(0.05, 0.95, (RAYS, 1)) * edge + off[:, None] * outward
    # Level with a vertex: only x differs.
    level_with = start + np.stack([off, 0 * off, 0 * off], axis=1)
    return np.where(rng.uniform(0, 1, (RAYS, 1)) < 0.75, beside, level_with)


def make_trial(vertices, rays) -> Trial:
    truth = cache(lambda: exact.outline(rays, vertices[None]))

    def judge(result):
        hit = result.array[:, 7] >= 0
        wrong = (hit != truth()) | (hit & ~exact.are_proper(result.array))
        return Finding(len(rays), int(wrong.sum()))

    return Trial(exact.scene(Polygon(exact.MATERIAL, tuple(map(exact.triple, vertices)))), judge, rays)


def generic(level, precision, rng):
    turn, move = in_general_position(rng), rng.normal(size=3)
    vertices = rounded(DIAMOND @ turn + move, precision)
    d = directions(rng, RAYS)
    d[:, 2] = np.copysign(np.maximum(np.abs(d[:, 2]), STEEPEST), d[:, 2])
    d = rounded(d / np.linalg.norm(d, axis=1, keepdims=True) @ turn, precision)
    return make_trial(vertices, np.hstack([rounded(points(level, rng) @ turn + move - AWAY * d, precision), d]))


def along_axis(level, precision, rng):
    d = np.tile([0.0, 0, -1], (RAYS, 1))
    return make_trial(DIAMOND, np.hstack([rounded(points(level, rng) - AWAY * d, precision), d]))


BESIDE = {
    "code": "S14",
    "stress": "distance from the edge / size of the polygon",
    "failure": "rays that hit or miss wrongly",
    "levels": (1e-1, 1e-2, 1e-4, 1e-6, 1e-7, 1e-8, 1e-10, 1e-12, 1e-14, 1e-16),
    "source": "Haines, Point in polygon strategies, Graphics Gems IV",
}
ROWS = (
    # A point in the plane is off by u times its distance from the ray's origin, and by u times its coordinates.
    Row(
        "polygon-edges",
        title="Rays beside the edges of a polygon",
        make=generic,
        limit=lambda u, methods: u * (AWAY + SIZE) / SIZE,
        **BESIDE,
    ),
    Row(
        "polygon-edges-aligned",
        title="Rays beside the edges of a polygon, along an axis and level with its vertices",
        make=along_axis,
        aligned="polygon-edges",
        **BESIDE,
    ),
)
