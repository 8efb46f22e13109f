"""Checks shapes for faults. A check returns the first `Fault` or None, and does not depend on the scale.

All numbers must be at most LARGEST in size.
"""

import math
from itertools import pairwise
from typing import NamedTuple

# With lengths in this range no product in a renderer overflows float64; the largest is aΔ of ELL-1, for an almost flat
# ellipsoid with semi-axes of the smallest length and an origin at the largest distance.
SMALLEST = 1e-30
LARGEST = 1e30

# A box is flat if its volume is at most this share of the product of its edges, a polygon if its area is at most this
# share of its extent squared. Rounding alone makes about 1e-16; below 1e-9 a reciprocal vector has too few digits.
FLAT = 1e-9

# Tolerance, of the largest extent or of a radian, for numbers that were written with six digits.
SLACK = 1e-6


# The smallest roughness that is not 0. Its lobe is some 1e-6 wide, and float32 can still hold its exponent (GLO-2).
SMOOTHEST = 1e-6


class Fault(NamedTuple):
    """A fault. index: of the faulty vector, in the order of the file; text: what is wrong."""

    index: int
    text: str
    remedy: str | None = None


class Concave(Fault):
    """A polygon is concave. It passes all checks of `polygon` that come before."""


def screen(u, v):
    """The camera's half-extents: not zero, at right angles."""
    fault = _zero((u, v), "uv")
    if fault:
        return fault
    if abs(dot(u, v)) > SLACK * length(u) * length(v):
        cosine = dot(u, v) / (length(u) * length(v))
        return Fault(1, f"u and v must be at right angles; the cosine between them is {cosine:.3g}")
    return None


def eye(u, v, e):
    """The camera's `e`: not zero, not in the plane of the screen. `u` and `v` passed `screen`."""
    if length(e) < SMALLEST:
        return Fault(0, "e has no length; the eye must lie off the screen")
    if _dependent(u, v, e):
        return Fault(0, "e lies in the plane of u and v; the eye must lie off the screen")
    return None


def slant(u, v, e):
    """Angle in degrees between the camera's `e` and the normal of its screen, on either side; 0 within SLACK."""
    normal = cross(u, v)
    angle = math.atan2(length(cross(normal, e)), abs(dot(normal, e)))
    return math.degrees(angle) if angle > SLACK else 0.0


def box(edges):
    """Three edges: none zero, together a volume."""
    return _frame(edges, "edge", "edges")


def ellipsoid(axes):
    """Three semi-axes: none zero, together a volume."""
    return _frame(axes, "semi-axis", "semi-axes")


def polygon(vertices):
    """Three or more vertices: distinct, not in line, planar, and once round a convex outline.

    Vertices inside a straight side are allowed.
    """
    count = len(vertices)
    arms = [subtract(v, vertices[0]) for v in vertices]
    extent = max(length(arm) for arm in arms)
    edges = [subtract(vertices[(i + 1) % count], v) for i, v in enumerate(vertices)]
    for i, edge in enumerate(edges):
        if length(edge) <= FLAT * extent or length(edge) < SMALLEST:
            after = (i + 1) % count
            return Fault(max(i, after), f"vertices {i + 1} and {after + 1} are the same point")

    longest = max(arms, key=length)
    if all(length(cross(arm, longest)) <= FLAT * extent * extent for arm in arms):
        return Fault(0, "the vertices lie on one line")
    parts = [cross(arm, after) for arm, after in pairwise(arms)]
    area = [math.fsum(axis) for axis in zip(*parts, strict=True)]  # POL-1; twice the area
    if length(area) <= FLAT * extent * extent:
        return Fault(0, "the polygon crosses itself")
    normal = unit(area)
    distances = [abs(dot(normal, arm)) for arm in arms]
    worst = max(range(count), key=distances.__getitem__)
    if distances[worst] > SLACK * extent:
        off = f"vertex {worst + 1} is off by {distances[worst] / extent:.3g} of its extent"
        return Fault(worst, f"the polygon is not planar; {off}")

    turns = [_turn(normal, edges[i - 1], edges[i]) for i in range(count)]
    for i, turn in enumerate(turns):
        if turn < -SLACK:
            why = f"the polygon is not convex; it turns inward at vertex {i + 1}"
            return Concave(i, why, "cut it into convex ones, or make it a MESH")
    if math.fsum(turns) > 3 * math.pi:
        return Fault(0, "the polygon crosses itself; its outline goes round more than once")
    return None


def _frame(vectors, name, names):
    fault = _zero(vectors, [f"{name} {i}" for i in (1, 2, 3)])
    if fault:
        return fault
    if _dependent(*vectors):
        return Fault(2, f"the three {names} lie in one plane; they span no volume")
    return None


def _zero(vectors, names):
    for i, (vector, name) in enumerate(zip(vectors, names, strict=True)):
        if length(vector) < SMALLEST:
            return Fault(i, f"{name} has no length")
    return None


def _dependent(a, b, c):
    return abs(dot(a, cross(b, c))) <= FLAT * length(a) * length(b) * length(c)


def _turn(normal, before, after):
    """Angle from one edge to the next, in radians, positive to the left as seen against `normal`."""
    return math.atan2(dot(normal, cross(before, after)), dot(before, after))


def subtract(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def length(a):
    return math.hypot(*a)


def unit(a):
    size = length(a)
    return (a[0] / size, a[1] / size, a[2] / size)
