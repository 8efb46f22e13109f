"""Shades the hits of a packet of rays: light (LOC) and mirrored share (REF)."""

import math

from ..needs import AMBIENT, DIFFUSE, LIT, PHONG, SHADOWS
from ..target import kernel
from ..vector import add, multiply, row, scale, subtract
from .lanes import any_of, count_of, fma, select, spread
from .memory import gather
from .power import power
from .sphere import occluded
from .vector import dot, gather_three, select_three

# Rows of the table of surfaces, a column for each sphere: centre, radius, diffuse colour, k_s, m, and N and M of REF-1
# for a ray from outside and from inside.
CENTRE, RADIUS, DIFFUSE_COLOUR, SPECULAR, EXPONENT, FROM_OUTSIDE, FROM_INSIDE = 0, 3, 4, 7, 8, 9, 11
ROWS = 13


@kernel
def local_light(scene, index, hit, point, normal, direction, outside):
    """Linear RGB (LOC-1 to LOC-5) in the lanes of the mask `hit`, and the number of feelers."""
    surfaces, zero, feelers = scene.surfaces, spread(0.0), 0
    colour, diffuse, specular, exponent = (zero, zero, zero), (zero, zero, zero), zero, zero
    if AMBIENT or DIFFUSE:
        diffuse = gather_three(surfaces, DIFFUSE_COLOUR, index, hit)
    if AMBIENT:
        colour = multiply(diffuse, row(scene.ambient, 0))
    if PHONG:
        specular, exponent = gather(surfaces, SPECULAR, index, hit), gather(surfaces, EXPONENT, index, hit)
    if LIT:
        slope = -2.0 * dot(normal, direction)
        for i in range(len(scene.lights)):
            to_light = subtract(row(scene.lights, i), point)
            distance = math.sqrt(dot(to_light, to_light))
            near = 1.0 / distance
            cosine = near * dot(normal, to_light)
            lit = hit & (cosine > 0.0)
            if SHADOWS and any_of(lit):
                feelers += count_of(lit)
                lit = lit & ~occluded(scene.spheres, scene.count, outside, scale(near, to_light), distance, lit)
            if any_of(lit):
                received, highlight = (zero, zero, zero), zero
                if DIFFUSE:
                    received = scale(cosine, diffuse)
                if PHONG:
                    c = fma(near, dot(to_light, direction), cosine * slope)
                    shines = lit & (c > 0.0)
                    if any_of(shines):
                        highlight = specular * power(select(c < 1.0, c, 1.0), exponent)
                        highlight = select(shines, highlight, 0.0)
                    received = received[0] + highlight, received[1] + highlight, received[2] + highlight
                colour = select_three(lit, add(colour, multiply(received, row(scene.light_colours, i))), colour)
    return colour, feelers


@kernel
def mirrored_share(surfaces, index, hit, cosine):
    """k_s R (REF-1, REF-2). cosine: d·n."""
    n, m = gather(surfaces, FROM_OUTSIDE, index, hit), gather(surfaces, FROM_OUTSIDE + 1, index, hit)
    inside = hit & (cosine > 0.0)
    if any_of(inside):
        n = select(inside, gather(surfaces, FROM_INSIDE, index, inside), n)
        m = select(inside, gather(surfaces, FROM_INSIDE + 1, index, inside), m)
    c = abs(cosine)
    c = select(c < 1.0, c, 1.0)
    x = 1.0 - n * n * (1.0 - c * c)
    s = math.sqrt(x)
    r1 = (n * c - m * s) / (n * c + m * s)
    r2 = (m * c - n * s) / (m * c + n * s)
    r = select(x <= 0.0, 1.0, 0.5 * (r1 * r1 + r2 * r2))
    there = (n != 1.0) | (m != 1.0)
    return gather(surfaces, SPECULAR, index, hit) * select(there, r, 0.0)
