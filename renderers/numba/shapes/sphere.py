"""Spheres: centre and radius."""

import math

import numpy as np

from ..needs import FAR, RENORMALISE, SINGLE, SPHERE_METHOD, TARGET
from ..target import called, inlined, kernel
from ..vector import UNIT_ROUNDOFF, along, dot, normalise, row, subtract
from .fused import along_in_full, fma, outside_in_full, subtract_in_full
from .quadratic import root

RENORMALISED = RENORMALISE == "on"
ASKS_AGAIN = SINGLE and TARGET != "cuda"  # SPH-1: on a GPU every ray would pay for it with registers
UNSURE = np.float32(8 * UNIT_ROUNDOFF)
# Most spheres are missed by so much that f·f - b² proves it, with fewer operations: it and the l·l of SPH-1 are each
# off by less than 32 u f·f, if directions have unit length. Not on a GPU, where all rays of a warp do what one must do.
PROVES = RENORMALISED and TARGET != "cuda"
ALMOST = 1 - 64 * UNIT_ROUNDOFF


@inlined
def hit_wide(spheres, i, origin, direction):
    """Distance to sphere `i`, with twice the digits for f, l and k (SPH-3); FAR for a miss. spheres: (S, 4)."""
    f, rest = subtract_in_full(origin, row(spheres, i))
    b = -dot(f, direction)
    if PROVES and dot(f, f) * type(b)(ALMOST) - b * b > spheres[i, 3] * spheres[i, 3]:
        return type(b)(FAR)
    m = along_in_full(f, rest, b, direction)
    l = along(m, -dot(m, direction), direction)  # noqa: E741
    delta = spheres[i, 3] * spheres[i, 3] - dot(l, l)
    if delta >= 0:
        k = outside_in_full(f, rest, spheres[i, 3])
        if k > 0:
            if b > 0:
                return k / (b + math.sqrt(delta))
        elif b >= 0:
            return b + math.sqrt(delta)
        else:
            return k / (b - math.sqrt(delta))
    return type(b)(FAR)


@called
def called_wide(spheres, i, origin, direction):
    """The same as a function that is not inlined: few rays need it."""
    return hit_wide(spheres, i, origin, direction)


@inlined
def hit_robust(spheres, i, origin, direction):
    """Distance to sphere `i` (SPH-1); FAR for a miss. spheres: (S, 4)."""
    f = subtract(origin, row(spheres, i))
    radius_squared = spheres[i, 3] * spheres[i, 3]
    b, square_f = -dot(f, direction), dot(f, f)
    if PROVES and square_f * type(b)(ALMOST) - b * b > radius_squared:
        return type(b)(FAR)
    if ASKS_AGAIN:  # rounded once, which pays for asking whether that was enough
        l = fma(b, direction[0], f[0]), fma(b, direction[1], f[1]), fma(b, direction[2], f[2])  # noqa: E741
    else:
        l = along(f, b, direction)  # noqa: E741
    delta = radius_squared - dot(l, l)
    if ASKS_AGAIN:
        unsure = UNSURE * spheres[i, 3] * (abs(b) + spheres[i, 3])
        if delta < -unsure:
            return type(b)(FAR)
        if delta < unsure:
            return called_wide(spheres, i, origin, direction)
    if delta >= 0:
        k = square_f - radius_squared
        if k > 0:
            if b > 0:
                return k / (b + math.sqrt(delta))
        elif b >= 0:
            return b + math.sqrt(delta)
        else:
            return k / (b - math.sqrt(delta))
    return type(b)(FAR)


@inlined
def hit_quadratic(spheres, i, origin, direction):
    """The same from the roots of the quadratic equation (SPH-3)."""
    f = subtract(origin, row(spheres, i))
    k = dot(f, f) - spheres[i, 3] * spheres[i, 3]
    return root(dot(direction, direction), type(k)(2) * dot(f, direction), k)


hit_sphere = {"robust": hit_robust, "wide": hit_wide}.get(SPHERE_METHOD, hit_quadratic)


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
    """Point and normal of the hit at `t` on sphere `i` (SPH-2, NUM-4)."""
    centre = row(spheres, i)
    outward = subtract(along(origin, t, direction), centre)
    if RENORMALISED:
        normal = normalise(outward)
    else:
        r = spheres[i, 3]
        normal = outward[0] / r, outward[1] / r, outward[2] / r
    return along(centre, spheres[i, 3], normal), normal
