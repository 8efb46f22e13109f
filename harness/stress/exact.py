"""Computes exact hits of lists of rays: a float is an integer times a power of two, and Python's integers do not round.

Arrays of integers are NumPy arrays of dtype object. All inputs of a truth are converted to one unit, 2^-scale. Only
homogeneous results are computed from them: signs, and t, which is a ratio.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from harness.scene.model import Camera, Material, Scene
from harness.stress.row import Finding, Trial

MATERIAL = Material((0.5, 0.5, 0.5), 0.0, 1.0, (0.0, 0.0, 0.0), 1.0, 1.0)
NOT_UNIT = 0.01
CAMERA = Camera((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 5.0))  # jobs of kind rays ignore it


def scene(*objects) -> Scene:
    """A scene of these objects without lights."""
    return Scene(CAMERA, objects)


def triple(values) -> tuple[float, float, float]:
    x, y, z = map(float, values)
    return x, y, z


def whole(*arrays) -> tuple[int, list[np.ndarray]]:
    """Returns the scale, and each array of floats as integers in units of 2^-scale."""
    parts = [np.frexp(np.asarray(array, dtype=np.float64)) for array in arrays]
    scale = max(int((53 - e)[m != 0].max(initial=0)) for m, e in parts)
    integers = []
    for m, e in parts:
        shift = np.where(m == 0, 0, e - 53 + scale)
        integers.append((m * 2.0**53).astype(np.int64).astype(object) << shift.astype(object))
    return scale, integers


def dot(a, b):
    return (a * b).sum(axis=-1)


def cross(a, b):
    turn, back = [1, 2, 0], [2, 0, 1]
    return a[..., turn] * b[..., back] - a[..., back] * b[..., turn]


def sign(values) -> np.ndarray:
    """The signs of integers: -1, 0 or 1."""
    return (values > 0).astype(int) - (values < 0).astype(int)


_root = np.frompyfunc(math.isqrt, 1, 1)


def are_proper(hits: np.ndarray) -> np.ndarray:
    """Which of hits (R, 8) are finite, with a normal of unit length: bool (R,)."""
    with np.errstate(invalid="ignore", over="ignore"):
        length = np.square(hits[:, 4:7]).sum(axis=1)
        return np.isfinite(hits[:, :7]).all(axis=1) & (np.abs(length - 1) < NOT_UNIT)


@dataclass(frozen=True)
class Truth:
    """hit: bool (R,). t: integers (R,), of rays that hit; in units of 2^-bits times the length of the direction."""

    hit: np.ndarray
    t: np.ndarray
    bits: int

    def apart(self, t: np.ndarray, rays: np.ndarray) -> np.ndarray:
        """|t - truth| of the rays with these numbers, rounded once, to float64."""

        def difference(value, true):
            above, below = float(value).as_integer_ratio()
            return abs((above << self.bits) - true * below) / (below << self.bits)

        return np.array([difference(*pair) for pair in zip(t, self.t[rays], strict=True)], dtype=np.float64)

    def values(self, rays: np.ndarray) -> np.ndarray:
        """t of the rays with these numbers, float64."""
        return np.array([true / (1 << self.bits) for true in self.t[rays]], dtype=np.float64)

    def compare(self, hits: np.ndarray, unit: float | None = 1.0, worst: float = math.inf) -> Finding:
        """Judges hits (R, 8). Errors are |t - truth| / unit; unit None: relative errors.

        A failure is a wrong hit, a wrong miss, a hit that is not `are_proper` and one whose error is above `worst`.
        """
        hit, proper = hits[:, 7] >= 0, are_proper(hits)
        (both,) = np.nonzero(hit & proper & self.hit)
        errors = self.apart(hits[both, 0], both) / (self.values(both) if unit is None else unit)
        failures = (hit != self.hit) | (hit & ~proper)
        failures[both] |= errors > worst
        return Finding(len(hits), int(failures.sum()), errors)


def first(near, far, line, bits) -> Truth:
    """The smaller of two roots with t > 0. line: bool (R,), whether the ray's line meets the surface."""
    return Truth(line & (far > 0), np.where(near > 0, near, far), bits)


def quadric(f, d, square, bits) -> Truth:
    """The first hit of |f + t d|² = square. f, d: integers (R, 3) in one unit; square: in the square of that unit."""
    a, b, c = dot(d, d), dot(f, d), dot(f, f) - square
    discriminant = b * b - a * c
    line = (discriminant >= 0).astype(bool)
    root = _root(np.where(line, discriminant, 0) << 2 * bits)
    return first((-(b << bits) - root) // a, (-(b << bits) + root) // a, line, bits)


def sphere(rays: np.ndarray, centre, radius: float) -> Truth:
    scale, (o, d, c, r) = whole(rays[:, :3], rays[:, 3:], centre, radius)
    return quadric(o - c, d, r * r, scale + 64)


def outline(rays: np.ndarray, loop: np.ndarray) -> np.ndarray:
    """Tells which rays' lines pass through a convex loop of points (R or 1, m, 3), or touch it: bool (R,)."""
    _, (o, d, v) = whole(rays[:, :3], rays[:, 3:], loop)
    return _through(o, d, v)


def _through(o, d, v) -> np.ndarray:
    """`outline` of integers. A line passes all edges on the same side: each edge and a stretch of the line span a
    volume, and the signs of these volumes are equal."""
    arms = v - o[:, None]
    sides = sign(dot(d[:, None], cross(arms, np.roll(arms, -1, axis=1))))
    return ((sides >= 0).all(axis=1) | (sides <= 0).all(axis=1)) & (sides != 0).any(axis=1)


def triangle(rays: np.ndarray, corners: np.ndarray) -> Truth:
    """The truth for triangles (R or 1, 3, 3): one for each ray, or one for all."""
    scale, (o, d, v) = whole(rays[:, :3], rays[:, 3:], corners)
    a, bits = v[:, 0], scale + 64
    normal = cross(v[:, 1] - a, v[:, 2] - a)
    height, fall = dot(a - o, normal), dot(d, normal)
    line = _through(o, d, v) & (fall != 0).astype(bool)
    t = (height << bits) // np.where(line, fall, 1)
    return Truth(line & (t > 0).astype(bool), t, bits)


def trial(
    rays: np.ndarray, truth: Callable[[], Truth], *objects, unit: float | None = None, worst: float = math.inf
) -> Trial:
    """Trial of rays (R, 6) on these objects. truth: called once, when a result is judged; unit, worst: of `compare`."""
    reference = cache(truth)
    return Trial(scene(*objects), lambda result: reference().compare(result.array, unit, worst), rays)


def must_hit(result) -> Finding:
    """Judges the hits of rays that all hit something: a failure is a miss, or a hit that is not `are_proper`."""
    hits = result.array
    return Finding(len(hits), int((~((hits[:, 7] >= 0) & are_proper(hits))).sum()))
