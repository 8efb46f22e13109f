"""Reflection and transmission at the surfaces that a packet of rays hits: media, shares, directions."""

import math

from ..needs import ATTENUATION, MEDIA, STUDY_WEIGHT
from ..target import kernel
from ..vector import add, scale, subtract
from . import scene as tables
from .functions import exp2, expm1, logarithm, turn
from .lanes import any_of, select, spread
from .memory import gather
from .random import draw_for_lobe
from .vector import along, dot, gather_three, normalise, select_three


@kernel
def medium(scene, members):
    """Rows of materials of the highest-ranking solids of sets; of AIR for empty ones (MED-2)."""
    found = spread(len(scene.materials) - 1)
    for rank in range(len(scene.media)):
        found = select(((members >> rank) & 1) != 0, spread(scene.media[rank]), found)
    return found


@kernel
def sides(scene, role, hit, inside, members):
    """Rows of materials of the media i and t, and the sets the rays were in and are in beyond (MED-3, MED-4)."""
    own, around = gather(scene.role_ids, tables.MATERIAL, role, hit), spread(len(scene.materials) - 1)
    was = beyond = members
    if MEDIA:
        rank = gather(scene.role_ids, tables.RANK, role, hit)
        ranked = hit & (rank >= 0)
        solid = select(ranked, spread(1) << select(ranked, rank, 0), 0)
        out, within = members & ~solid, members | solid
        around, own = medium(scene, out), select(ranked, medium(scene, within), own)
        was, beyond = select(inside, within, out), select(inside, out, within)
    return select(inside, own, around), select(inside, around, own), was, beyond


@kernel
def attenuated(scene, weight, material, t, hit):
    """Weights after the lengths `t` in media (ATT-1): a^t = 2^(t log2 a)."""
    if ATTENUATION:
        a = gather_three(scene.optics, tables.ATTENUATION, material, hit)
        if any_of((a[0] != 0.0) | (a[1] != 0.0) | (a[2] != 0.0)):
            return weight[0] * exp2(t * a[0]), weight[1] * exp2(t * a[1]), weight[2] * exp2(t * a[2])
    return weight


@kernel
def between(scene, role, hit, inside, i, t):
    """N and M of REF-1."""
    if MEDIA:
        optics = scene.optics
        n = gather(optics, tables.INDEX, i, hit) / gather(optics, tables.INDEX, t, hit)
        return n, gather(optics, tables.PERMEABILITY, i, hit) / gather(optics, tables.PERMEABILITY, t, hit)
    n, m = gather(scene.roles, tables.FROM_OUTSIDE, role, hit), gather(scene.roles, tables.FROM_OUTSIDE + 1, role, hit)
    if any_of(inside):
        n = select(inside, gather(scene.roles, tables.FROM_INSIDE, role, inside), n)
        m = select(inside, gather(scene.roles, tables.FROM_INSIDE + 1, role, inside), m)
    return n, m


@kernel
def fresnel(n, m, cosine):
    """R for unpolarised light, s = √x, and where the surface is there at all (REF-1, REF-2). cosine: d·n."""
    c = abs(cosine)
    c = select(c < 1.0, c, 1.0)
    x = 1.0 - n * n * (1.0 - c * c)
    s = math.sqrt(x)
    r1 = (n * c - m * s) / (n * c + m * s)
    r2 = (m * c - n * s) / (m * c + n * s)
    there = (n != 1.0) | (m != 1.0)
    return select(there, select(x <= 0.0, 1.0, 0.5 * (r1 * r1 + r2 * r2)), 0.0), s, there


@kernel
def refracted(direction, normal, cosine, inside, n, s):
    """TRA-1."""
    g = select(inside, s, -s)
    return normalise(along(scale(n, direction), g - n * cosine, normal))


@kernel
def glossy(scene, ray, exponent, normal, r, g):
    """Directions number `g` of the lobes around the mirrored directions `r`, and their weights w (GLO-1 to GLO-3).

    ray: pixel, sample, order and path (RND-3, SOB-1).
    """
    u = draw_for_lobe(scene, ray, g)
    power = logarithm(1.0 - u[0]) / (exponent + 1.0)
    z, (cosine, sine) = 1.0 + expm1(power), turn(u[1])
    w = math.sqrt(-expm1(2.0 * power))
    x, y = w * cosine, w * sine
    sigma = select(r[2] >= 0.0, spread(1.0), -1.0)
    a = -1.0 / (sigma + r[2])
    b = r[0] * r[1] * a
    p, q = (1.0 + sigma * r[0] * r[0] * a, sigma * b, -sigma * r[0]), (b, sigma + r[1] * r[1] * a, -r[1])
    aside, ahead = along(scale(x, p), y, q), scale(z, r)
    direction = add(ahead, aside)
    turns = (dot(direction, normal) > 0.0) ^ (dot(r, normal) > 0.0)
    direction = select_three(turns, subtract(ahead, aside), direction)
    weight = 1.0 + expm1(power * exponent) if STUDY_WEIGHT else spread(1.0)
    return normalise(direction), weight
