"""Convex planar polygons: their vertices."""

import numpy as np

from ..needs import FAR, TRIANGLE
from ..target import inlined, kernel
from ..vector import UNIT_ROUNDOFF, along, dot, negate, row_of, subtract
from .fused import difference_of_products
from .mesh import aimed, sheared

# What a row of the table of corners holds, three of each.
VERTEX, INWARD, NORMAL = 0, 1, 2

GRAZING = 2.0**-10  # |w| of POL-1 below which rounding can move t past the polygon
KAHAN = TRIANGLE == "watertight-kahan"


def polygon_table(vertices, ranges):
    """Corners (V, 3, 3) and sizes (P,) of polygons, in float64 (NUM-1).

    A corner is a vertex, N x the edge from it (POL-4), and the normal N of its polygon (POL-1).
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


@kernel
def edge_function(a, b):
    """Of the edge between two sheared vertices (POL-2)."""
    if KAHAN:
        return difference_of_products(a[0], b[1], a[1], b[0])
    return a[0] * b[1] - a[1] * b[0]


@kernel
def cross_fan(corners, first, count, ray):
    """Where the line crosses a triangle v_0, v_i, v_(i+1) of a polygon, by TRI-1; FAR if it crosses none (POL-2).

    ray: of `shear`.
    """
    a, b = sheared(corners, first, VERTEX, ray), sheared(corners, first + 1, VERTEX, ray)
    w = edge_function(a, b)
    for k in range(first + 2, first + count):
        c = sheared(corners, k, VERTEX, ray)
        u, v = edge_function(b, c), edge_function(c, a)
        if (u >= 0 and v >= 0 and w >= 0) or (u <= 0 and v <= 0 and w <= 0):
            det = u + v + w
            if det != 0:
                return (u * a[2] + v * b[2] + w * c[2]) / det
        w, b = -v, c
    return type(w)(FAR)


@kernel
def rounding_of_height(vertex, origin, normal):
    """The most that rounding can make of the distance of `origin` from the plane, where it lies in it (POL-1)."""
    x, y, z = abs(vertex[0]) + abs(origin[0]), abs(vertex[1]) + abs(origin[1]), abs(vertex[2]) + abs(origin[2])
    eight_u = type(x)(8 * UNIT_ROUNDOFF)
    return eight_u * (abs(normal[0]) * x + abs(normal[1]) * y + abs(normal[2]) * z)


@inlined
def hit_watertight(corners, ranges, i, origin, direction, limit, ray):
    """Distance to polygon `i` if not above `limit` (POL-1, POL-2); FAR for a miss.

    corners: (V, 3, 3). ranges: (P, 2), first corner and number of corners. ray: of `aimed`.
    """
    first, count = ranges[i, 0], ranges[i, 1]
    normal = row_of(corners, first, NORMAL)
    w = dot(direction, normal)
    if w == 0:
        return type(w)(FAR)
    vertex = row_of(corners, first, VERTEX)
    height = dot(subtract(vertex, origin), normal)
    t = height / w
    grazes = abs(w) < type(w)(GRAZING)
    if grazes or 0 < t <= limit:
        crossing = cross_fan(corners, first, count, ray)
        if abs(height) <= rounding_of_height(vertex, origin, normal):
            return type(w)(FAR)
        if grazes or crossing == type(w)(FAR):
            return crossing
    return t


@inlined
def hit_in_plane(corners, ranges, i, origin, direction, limit, _ray):
    """The same in the polygon's own plane (POL-4)."""
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


hit_polygon = hit_in_plane if TRIANGLE == "moller-trumbore" else hit_watertight


@kernel
def nearest_polygon(corners, ranges, origin, direction, best, index, first):
    """The nearer of the hit (`best`, `index`) so far and the polygons', numbered from `first` (HIT-2)."""
    ray = aimed(origin, direction)
    for i in range(len(ranges)):
        t = hit_polygon(corners, ranges, i, origin, direction, best, ray)
        if t < best and t > 0:
            best, index = t, first + i
    return best, index


@kernel
def any_polygon(corners, ranges, origin, direction, limit):
    """HIT-5."""
    ray = aimed(origin, direction)
    for i in range(len(ranges)):
        t = hit_polygon(corners, ranges, i, origin, direction, limit, ray)
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
