"""Spheres, one after the other against a packet of rays."""

import math

import numpy as np

from ..target import kernel
from ..vector import subtract
from .lanes import any_of, select, spread
from .vector import along, dot

# Rows of a table of spheres, a column each: centre, r, r², and the b of a hit behind whose like there is none.
X, Y, Z, RADIUS, SQUARE, BEHIND = range(6)
ROWS = 6


@kernel
def approach(table, i, origin, direction):
    """f, b and Δ of SPH-1 for sphere `i`, and the lanes that may meet it."""
    f = subtract(origin, (table[X, i], table[Y, i], table[Z, i]))
    b = -dot(f, direction)
    l = along(f, b, direction)  # noqa: E741
    delta = table[SQUARE, i] - dot(l, l)
    return f, b, delta, (delta >= 0.0) & (b >= table[BEHIND, i])


@kernel
def distance(f, b, delta, square):
    """t of SPH-1 where Δ ≥ 0; not above 0 for a miss."""
    k, root = dot(f, f) - square, math.sqrt(delta)
    ahead = b > 0.0
    q = select(ahead, b + root, b - root)
    return select((k > 0.0) | ~ahead, k / q, q)


@kernel
def nearest(table, ids, count, origin, direction):
    """Distance to the nearest of `count` spheres and its number; inf and -1 for a miss (HIT-1, HIT-2)."""
    best, index = spread(math.inf), spread(np.int32(-1))
    for i in range(count):
        f, b, delta, near = approach(table, i, origin, direction)
        if any_of(near):
            t = distance(f, b, delta, table[SQUARE, i])
            nearer = near & (t > 0.0) & (t < best)
            best, index = select(nearer, t, best), select(nearer, ids[0, i], index)
    return best, index


@kernel
def unstopped(table, count, origin, direction, limit, asked):
    """The lanes of the mask `asked` whose ray meets no sphere before its limit (HIT-5)."""
    open_ = asked
    for i in range(count):
        f, b, delta, near = approach(table, i, origin, direction)
        near = near & open_
        if any_of(near):
            t = distance(f, b, delta, table[SQUARE, i])
            open_ = open_ & ~(near & (t > 0.0) & (t < limit))
            if not any_of(open_):
                break
    return open_
