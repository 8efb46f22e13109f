"""Rays from the eye through the pixels of the screen (CAM)."""

from .vector import add, along, kernel, normalise, row, scale, subtract


@kernel
def eye_ray(camera, sample, width, height, i, j):
    """Origin and direction of the ray through column `i`, row `j` (CAM-2, CAM-3).

    camera: (4, 3), C, u, v, e. sample: (2,), place in the pixel, in [0, 1).
    """
    real = type(sample[0])
    one, two = real(1), real(2)
    x = two * (real(i) + sample[0]) / real(width) - one
    y = one - two * (real(j) + sample[1]) / real(height)
    u, v, e = row(camera, 1), row(camera, 2), row(camera, 3)
    origin = add(row(camera, 0), e)
    direction = subtract(along(scale(x, u), y, v), e)
    return origin, normalise(direction)
