"""The kernels: each block takes one tile of the picture after the other, each thread a pixel of it."""

import math

import numpy as np

from ..needs import ADAPTIVE, CSG, CUTOFF, LIMITED, REFLECTION, SHADOWS, STREAMED, STRIDED, THREADS, TRANSMISSION
from ..sample import add_counts, lattice_sample, pixel
from ..scene import OBJECT, nearest, surface
from ..target import inlined, kernel
from ..vector import row, unit
from .device import cuda
from .tiles import rank

int64 = np.int64


@kernel
def add_up(counts, k, value, scratch):
    """Add the values of all threads of the block to counts[k]: in pairs, since they would wait for each other's turn.

    scratch: a number for each thread, in shared memory.
    """
    cuda.syncthreads()
    scratch[rank()] = value
    left = THREADS
    while left > 1:
        cuda.syncthreads()
        half = (left + 1) // 2
        if rank() + half < left:
            scratch[rank()] += scratch[rank() + half]
        left = half
    if rank() == 0:
        cuda.atomic.add(counts, k, scratch[0])


@inlined
def place():
    """Column and row of this thread in the grid."""
    i = np.int32(cuda.blockIdx.x * cuda.blockDim.x + cuda.threadIdx.x)
    return i, np.int32(cuda.blockIdx.y * cuda.blockDim.y + cuda.threadIdx.y)


@inlined
def note(counts, more, scratch):
    """Add the counts of all threads of the block (sample.py) to the picture's."""
    if ADAPTIVE:  # else the host knows
        add_up(counts, 0, more[0], scratch)
    if REFLECTION:
        add_up(counts, 1, more[1], scratch)
    if TRANSMISSION:
        add_up(counts, 2, more[2], scratch)
    if SHADOWS:
        add_up(counts, 3, more[3], scratch)
    if more[4] != 0:
        cuda.atomic.add(counts, 4, more[4])


@inlined
def one_pixel(scene, width, height, region, depth, picture, i, j):
    """Pixel (i, j) of the picture, if there is one, and its counts."""
    total = 0, 0, 0, 0, 0
    there = i < picture.shape[1] and j < picture.shape[0]
    if there or STREAMED:
        colour, dropped, more = pixel(scene, 0, width, height, region, region[0] + i, region[1] + j, depth)
        if there:
            picture[j, i, 0], picture[j, i, 1], picture[j, i, 2] = colour
            if CUTOFF:
                scene.dropped[j, i] = dropped
            total = more
    return total


def picture_kernel(assemble):
    """The kernel of a picture. assemble: of assemble.py."""

    def render_pixels(tables, width, height, region, depth, picture, counts):
        """picture: (y1 - y0, x1 - x0, 3), linear RGB. counts: int64 (5,), added to; see sample.py."""
        scene = assemble(tables)
        scratch = cuda.shared.array(THREADS, int64)
        i, j = place()
        if STRIDED:
            total = 0, 0, 0, 0, 0
            for line in range(cuda.blockIdx.y * cuda.blockDim.y, picture.shape[0], cuda.gridDim.y * cuda.blockDim.y):
                j = line + cuda.threadIdx.y
                for column in range(
                    cuda.blockIdx.x * cuda.blockDim.x, picture.shape[1], cuda.gridDim.x * cuda.blockDim.x
                ):
                    i = column + cuda.threadIdx.x
                    total = add_counts(total, one_pixel(scene, width, height, region, depth, picture, i, j))
        else:
            total = one_pixel(scene, width, height, region, depth, picture, i, j)
        note(counts, total, scratch)

    return render_pixels


def corners_kernel(assemble):
    """The kernel of the corners of pixels, which `adaptive` has before the picture (SAM-5)."""

    def render_corners(tables, width, height, region, depth, counts):
        """Into tables.corners, a thread for each. counts: as of render_pixels."""
        scene = assemble(tables)
        scratch = cuda.shared.array(THREADS, int64)
        total = 0, 0, 0, 0, 0
        i, j = place()
        if i < scene.corners.shape[1] and j < scene.corners.shape[0]:
            a, b = (region[0] + i) << scene.levels, (region[1] + j) << scene.levels
            colour, _, total = lattice_sample(scene, 0, width, height, a, b, depth)
            scene.corners[j, i, 0], scene.corners[j, i, 1], scene.corners[j, i, 2] = colour
        note(counts, total, scratch)

    return render_corners


def rays_kernel(assemble):
    """The kernel of a list of rays."""

    def trace_rays(tables, rays, hits):
        """First hits. rays: (R, 6), origin, direction. hits: (R, 8), to t, point, normal, object."""
        scene = assemble(tables)
        team = cuda.blockDim.x * cuda.blockDim.y
        for first in range(cuda.blockIdx.x * team, len(hits), cuda.gridDim.x * team):
            k = first + rank()
            there = k < len(hits)
            k = min(k, len(hits) - 1)  # in step with the others
            origin = row(rays, k)
            direction = unit((rays[k, 3], rays[k, 4], rays[k, 5]))
            t, index = nearest(scene, 0, origin, direction)
            if there:
                zero = type(t)(0)
                distance, object_number, point, normal = type(t)(math.inf), -1, (zero, zero, zero), (zero, zero, zero)
                if index >= 0:
                    distance = t
                    point, normal, _ = surface(scene, 0, index, origin, direction, t)
                    object_number = scene.ids[index, OBJECT]
                if CSG and LIMITED and scene.csg_overflow[0, 0] != 0:  # CSG-6
                    scene.csg_overflow[0, 0] = 0
                    distance = type(t)(math.nan)
                hits[k, 0], hits[k, 7] = distance, object_number
                hits[k, 1], hits[k, 2], hits[k, 3] = point
                hits[k, 4], hits[k, 5], hits[k, 6] = normal

    return trace_rays
