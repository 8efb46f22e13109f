"""Reflection and transmission at a surface: shares and directions."""

import math

from ..needs import FRESNEL, OFFSET, STUDY_WEIGHT
from ..random import draw_for_lobe, turn
from ..scene import INDEX, LOBE, PERMEABILITY
from ..target import kernel
from ..vector import add, along, dot, largest, renormalise, scale

CLAMPED = FRESNEL == "clamped"
BOUNDED, RELATIVE, FIXED = (name == OFFSET for name in ("bounded", "relative", "fixed"))


@kernel
def offset(scene, point, normal, size):
    """How far along the normal a ray starts from the point (OFF-1)."""
    real = type(size)
    if BOUNDED:
        spread = abs(normal[0] * point[0]) + abs(normal[1] * point[1]) + abs(normal[2] * point[2])
        return scene.epsilon * (size + real(0.125) * spread)
    if RELATIVE:
        return scene.epsilon * max(largest(point), size)
    if FIXED:
        return scene.epsilon
    return real(0)


@kernel
def room_at_light(scene, place):
    """ε at a light, with the largest size of all shapes (LOC-2)."""
    if BOUNDED or RELATIVE:
        return scene.epsilon * (scene.largest_extent + largest(place))
    if FIXED:
        return scene.epsilon
    return type(scene.epsilon)(0)


@kernel
def fresnel(materials, i, t, cosine):
    """R for unpolarised light between two media, s = √x, N, and whether the surface is there at all (REF-1, REF-2).

    i, t: rows of materials. cosine: d·n.
    """
    real = type(cosine)
    zero, one, half = real(0), real(1), real(0.5)
    # Of equals, the quotient of a fast division need not be 1.
    if materials[i, INDEX] == materials[t, INDEX] and materials[i, PERMEABILITY] == materials[t, PERMEABILITY]:
        return zero, one, one, False
    n = materials[i, INDEX] / materials[t, INDEX]
    m = materials[i, PERMEABILITY] / materials[t, PERMEABILITY]
    if CLAMPED:
        c = min(one, abs(cosine))
        x = one - n * n * (one - c * c)
        if x <= 0:
            return one, zero, n, True
        s = math.sqrt(x)
    else:
        c = abs(cosine)
        x = one - n * n * (one - c * c)
        s = math.sqrt(x) if x >= 0 else real(math.nan)  # Python raises
    r1 = (n * c - m * s) / (n * c + m * s)
    r2 = (m * c - n * s) / (m * c + n * s)
    return half * (r1 * r1 + r2 * r2), s, n, True


@kernel
def mirrored(direction, normal, cosine):
    """REF-3. cosine: d·n."""
    return renormalise(along(direction, type(cosine)(-2) * cosine, normal))


@kernel
def refracted(direction, normal, cosine, n, s):
    """TRA-1."""
    g = -s if cosine <= 0 else s
    return renormalise(along(scale(n, direction), g - n * cosine, normal))


@kernel
def glossy(scene, place, path, material, normal, r, g):
    """Direction number `g` of the lobe around the mirrored direction `r`, and its weight w (GLO-1 to GLO-3)."""
    real = type(scene.epsilon)
    one = real(1)
    exponent = scene.materials[material, LOBE]
    u = draw_for_lobe(scene, place, path, g)
    z = (one - u[0]) ** (one / (exponent + one))
    w = math.sqrt(-math.expm1(real(2) * math.log(one - u[0]) / (exponent + one)))
    cos, sin = turn(u[1])
    x, y = w * cos, w * sin
    sigma = one if r[2] >= 0 else -one
    a = -one / (sigma + r[2])
    b = r[0] * r[1] * a
    p, q = (one + sigma * r[0] * r[0] * a, sigma * b, -sigma * r[0]), (b, sigma + r[1] * r[1] * a, -r[1])
    aside, ahead = along(scale(x, p), y, q), scale(z, r)
    direction = add(aside, ahead)
    if (dot(direction, normal) > 0) != (dot(r, normal) > 0):
        direction = along(ahead, -one, aside)
    weight = z**exponent if STUDY_WEIGHT else one
    return renormalise(direction), weight
