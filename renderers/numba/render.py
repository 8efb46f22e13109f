"""The entry points of the kernel, for one thread and for several."""

import math

from numba import njit, prange

from .needs import ADAPTIVE, CSG, CUTOFF, LIMITED
from .sample import add_counts, lattice_sample, pixel
from .scene import OBJECT, nearest, surface
from .target import FASTMATH, kernel
from .vector import row, unit

# What Python calls. No C code does: leaving out that way in saves compiling it.
ENTRY = {"error_model": "numpy", "fastmath": FASTMATH, "no_cfunc_wrapper": True}


@kernel
def note(counts, j, more):
    """Add counts to those of row `j`."""
    counts[j, 0] += more[0]
    counts[j, 1] += more[1]
    counts[j, 2] += more[2]
    counts[j, 3] += more[3]
    counts[j, 4] += more[4]


@njit(**ENTRY)
def render_rows(scene, width, height, region, depth, corners, first, step, picture, counts):
    """Every `step`-th row of the region from its row `first` on (CAM-5); or of the corners of its pixels (SAM-5).

    `first` is the thread too: it says which work memory is its own.
    picture: (y1 - y0, x1 - x0, 3), linear RGB. counts: int64 (y1 - y0 + 1, 5), of a row each; see sample.py.
    """
    x0, y0 = region[0], region[1]
    if ADAPTIVE and corners:
        for j in range(first, len(counts), step):
            for i in range(picture.shape[1] + 1):
                a, b = (x0 + i) << scene.levels, (y0 + j) << scene.levels
                colour, _, more = lattice_sample(scene, first, width, height, a, b, depth)
                scene.corners[j, i, 0], scene.corners[j, i, 1], scene.corners[j, i, 2] = colour
                note(counts, j, more)
        return
    for j in range(first, picture.shape[0], step):
        total = 0, 0, 0, 0, 0
        for i in range(picture.shape[1]):
            colour, dropped, more = pixel(scene, first, width, height, region, x0 + i, y0 + j, depth)
            picture[j, i, 0], picture[j, i, 1], picture[j, i, 2] = colour
            if CUTOFF:
                scene.dropped[j, i] = dropped
            total = add_counts(total, more)
        note(counts, j, total)


@njit(**ENTRY)
def trace_rays(scene, rays, first, step, hits):
    """First hits of every `step`-th ray from `first` on.

    rays: (R, 6), origin, direction. hits: (R, 8) of zeros, to t, point, normal, object; one row for each ray.
    """
    for k in range(first, len(hits), step):
        origin = row(rays, k)
        direction = unit((rays[k, 3], rays[k, 4], rays[k, 5]))
        t, index = nearest(scene, first, origin, direction)
        hits[k, 0], hits[k, 7] = math.inf, -1
        if index >= 0:
            hits[k, 0] = t
            point, normal, _ = surface(scene, first, index, origin, direction, t)
            hits[k, 1], hits[k, 2], hits[k, 3] = point
            hits[k, 4], hits[k, 5], hits[k, 6] = normal
            hits[k, 7] = scene.ids[index, OBJECT]
        if CSG and LIMITED and scene.csg_overflow[first, 0] != 0:  # CSG-6
            scene.csg_overflow[first, 0] = 0
            hits[k, 0] = math.nan


# Numba gives each thread one block of a loop's turns. Rows differ in cost, but little from their neighbours:
# so a turn of these loops is not one row, it is every `step`-th.


@njit(**ENTRY, parallel=True)
def render_rows_parallel(scene, width, height, region, depth, corners, first, step, picture, counts):
    """render_rows for `first` and the `step` - 1 after it, each on a thread."""
    for k in prange(step):
        render_rows(scene, width, height, region, depth, corners, first + k, step, picture, counts)


@njit(**ENTRY, parallel=True)
def trace_rays_parallel(scene, rays, first, step, hits):
    """trace_rays for `first` and the `step` - 1 after it, each on a thread."""
    for k in prange(step):
        trace_rays(scene, rays, first + k, step, hits)
