"""From rays to colours: the loop over the orders of reflection, and the entries that main calls."""

import math

from numba import njit, prange

from .camera import eye_ray
from .scene import BACKGROUND, nearest, surface
from .shade import SPECULAR, local_light, mirrored, reflectance
from .vector import add, along, dot, kernel, largest, normalise, row, scale

# What Python calls. No C code does: leaving out that way in saves compiling it.
ENTRY = {"error_model": "numpy", "no_cfunc_wrapper": True}


@kernel
def trace(scene, origin, direction, depth, shadows):
    """Linear RGB of a ray (REF-4 to REF-6), with the numbers of reflected rays and of feelers (CNT-1).

    Without transmission each ray has one child at most, so that the tree of rays is a loop.
    """
    real = type(direction[0])
    colour, weight = (real(0), real(0), real(0)), real(1)
    order, feelers = 0, 0
    while True:
        t, index = nearest(scene, origin, direction)
        if index < 0:
            return along(colour, weight, row(scene.colours, BACKGROUND)), order, feelers
        point, normal = surface(scene, index, origin, direction, t)
        material = scene.ids[index, 1]
        step = scale(scene.epsilon * max(largest(point), scene.sizes[index]), normal)
        outside = add(point, step)
        light, more = local_light(scene, material, point, normal, direction, outside, shadows)
        colour = along(colour, weight, light)
        feelers += more
        if order == depth:
            return colour, order, feelers
        cosine = dot(direction, normal)
        mirror = scene.materials[material, SPECULAR] * reflectance(scene.air, scene.materials, material, cosine)
        if mirror == 0:
            return colour, order, feelers
        weight *= mirror
        origin = outside if cosine <= 0 else along(point, real(-1), step)
        direction = normalise(mirrored(direction, normal, cosine))
        order += 1


@kernel
def render_pixel(scene, width, height, i, j, depth, shadows):
    """Linear RGB of one pixel (CAM-4), its reflected rays and feelers, and 1 if it is not finite (CNT-2)."""
    origin, direction = eye_ray(scene.camera, scene.sample, width, height, i, j)
    colour, reflected, feelers = trace(scene, origin, direction, depth, shadows)
    finite = math.isfinite(colour[0]) and math.isfinite(colour[1]) and math.isfinite(colour[2])
    return colour, reflected, feelers, 0 if finite else 1


@njit(**ENTRY)
def render_rows(scene, width, height, region, depth, shadows, first, step, picture, counts):
    """Every `step`-th row of the region from its row `first` on (CAM-5).

    picture: (y1 - y0, x1 - x0, 3), linear RGB. counts: int64 (y1 - y0, 3), reflected, shadow, non-finite.
    """
    x0, y0 = region[0], region[1]
    for j in range(first, picture.shape[0], step):
        reflected, shadow, non_finite = 0, 0, 0
        for i in range(picture.shape[1]):
            colour, r, s, n = render_pixel(scene, width, height, x0 + i, y0 + j, depth, shadows)
            picture[j, i, 0], picture[j, i, 1], picture[j, i, 2] = colour
            reflected += r
            shadow += s
            non_finite += n
        counts[j, 0], counts[j, 1], counts[j, 2] = reflected, shadow, non_finite


@njit(**ENTRY)
def trace_rays(scene, rays, first, step, hits):
    """First hits of every `step`-th ray from `first` on.

    rays: (R, 6), origin, direction. hits: (R, 8) of zeros, to t, point, normal, object; one row for each ray.
    """
    for k in range(first, len(hits), step):
        origin = row(rays, k)
        direction = normalise((rays[k, 3], rays[k, 4], rays[k, 5]))
        t, index = nearest(scene, origin, direction)
        hits[k, 0], hits[k, 7] = t, -1
        if index >= 0:
            point, normal = surface(scene, index, origin, direction, t)
            hits[k, 1], hits[k, 2], hits[k, 3] = point
            hits[k, 4], hits[k, 5], hits[k, 6] = normal
            hits[k, 7] = scene.ids[index, 0]


# Numba gives each thread one block of a loop's turns. Rows differ in cost, but little from their neighbours:
# so a turn of these loops is not one row, it is every `step`-th.


@njit(**ENTRY, parallel=True)
def render_rows_parallel(scene, width, height, region, depth, shadows, first, step, picture, counts):
    """render_rows for `first` and the `step` - 1 after it, each on a thread."""
    for k in prange(step):
        render_rows(scene, width, height, region, depth, shadows, first + k, step, picture, counts)


@njit(**ENTRY, parallel=True)
def trace_rays_parallel(scene, rays, first, step, hits):
    """trace_rays for `first` and the `step` - 1 after it, each on a thread."""
    for k in prange(step):
        trace_rays(scene, rays, first + k, step, hits)
