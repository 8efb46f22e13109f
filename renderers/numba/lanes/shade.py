"""Light at the points that a packet of rays hits (LOC, SOF)."""

import math

from ..needs import AMBIENT, DIFFUSE, LIT, PHONG, SHADOWS, SOFT
from ..target import kernel
from ..trace.shade import COLOUR, RADIUS
from ..vector import add, multiply, row, scale, subtract
from . import scene as tables
from .functions import power, turn
from .lanes import any_of, count_of, fma, select, spread
from .memory import gather
from .random import draw_for_feeler
from .search import occluded
from .vector import along, dot, gather_three, select_three


@kernel
def on_light(scene, ray, i, f):
    """The targets of feeler number `f` to light `i` (SOF-2)."""
    u = draw_for_feeler(scene, ray, i, f)
    z, (cosine, sine) = 1.0 - 2.0 * u[0], turn(u[1])
    rest = 1.0 - z * z
    w = math.sqrt(select(rest > 0.0, rest, 0.0))
    return along(row(scene.lights, i), scene.lights[i, RADIUS], (w * cosine, w * sine, z))


@kernel
def local_light(scene, thread, role, hit, point, normal, direction, outside, place, ray):
    """Linear RGB (LOC-1 to LOC-5, SOF-1) in the lanes of the mask `hit`, and the number of feelers, from `outside`.

    ray: pixel, sample, order and path (RND-3, SOB-1).
    """
    zero, feelers = spread(0.0), 0
    colour, diffuse, specular, exponent = (zero, zero, zero), (zero, zero, zero), zero, zero
    if AMBIENT or DIFFUSE:
        diffuse = gather_three(scene.roles, tables.DIFFUSE, role, hit)
    if AMBIENT:
        colour = multiply(diffuse, row(scene.ambient, 0))
    if PHONG:
        specular = gather(scene.roles, tables.SPECULAR, role, hit)
        exponent = gather(scene.roles, tables.EXPONENT, role, hit)
    if LIT:
        slope = -2.0 * dot(normal, direction)
        for i in range(len(scene.lights)):
            count, share = 1, 1.0
            if SOFT and scene.lights[i, RADIUS] > 0:
                count, share = scene.feelers, 1.0 / scene.feelers
            total = zero, zero, zero
            for f in range(count):
                to_light = subtract(row(scene.lights, i), point)
                if SOFT and scene.lights[i, RADIUS] > 0:
                    to_light = subtract(on_light(scene, ray, i, f), point)
                distance = math.sqrt(dot(to_light, to_light))
                near = 1.0 / distance
                cosine = near * dot(normal, to_light)
                lit = hit & (cosine > 0.0)
                if SHADOWS and any_of(lit):
                    feelers += count_of(lit)
                    way = scale(near, to_light)
                    lit = lit & ~occluded(scene, thread, lit, outside, way, distance, place)
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
                    received = select_three(lit, received, (zero, zero, zero))
                    total = add(total, received) if SOFT else received
            if SOFT:
                total = scale(share, total)
            light = scene.lights[i, COLOUR], scene.lights[i, COLOUR + 1], scene.lights[i, COLOUR + 2]
            colour = add(colour, multiply(total, light))
    return colour, feelers
