"""Light at a point."""

import math

from ..needs import AMBIENT, ASK_SHADOWS, DIFFUSE, LIT, PHONG, PHONG_METHOD, SHADOWS, SOFT, STREAMED, TOUCHING
from ..random import draw_for_feeler, turn
from ..scene import AMBIENT as AMBIENT_ROW
from ..scene import EXPONENT, SPECULAR, occluded
from ..target import kernel
from ..vector import add, along, dot, multiply, row, scale, subtract
from .contact import lets_by
from .reflect import room_at_light

# Columns of the table of lights, after the three of the position.
COLOUR, RADIUS = 3, 6

UNCLAMPED = PHONG_METHOD == "unclamped"


@kernel
def on_light(scene, place, path, i, f):
    """The target of feeler number `f` to light `i` (SOF-2)."""
    real = type(scene.epsilon)
    one, two = real(1), real(2)
    u = draw_for_feeler(scene, place, path, i, f)
    z, (cos, sin) = one - two * u[0], turn(u[1])
    w = math.sqrt(max(real(0), one - z * z))
    return along(row(scene.lights, i), scene.lights[i, RADIUS], (w * cos, w * sin, z))


@kernel
def local_light(scene, thread, place, path, material, point, normal, direction, outside, there, around):
    """Linear RGB (LOC-1 to LOC-5, SOF-1) at `point`, and the number of feelers, which leave from `outside`.

    around: the set of clear solids that feelers start in (MED-8).
    there: whether there is a point at all. Threads that are in step ask for shadows without one too (gpu/tiles.py).
    """
    real = type(direction[0])
    zero, one, two = real(0), real(1), real(2)
    diffuse = row(scene.materials, material)
    colour, feelers = (zero, zero, zero), 0
    if AMBIENT:
        colour = multiply(diffuse, row(scene.colours, AMBIENT_ROW))
    if not LIT:
        return colour, feelers
    lights, specular = scene.lights, scene.materials[material, SPECULAR]
    for i in range(len(lights)):
        count, share = 1, one
        if SOFT and lights[i, RADIUS] > 0:
            count, share = scene.feelers, one / real(scene.feelers)
        total = zero, zero, zero
        for f in range(count):
            place_of_light = row(lights, i)
            if SOFT and lights[i, RADIUS] > 0:
                place_of_light = on_light(scene, place, path, i, f)
            to_light = subtract(place_of_light, point)
            distance = math.sqrt(dot(to_light, to_light))
            l = to_light[0] / distance, to_light[1] / distance, to_light[2] / distance  # noqa: E741
            cosine = dot(normal, l)
            lit = there and cosine > 0
            if not (lit or STREAMED):
                continue
            if SHADOWS and (not ASK_SHADOWS or scene.shadows):
                if lit:
                    feelers += 1
                reach = distance if lit else zero  # apart, as a branch beside a barrier may copy it (gpu/tiles.py)
                if TOUCHING and len(scene.precedence) > 0:  # less far than what the light lies on
                    reach -= real(512) * room_at_light(scene, place_of_light)
                if occluded(scene, thread, outside, l, reach):
                    if not TOUCHING:
                        continue
                    if len(scene.precedence) == 0 or around == 0:
                        continue
                    if not lets_by(scene, thread, outside, l, reach, around):
                        continue
            if not lit:
                continue
            highlight, received = zero, (zero, zero, zero)
            if PHONG:
                r = subtract(scale(two * cosine, normal), l)
                c = -dot(r, direction)
                if UNCLAMPED:
                    highlight = specular * c ** scene.materials[material, EXPONENT]
                elif c > 0:
                    highlight = specular * min(c, one) ** scene.materials[material, EXPONENT]
            if DIFFUSE:
                received = scale(cosine, diffuse)
            if PHONG:
                received = received[0] + highlight, received[1] + highlight, received[2] + highlight
            total = add(total, received) if SOFT else received
        if SOFT:
            total = scale(share, total)
        colour = add(colour, multiply(total, (lights[i, COLOUR], lights[i, COLOUR + 1], lights[i, COLOUR + 2])))
    return colour, feelers
