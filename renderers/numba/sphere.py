"""Spheres: centre and radius."""

import math

from .target import inlined, kernel
from .vector import along, dot, normalise, row, subtract


@inlined
def hit_sphere(spheres, i, origin, direction):
    """Distance to sphere `i`, in the robust form of SPH-1; inf for a miss. spheres: (S, 4)."""
    f = subtract(origin, row(spheres, i))
    radius_squared = spheres[i, 3] * spheres[i, 3]
    b = -dot(f, direction)
    l = along(f, b, direction)  # noqa: E741
    delta = radius_squared - dot(l, l)
    if delta >= 0:
        k = dot(f, f) - radius_squared
        if k > 0:
            if b > 0:
                return k / (b + math.sqrt(delta))
        elif b >= 0:
            return b + math.sqrt(delta)
        else:
            return k / (b - math.sqrt(delta))
    return type(b)(math.inf)


@kernel
def span_sphere(spheres, i, origin, direction):
    """Where the line enters and leaves sphere `i` (CSG-1); inf, -inf if it does not."""
    f = subtract(origin, row(spheres, i))
    radius_squared = spheres[i, 3] * spheres[i, 3]
    b = -dot(f, direction)
    l = along(f, b, direction)  # noqa: E741
    delta = radius_squared - dot(l, l)
    infinity = type(b)(math.inf)
    if not delta >= 0:
        return infinity, -infinity
    s, k = math.sqrt(delta), dot(f, f) - radius_squared
    if b < 0:
        return b - s, k / (b - s)
    if b + s == 0:
        return b, b
    return k / (b + s), b + s


@kernel
def nearest_sphere(spheres, origin, direction, best, index, first):
    """The nearer of the hit (`best`, `index`) so far and the spheres', numbered from `first` (HIT-2)."""
    for i in range(len(spheres)):
        t = hit_sphere(spheres, i, origin, direction)
        if t < best and t > 0:
            best, index = t, first + i
    return best, index


@kernel
def any_sphere(spheres, origin, direction, limit):
    """HIT-5."""
    for i in range(len(spheres)):
        t = hit_sphere(spheres, i, origin, direction)
        if t < limit and t > 0:
            return True
    return False


@kernel
def sphere_surface(spheres, i, origin, direction, t):
    """Point and normal of the hit at `t` on sphere `i` (SPH-2)."""
    centre = row(spheres, i)
    normal = normalise(subtract(along(origin, t, direction), centre))
    return along(centre, spheres[i, 3], normal), normal
