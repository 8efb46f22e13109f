"""Convex planar polygons: their vertices."""

import numpy as np

from .needs import FAR
from .target import inlined, kernel
from .vector import along, dot, negate, row_of, subtract

# What a row of the table of corners holds, three of each.
VERTEX, INWARD, NORMAL = 0, 1, 2


def polygon_table(vertices, ranges):
    """Corners (V, 3, 3) and sizes (P,) of polygons, in float64 (NUM-1).

    A corner is a vertex, N x the edge from it (POL-2), and the normal N of its polygon (POL-1).
    """
    corners = np.zeros((len(vertices), 3, 3))
    sizes = np.zeros(len(ranges))
    for i, (first, count) in enumerate(ranges):
        v = vertices[first : first + count]
        following = np.roll(v, -1, axis=0)
        newell = np.cross(v - v[0], following - v[0]).sum(axis=0)
        normal = newell / np.linalg.norm(newell)
        corners[first : first + count, VERTEX] = v
        corners[first : first + count, INWARD] = np.cross(normal, following - v)
        corners[first : first + count, NORMAL] = normal
        sizes[i] = np.abs(v - v[0]).max()
    return corners, sizes


@inlined
def hit_polygon(corners, ranges, i, origin, direction, limit):
    """Distance to polygon `i` if not above `limit` (POL-1, POL-2); FAR for a miss.

    corners: (V, 3, 3). ranges: (P, 2), first corner and number of corners.
    """
    first, count = ranges[i, 0], ranges[i, 1]
    normal = row_of(corners, first, NORMAL)
    w = dot(direction, normal)
    if w == 0:
        return type(w)(FAR)
    t = dot(subtract(row_of(corners, first, VERTEX), origin), normal) / w
    if 0 < t <= limit:
        p = along(origin, t, direction)
        for k in range(first, first + count):
            inside = dot(row_of(corners, k, INWARD), subtract(p, row_of(corners, k, VERTEX))) >= 0
            if not inside:
                return type(w)(FAR)
    return t


@kernel
def nearest_polygon(corners, ranges, origin, direction, best, index, first):
    """The nearer of the hit (`best`, `index`) so far and the polygons', numbered from `first` (HIT-2)."""
    for i in range(len(ranges)):
        t = hit_polygon(corners, ranges, i, origin, direction, best)
        if t < best and t > 0:
            best, index = t, first + i
    return best, index


@kernel
def any_polygon(corners, ranges, origin, direction, limit):
    """HIT-5."""
    for i in range(len(ranges)):
        t = hit_polygon(corners, ranges, i, origin, direction, limit)
        if t < limit and t > 0:
            return True
    return False


@kernel
def polygon_surface(corners, ranges, i, origin, direction, t):
    """Point and normal, towards the ray, of the hit at `t` on polygon `i` (POL-3)."""
    first = ranges[i, 0]
    normal = row_of(corners, first, NORMAL)
    p = along(origin, t, direction)
    above = dot(subtract(p, row_of(corners, first, VERTEX)), normal)
    p = along(p, -above, normal)
    if dot(direction, normal) < 0:
        return p, normal
    return p, negate(normal)
