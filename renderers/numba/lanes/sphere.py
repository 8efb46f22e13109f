"""Spheres, one after the other against a packet of rays, and those that a tile can see."""

import math

import numpy as np

from ..target import kernel
from ..vector import UNIT_ROUNDOFF, subtract
from .lanes import COUNT, any_of, count_of, numbered, select, spread
from .memory import load, store_some
from .vector import along, dot

# Rows of a table of spheres, a column each: centre, r, r², and the b of a hit behind whose like there is none.
X, Y, Z, RADIUS, SQUARE, BEHIND = range(6)
ROWS = 6

MARGIN = 64 * UNIT_ROUNDOFF  # of VEC-2: rays, cone and Δ of SPH-1 are off by less than half of it


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
def occluded(table, count, origin, direction, limit, asked):
    """The lanes of the mask `asked` whose feeler is stopped before its limit (HIT-5)."""
    open_ = asked
    for i in range(count):
        f, b, delta, near = approach(table, i, origin, direction)
        near = near & open_
        if any_of(near):
            t = distance(f, b, delta, table[SQUARE, i])
            open_ = open_ & ~(near & (t > 0.0) & (t < limit))
            if not any_of(open_):
                break
    return asked & ~open_


@kernel
def cull(table, ids, count, apex, axis, cosine, sine, kept, kept_ids):
    """Copy the spheres that a cone can meet (VEC-2); their number.

    cosine, sine: of the angle between axis and side; `cosine` > 0.
    """
    n = 0
    for first in range(0, count, COUNT):
        f = subtract((load(table, X, first), load(table, Y, first), load(table, Z, first)), apex)
        radius = load(table, RADIUS, first)
        height = dot(f, axis)
        aside = along(f, -height, axis)
        width, away = math.sqrt(dot(aside, aside)), math.sqrt(dot(f, f))
        beside = height * cosine + width * sine > 0.0  # else the apex is the nearest of the cone
        apart = select(beside, width * cosine - height * sine, away)
        meets = ~(apart > radius + MARGIN * (away + radius)) & (numbered() < count - first)
        for row in range(ROWS):
            store_some(kept, row, n, load(table, row, first), meets)
        store_some(kept_ids, 0, n, load(ids, 0, first), meets)
        n += count_of(meets)
    return n
