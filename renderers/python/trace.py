"""From a ray to its colour (REF-4 to REF-6)."""

import math

from .scene import first_hit
from .shade import fresnel, leave, local, reflect
from .vector import dot


class Counts:
    """Rays traced in one frame (CNT-1), and samples that are not finite (CNT-2)."""

    def __init__(self):
        self.primary = self.reflected = self.shadow = self.non_finite = 0


def trace(scene, origin, direction, depth, shadows, counts):
    """Colour (red, green, blue) of an eye ray.

    Without transmission every ray has at most one child, so the study's tree is a chain and a loop walks it.
    """
    red = green = blue = 0
    weight = 1
    for order in range(depth + 1):
        hit = first_hit(scene, origin, direction, math.inf)
        if hit is None:
            r, g, b = scene.background
            return red + weight * r, green + weight * g, blue + weight * b
        _, point, normal, shape = hit
        r, g, b = local(scene, direction, point, normal, shape, shadows, counts)
        red, green, blue = red + weight * r, green + weight * g, blue + weight * b
        if order == depth:
            break
        d_dot_n = dot(direction, normal)
        share = shape.material.k_s * fresnel(scene, shape.material, d_dot_n)
        if share == 0:
            break
        weight *= share
        counts.reflected += 1
        side = 1 if d_dot_n <= 0 else -1
        origin = leave(point, normal, shape.size, side, scene.epsilon)
        direction = reflect(direction, normal, d_dot_n, scene.number.sqrt)
    return red, green, blue
