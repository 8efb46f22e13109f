"""Meshes: their triangles, each a shape of its own."""

import numpy as np

from ..needs import FAR, TRIANGLE
from ..target import inlined, kernel
from ..vector import along, cross, dot, negate, row_of, subtract
from .fused import difference_of_products

# What a row of the table holds, three of each: three vertices and the normal.
VERTEX, NORMAL = 0, 3


def triangle_table(vertices, triangles):
    """(T, 4, 3), vertices and normal (TRI-2), and the size (T,) of each triangle (OFF-1), in float64 (NUM-1)."""
    v = vertices[triangles]
    normal = np.cross(v[:, 1] - v[:, 0], v[:, 2] - v[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return np.concatenate([v, normal[:, None]], axis=1), np.abs(v - v[:, :1]).max(axis=(1, 2), initial=0)


def rows_of(ranges):
    """The rows that ranges (n, .) of first and number name, one range after the other."""
    return np.concatenate([np.arange(first, first + count) for first, count in ranges[:, :2]] + [np.zeros(0, np.int64)])


@kernel
def shear(origin, direction):
    """The ray's data for TRI-1: the three axes, and S and the origin along them."""
    x, y, z = abs(direction[0]), abs(direction[1]), abs(direction[2])
    d = direction
    if x >= y and x >= z:
        kx, ky, kz = 1, 2, 0
        s, o = (d[1], d[2], d[0]), (origin[1], origin[2], origin[0])
    elif y >= z:
        kx, ky, kz = 2, 0, 1
        s, o = (d[2], d[0], d[1]), (origin[2], origin[0], origin[1])
    else:
        kx, ky, kz = 0, 1, 2
        s, o = (d[0], d[1], d[2]), (origin[0], origin[1], origin[2])
    if s[2] < 0:
        kx, ky = ky, kx
        s, o = (s[1], s[0], s[2]), (o[1], o[0], o[2])
    return (kx, ky, kz), (s[0] / s[2], s[1] / s[2], type(s[2])(1) / s[2]), o


@kernel
def sheared(triangles, i, k, ray):
    """Vertex `k` of triangle `i` seen along the ray (TRI-1)."""
    axes, s, o = ray
    x, y = triangles[i, k, axes[0]] - o[0], triangles[i, k, axes[1]] - o[1]
    z = triangles[i, k, axes[2]] - o[2]
    return x - s[0] * z, y - s[1] * z, s[2] * z


@inlined
def hit_watertight(triangles, i, ray):
    """Distance to triangle `i` (TRI-1), which may be negative; FAR for a miss. ray: of `shear`."""
    a, b, c = sheared(triangles, i, 0, ray), sheared(triangles, i, 1, ray), sheared(triangles, i, 2, ray)
    u, v, w = c[0] * b[1] - c[1] * b[0], a[0] * c[1] - a[1] * c[0], b[0] * a[1] - b[1] * a[0]
    if (u >= 0 and v >= 0 and w >= 0) or (u <= 0 and v <= 0 and w <= 0):
        det = u + v + w
        if det != 0:
            return (u * a[2] + v * b[2] + w * c[2]) / det
    return type(u)(FAR)


@inlined
def hit_kahan(triangles, i, ray):
    """The same with U, V and W such that the two triangles of an edge agree, fused or not (TRI-3)."""
    a, b, c = sheared(triangles, i, 0, ray), sheared(triangles, i, 1, ray), sheared(triangles, i, 2, ray)
    u = difference_of_products(c[0], b[1], c[1], b[0])
    v = difference_of_products(a[0], c[1], a[1], c[0])
    w = difference_of_products(b[0], a[1], b[1], a[0])
    if (u >= 0 and v >= 0 and w >= 0) or (u <= 0 and v <= 0 and w <= 0):
        det = u + v + w
        if det != 0:
            return (u * a[2] + v * b[2] + w * c[2]) / det
    return type(u)(FAR)


@kernel
def as_it_is(origin, direction):
    return origin, direction


@inlined
def hit_trumbore(triangles, i, ray):
    """The same by Möller and Trumbore (TRI-3). ray: origin, direction."""
    origin, direction = ray
    v0 = row_of(triangles, i, VERTEX)
    e1, e2 = subtract(row_of(triangles, i, VERTEX + 1), v0), subtract(row_of(triangles, i, VERTEX + 2), v0)
    p = cross(direction, e2)
    det = dot(e1, p)
    if det != 0:
        aside = subtract(origin, v0)
        u = dot(aside, p) / det
        if u >= 0:
            q = cross(aside, e1)
            v = dot(direction, q) / det
            if v >= 0 and u + v <= 1:
                return dot(e2, q) / det
    return type(det)(FAR)


# What is made of a ray once for all triangles, and the distance to one of them.
aimed, hit_triangle = {
    "watertight": (shear, hit_watertight),
    "watertight-kahan": (shear, hit_kahan),
    "moller-trumbore": (as_it_is, hit_trumbore),
}[TRIANGLE]


@kernel
def positive(side, first, second):
    """Whether `side` counts as positive, at 0 by its edge from `first` to `second` (CSG-2)."""
    if side != 0:
        return side > 0
    x, y = second[0] - first[0], second[1] - first[1]
    return y > 0 or (y == 0 and x > 0)


@kernel
def cross_triangle(triangles, i, ray):
    """Where the line crosses triangle `i` (CSG-2); FAR if it does not."""
    a, b, c = sheared(triangles, i, 0, ray), sheared(triangles, i, 1, ray), sheared(triangles, i, 2, ray)
    u, v, w = c[0] * b[1] - c[1] * b[0], a[0] * c[1] - a[1] * c[0], b[0] * a[1] - b[1] * a[0]
    det = u + v + w
    plus = positive(u, b, c)
    if det != 0 and plus == positive(v, c, a) and plus == positive(w, a, b):
        return (u * a[2] + v * b[2] + w * c[2]) / det
    return type(u)(FAR)


@kernel
def nearest_triangle(triangles, origin, direction, best, index, first):
    """The nearer of the hit (`best`, `index`) so far and the triangles', numbered from `first` (HIT-2)."""
    ray = aimed(origin, direction)
    for i in range(len(triangles)):
        t = hit_triangle(triangles, i, ray)
        if t < best and t > 0:
            best, index = t, first + i
    return best, index


@kernel
def any_triangle(triangles, origin, direction, limit):
    """HIT-5."""
    ray = aimed(origin, direction)
    for i in range(len(triangles)):
        t = hit_triangle(triangles, i, ray)
        if t < limit and t > 0:
            return True
    return False


@kernel
def triangle_surface(triangles, i, origin, direction, t, flat):
    """Point and normal of the hit at `t` on triangle `i`: outward, or towards the ray if `flat` (TRI-2)."""
    normal = row_of(triangles, i, NORMAL)
    p = along(origin, t, direction)
    p = along(p, -dot(subtract(p, row_of(triangles, i, VERTEX)), normal), normal)
    if flat and dot(direction, normal) > 0:
        return p, negate(normal)
    return p, normal
