"""Ellipsoids: a centre and three semi-axes, at any angle to each other."""

import math

import numpy as np

from ..needs import FAR
from ..target import inlined, kernel
from ..vector import add, along, dot, normalise, row_of, scale, subtract
from .box import reciprocal
from .quadratic import QUADRATIC, root

# What a row of the table holds, three of each but the centre.
CENTRE, AXIS, RECIPROCAL = 0, 1, 4


def ellipsoid_table(ellipsoids):
    """(E, 12), centre and semi-axes, to the (E, 7, 3) that the kernel reads."""
    parts = ellipsoids.reshape(-1, 4, 3)
    return np.concatenate([parts, reciprocal(parts[:, 1:])], axis=1)


@kernel
def to_sphere(ellipsoids, i, v):
    """The vector `v` where ellipsoid `i` is the unit sphere."""
    return (
        dot(row_of(ellipsoids, i, RECIPROCAL), v),
        dot(row_of(ellipsoids, i, RECIPROCAL + 1), v),
        dot(row_of(ellipsoids, i, RECIPROCAL + 2), v),
    )


@kernel
def combine(ellipsoids, i, first, mu):
    """The sum of three rows of ellipsoid `i` from `first` on, weighted by `mu`."""
    total = scale(mu[0], row_of(ellipsoids, i, first))
    total = along(total, mu[1], row_of(ellipsoids, i, first + 1))
    return along(total, mu[2], row_of(ellipsoids, i, first + 2))


@inlined
def hit_robust(ellipsoids, i, origin, direction):
    """Distance to ellipsoid `i` (ELL-1); FAR for a miss. ellipsoids: (E, 7, 3)."""
    one = type(direction[0])(1)
    f = to_sphere(ellipsoids, i, subtract(origin, row_of(ellipsoids, i, CENTRE)))
    d = to_sphere(ellipsoids, i, direction)
    a = dot(d, d)
    b = -dot(f, d)
    l = along(f, b / a, d)  # noqa: E741
    delta = one - dot(l, l)
    if delta >= 0:
        k = dot(f, f) - one
        s = math.sqrt(a * delta)
        if k > 0:
            if b > 0:
                return k / (b + s)
        elif b >= 0:
            return (b + s) / a
        else:
            return k / (b - s)
    return type(b)(FAR)


@inlined
def hit_quadratic(ellipsoids, i, origin, direction):
    """The same from the roots of the quadratic equation (ELL-3)."""
    f = to_sphere(ellipsoids, i, subtract(origin, row_of(ellipsoids, i, CENTRE)))
    d = to_sphere(ellipsoids, i, direction)
    real = type(direction[0])
    return root(dot(d, d), real(2) * dot(f, d), dot(f, f) - real(1))


hit_ellipsoid = hit_quadratic if QUADRATIC else hit_robust


@kernel
def span_ellipsoid(ellipsoids, i, origin, direction):
    """Where the line enters and leaves ellipsoid `i` (CSG-1); FAR, -FAR if it does not."""
    one = type(direction[0])(1)
    f = to_sphere(ellipsoids, i, subtract(origin, row_of(ellipsoids, i, CENTRE)))
    d = to_sphere(ellipsoids, i, direction)
    a = dot(d, d)
    b = -dot(f, d)
    l = along(f, b / a, d)  # noqa: E741
    delta = one - dot(l, l)
    infinity = type(b)(FAR)
    if not delta >= 0:
        return infinity, -infinity
    k, s = dot(f, f) - one, math.sqrt(a * delta)
    if b < 0:
        return (b - s) / a, k / (b - s)
    if b + s == 0:
        return b, b
    return k / (b + s), (b + s) / a


@kernel
def nearest_ellipsoid(ellipsoids, origin, direction, best, index, first):
    """The nearer of the hit (`best`, `index`) so far and the ellipsoids', numbered from `first` (HIT-2)."""
    for i in range(len(ellipsoids)):
        t = hit_ellipsoid(ellipsoids, i, origin, direction)
        if t < best and t > 0:
            best, index = t, first + i
    return best, index


@kernel
def any_ellipsoid(ellipsoids, origin, direction, limit):
    """HIT-5."""
    for i in range(len(ellipsoids)):
        t = hit_ellipsoid(ellipsoids, i, origin, direction)
        if t < limit and t > 0:
            return True
    return False


@kernel
def ellipsoid_surface(ellipsoids, i, origin, direction, t):
    """Point and normal of the hit at `t` on ellipsoid `i` (ELL-2)."""
    centre = row_of(ellipsoids, i, CENTRE)
    f = to_sphere(ellipsoids, i, subtract(origin, centre))
    mu = normalise(along(f, t, to_sphere(ellipsoids, i, direction)))
    normal = normalise(combine(ellipsoids, i, RECIPROCAL, mu))
    return add(centre, combine(ellipsoids, i, AXIS, mu)), normal
