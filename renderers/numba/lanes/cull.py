"""The shapes that a tile can see (VEC-2)."""

import math

from ..target import kernel
from ..vector import UNIT_ROUNDOFF, subtract
from .lanes import COUNT, count_of, numbered, select
from .memory import load, store_some
from .spheres import RADIUS, ROWS, X, Y, Z
from .vector import along, dot

MARGIN = 64 * UNIT_ROUNDOFF  # rays, cone and Δ of SPH-1 are off by less than half of it


@kernel
def meets(balls, count, first, apex, axis, cosine, sine):
    """The balls from column `first` on that a cone can meet.

    cosine, sine: of the angle between axis and side; `cosine` > 0.
    """
    f = subtract((load(balls, X, first), load(balls, Y, first), load(balls, Z, first)), apex)
    radius = load(balls, RADIUS, first)
    height = dot(f, axis)
    aside = along(f, -height, axis)
    width, away = math.sqrt(dot(aside, aside)), math.sqrt(dot(f, f))
    beside = height * cosine + width * sine > 0.0  # else the apex is the nearest of the cone
    apart = select(beside, width * cosine - height * sine, away)
    return ~(apart > radius + MARGIN * (away + radius)) & (numbered() < count - first)


@kernel
def cull_spheres(table, ids, count, apex, axis, cosine, sine, kept, kept_ids):
    """Copy the spheres that a cone can meet; their number."""
    n = 0
    for first in range(0, count, COUNT):
        met = meets(table, count, first, apex, axis, cosine, sine)
        for row in range(ROWS):
            store_some(kept, row, n, load(table, row, first), met)
        store_some(kept_ids, 0, n, load(ids, 0, first), met)
        n += count_of(met)
    return n


@kernel
def cull_others(balls, ids, count, apex, axis, cosine, sine, kept_ids):
    """Copy the numbers of the shapes, in their balls, that a cone can meet; how many."""
    n = 0
    for first in range(0, count, COUNT):
        met = meets(balls, count, first, apex, axis, cosine, sine)
        store_some(kept_ids, 0, n, load(ids, 0, first), met)
        n += count_of(met)
    return n
