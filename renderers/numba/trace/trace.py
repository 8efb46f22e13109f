"""One ray: the light that it meets, and the rays that leave from there (REF, TRA, ATT, MED)."""

import math

import numpy as np

from ..needs import ATTENUATION, FAST, GLOSSY, REFLECTION, SCATTERED, SINGLE, STREAMED, TOUCHING, TRANSMISSION
from ..scene import ATTENUATED, BACKGROUND, CLEAR, FLAT, LOBE, MATERIAL, SPECULAR, nearest, surface
from ..target import called, kernel
from ..vector import add, along, dot, largest, multiply, row, scale
from .contact import place_of
from .media import sides
from .reflect import fresnel, glossy, mirrored, offset, refracted
from .shade import local_light

# A ray is (origin, direction, set of clear solids it is in, path of RND-4). A weight is a number, or three where
# anything is attenuated.

# The number, and an integer of as many bits.
REAL, BITS = (np.float32, np.int32) if SINGLE else (np.float64, np.int64)


@kernel
def unit_weight(scene):
    one = type(scene.epsilon)(1)
    if ATTENUATION:
        return one, one, one
    return one


@kernel
def weigh(weight, factor):
    """A weight times a number."""
    if ATTENUATION:
        return scale(factor, weight)
    return factor * weight


@kernel
def greatest(weight):
    """A weight as one number: the largest of three (CUT-1)."""
    if ATTENUATION:
        return largest(weight)
    return weight


@kernel
def gather(colour, weight, light):
    """colour + weight × light."""
    if ATTENUATION:
        return add(colour, multiply(weight, light))
    return along(colour, weight, light)


@kernel
def attenuated(scene, weight, material, t):
    """A weight after the length `t` in a medium (ATT-1)."""
    if ATTENUATION:
        a = row_from(scene.materials, material)
        if not (a[0] == 1 and a[1] == 1 and a[2] == 1):
            return weight[0] * a[0] ** t, weight[1] * a[1] ** t, weight[2] * a[2] ** t
    return weight


@kernel
def row_from(materials, i):
    return materials[i, ATTENUATED], materials[i, ATTENUATED + 1], materials[i, ATTENUATED + 2]


@called
def settle(scene, thread, origin, direction, members, t, index, weight, met):
    """Where a ray ends that hits a shape at `t`, beyond all that is no surface (MED-8), and its weight there.

    met: point, normal and size of the hit. Returns the shape on top, or -1 and the weight as it was; the last `t`; the
    weight; and the place: point, normal, size, sets and media as `place_of` has them.
    """
    given = weight
    while True:
        point, normal, size = met
        index, place, none = place_of(scene, thread, members, direction, index, point, normal, size)
        point, normal, size, _, beyond, i, _ = place
        weight = attenuated(scene, weight, i, t)
        if not none:
            return index, t, weight, place
        step = scale(offset(scene, point, normal, size), normal)
        origin = add(point, step) if dot(direction, normal) > 0 else along(point, type(t)(-1), step)
        members = beyond
        t, index = nearest(scene, thread, origin, direction)
        if index < 0:
            return index, t, given, place
        met = surface(scene, thread, index, origin, direction, t)


@kernel
def meet(scene, thread, place, ray, weight, last):
    """One ray's light, its weight at the hit, k_s R, k_s T, the number of feelers, and the values for `leave_*`.

    `last` is whether its order is the last. k_s R and k_s T are 0 where nothing is to be traced (REF-4).
    """
    origin, direction, members, path = ray
    zero = type(direction[0])(0)
    t, index = nearest(scene, thread, origin, direction)
    hit = index >= 0
    if not hit:
        if not STREAMED:
            nowhere = origin, origin, direction, zero, -1, zero, zero, members, members, False
            return row(scene.colours, BACKGROUND), weight, zero, zero, 0, nowhere
        t, index = type(t)(1), 0  # goes along with the threads that it is in step with (gpu/tiles.py)
    point, normal, size = surface(scene, thread, index, origin, direction, t)
    settled, i, beyond_i, was, beyond, around = False, np.int64(0), np.int64(0), members, members, members
    if TOUCHING and len(scene.precedence) > 0:
        index, t, weight, (point, normal, size, was, beyond, i, beyond_i) = settle(
            scene, thread, origin, direction, members, t, index, weight, (point, normal, size)
        )
        settled = True
        if index < 0:
            nowhere = origin, origin, direction, zero, -1, zero, zero, members, members, False
            return row(scene.colours, BACKGROUND), weight, zero, zero, 0, nowhere
        around = was if dot(direction, normal) <= 0 else beyond
    material = scene.ids[index, MATERIAL]
    step = scale(offset(scene, point, normal, size), normal)
    outside = add(point, step)
    light, feelers = local_light(scene, thread, place, path, material, point, normal, direction, outside, hit, around)
    cosine = dot(direction, normal)
    if not settled:
        i, beyond_i, was, beyond = sides(scene, index, material, cosine > 0, members)
    if hit and not settled:
        weight = attenuated(scene, weight, i, t)
    mirror, through, n, s, straight = zero, zero, zero, zero, False
    if REFLECTION:
        k_s = scene.materials[material, SPECULAR]
        if not last and k_s != 0:
            r, s, n, there = fresnel(scene.materials, i, beyond_i, cosine)
            mirror = k_s * r
            if TRANSMISSION:
                straight = not there or scene.ids[index, FLAT] == 1
                if scene.materials[material, CLEAR] == 1:
                    through = k_s * (type(r)(1) - r)
    if not hit:
        light, mirror, through = row(scene.colours, BACKGROUND), zero, zero
    return light, weight, mirror, through, feelers, (point, step, normal, cosine, material, n, s, was, beyond, straight)


@kernel
def child(scene, path, c):
    """RND-4."""
    if not SCATTERED:
        return path
    branches = 2
    if GLOSSY:
        branches = scene.glossy_rays + 1
    if c < 0:
        c += branches
    return (path * branches + 1 + c) & 0xFFFFFFFF


@kernel
def leave_mirrored(scene, place, ray, surroundings, g):
    """Reflected ray number `g`, and its weight beside k_s R (REF-3, MED-5, GLO-1)."""
    _, direction, _, path = ray
    point, step, normal, cosine, material, _, _, was, _, _ = surroundings
    real = type(cosine)
    origin = add(point, step) if cosine <= 0 else along(point, real(-1), step)
    towards, weight = mirrored(direction, normal, cosine), real(1)
    if GLOSSY and scene.materials[material, LOBE] >= 0:
        towards, weight = glossy(scene, place, path, material, normal, towards, g)
        weight /= real(scene.glossy_rays)
    return (origin, towards, was, child(scene, path, g)), weight


@kernel
def leave_through(scene, ray, surroundings):
    """The transmitted ray (TRA-1, MED-5)."""
    _, direction, _, path = ray
    point, step, normal, cosine, _, n, s, _, beyond, straight = surroundings
    origin = add(point, step) if cosine > 0 else along(point, type(cosine)(-1), step)
    towards = direction if straight else refracted(direction, normal, cosine, n, s)
    return origin, towards, beyond, child(scene, path, -1)


@kernel
def is_finite(scene, x):
    if FAST:  # takes that for granted, of its bits too, unless it cannot know which are looked at
        return REAL(x).view(BITS) & scene.infinite != scene.infinite
    return math.isfinite(x)


@kernel
def finite(scene, colour):
    return is_finite(scene, colour[0]) and is_finite(scene, colour[1]) and is_finite(scene, colour[2])
