"""Rays from the eye through the points of the screen (CAM), or from a lens around it (LEN)."""

import math

from .needs import ASK_LENS, LENS
from .random import turn
from .target import kernel
from .vector import add, along, normalise, row, scale, subtract


@kernel
def eye_ray(scene, width, height, x, y, numbers):
    """Origin and direction of the ray through (x, y), in pixels from the top left (CAM-2, CAM-3).

    numbers: four random ones of the sample, of which a lens takes the last two.
    """
    real = type(x)
    one, two = real(1), real(2)
    x, y = two * x / real(width) - one, one - two * y / real(height)
    camera = scene.camera
    u, v, e = row(camera, 1), row(camera, 2), row(camera, 3)
    origin = add(row(camera, 0), e)
    direction = subtract(along(scale(x, u), y, v), e)
    if LENS and (not ASK_LENS or scene.lensed):  # LEN-1
        rho, (cos, sin) = math.sqrt(numbers[2]), turn(numbers[3])
        h = along(scale(rho * cos, row(scene.lens, 0)), rho * sin, row(scene.lens, 1))
        origin = add(origin, h)
        direction = subtract(scale(scene.focus, direction), h)
    return origin, normalise(direction)
