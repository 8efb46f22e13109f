"""Spheres: centre and radius."""

import math

from .needs import FAR, SPHERE_METHOD
from .target import inlined, kernel
from .vector import along, dot, normalise, row, subtract


@inlined
def hit_robust(spheres, i, origin, direction):
    """Distance to sphere `i` (SPH-1); FAR for a miss. spheres: (S, 4)."""
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
    return type(b)(FAR)


@inlined
def hit_textbook(spheres, i, origin, direction):
    """The same from the roots of the quadratic equation (SPH-3)."""
    real = type(direction[0])
    two, four = real(2), real(4)
    f = subtract(origin, row(spheres, i))
    a, h, k = dot(direction, direction), two * dot(f, direction), dot(f, f) - spheres[i, 3] * spheres[i, 3]
    discriminant = h * h - four * a * k
    if discriminant >= 0:
        root = math.sqrt(discriminant)
        t = (-h - root) / (two * a)
        if t > 0:
            return t
        return (-h + root) / (two * a)
    return real(FAR)


@inlined
def hit_stable(spheres, i, origin, direction):
    """The same from roots that do not cancel, of a discriminant that still does (SPH-3)."""
    real = type(direction[0])
    two, four = real(2), real(4)
    f = subtract(origin, row(spheres, i))
    a, h, k = dot(direction, direction), two * dot(f, direction), dot(f, f) - spheres[i, 3] * spheres[i, 3]
    discriminant = h * h - four * a * k
    if discriminant >= 0:
        root = math.sqrt(discriminant)
        q = -(h + root) / two if h >= 0 else -(h - root) / two
        t, other = q / a, k / q
        if other < t:
            t, other = other, t
        if t > 0:
            return t
        return other
    return real(FAR)


hit_sphere = {"robust": hit_robust, "textbook": hit_textbook, "stable": hit_stable}[SPHERE_METHOD]


@kernel
def span_sphere(spheres, i, origin, direction):
    """Where the line enters and leaves sphere `i` (CSG-1); FAR, -FAR if it does not."""
    f = subtract(origin, row(spheres, i))
    radius_squared = spheres[i, 3] * spheres[i, 3]
    b = -dot(f, direction)
    l = along(f, b, direction)  # noqa: E741
    delta = radius_squared - dot(l, l)
    infinity = type(b)(FAR)
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
