"""Tables of shapes that are too large for shared memory: fetched tile by tile by the threads of a block together.

A barrier stands before a tile is overwritten, since others may still read it, and one after, since they may not yet.
All threads of a block must reach each barrier. So they go in step: they ask for the nearest shape, and for shadows, as
often as the one of them that has the most rays, and what is not their own they forget. Each barrier stands in one place
of the machine code: of a warp whose threads come to two copies of it, none goes on. Python makes such copies of what
follows a branch (test_barriers.py), so no statement that comes to a barrier has a branch within.
"""

import numpy as np

from ..needs import BOX, ELLIPSOID, MESH, POLYGON, SPHERE, THREADS
from ..shapes.box import nearest_box
from ..shapes.ellipsoid import nearest_ellipsoid
from ..shapes.mesh import nearest_triangle
from ..shapes.polygon import nearest_polygon
from ..shapes.sphere import nearest_sphere
from ..target import kernel
from .device import cuda


@kernel
def any_of_block(condition):
    """Returns whether the condition holds in any thread of the block."""
    return cuda.syncthreads_or(np.int32(condition)) != 0


@kernel
def rank():
    """Number of this thread in its block."""
    return cuda.threadIdx.x + cuda.threadIdx.y * cuda.blockDim.x


@kernel
def copy(table, tile, first, count):
    """Rows of a table from `first` on to the start of a tile, element by element among the threads of the block."""
    if table.ndim == 1:
        for k in range(rank(), count, THREADS):
            tile[k] = table[first + k]
    elif table.ndim == 2:
        wide = table.shape[1]
        for k in range(rank(), count * wide, THREADS):
            tile[k // wide, k % wide] = table[first + k // wide, k % wide]
    else:
        wide, size = table.shape[2], table.shape[1] * table.shape[2]
        for k in range(rank(), count * size, THREADS):
            tile[k // size, k % size // wide, k % wide] = table[first + k // size, k % size // wide, k % wide]


@kernel
def fetch(table, tile, first):
    """As many rows from `first` on as the tile holds; how many."""
    count = min(len(tile), len(table) - first)
    cuda.syncthreads()
    copy(table, tile, first, count)
    cuda.syncthreads()
    return count


@kernel
def fetch_polygons(scene, first):
    """As many polygons from `first` on as the tiles hold, their corners counted from the start of the tile."""
    ranges, tile, range_tile = scene.polygon_ranges, scene.polygon_tile, scene.polygon_range_tile
    corner, count, corners = ranges[first, 0], 0, 0
    while count < len(range_tile) and first + count < len(ranges):
        more = ranges[first + count, 0] + ranges[first + count, 1] - corner
        if more > len(tile):
            break
        count, corners = count + 1, more
    cuda.syncthreads()
    for k in range(rank(), count, THREADS):
        range_tile[k, 0], range_tile[k, 1] = ranges[first + k, 0] - corner, ranges[first + k, 1]
    copy(scene.polygon_corners, tile, corner, corners)
    cuda.syncthreads()
    return count


@kernel
def nearest_in_tiles(scene, origin, direction, best):
    """Distance to the nearest shape not farther than `best`, and its number (HIT-2), of all kinds but CSG.

    -1 for a miss. Also how many shapes these were.
    """
    index, before = -1, 0
    if SPHERE:
        table, tile = scene.spheres, scene.sphere_tile
        for first in range(0, len(table), len(tile)):
            count = fetch(table, tile, first)
            best, index = nearest_sphere(tile[:count], origin, direction, best, index, before + first)
        before += len(table)
    if BOX:
        table, tile = scene.boxes, scene.box_tile
        for first in range(0, len(table), len(tile)):
            count = fetch(table, tile, first)
            best, index = nearest_box(tile[:count], origin, direction, best, index, before + first)
        before += len(table)
    if POLYGON:
        tile, range_tile = scene.polygon_tile, scene.polygon_range_tile
        first = 0
        while first < len(scene.polygon_ranges):
            count = fetch_polygons(scene, first)
            best, index = nearest_polygon(tile, range_tile[:count], origin, direction, best, index, before + first)
            first += count
        before += len(scene.polygon_ranges)
    if ELLIPSOID:
        table, tile = scene.ellipsoids, scene.ellipsoid_tile
        for first in range(0, len(table), len(tile)):
            count = fetch(table, tile, first)
            best, index = nearest_ellipsoid(tile[:count], origin, direction, best, index, before + first)
        before += len(table)
    if MESH:
        table, tile = scene.triangles, scene.triangle_tile
        for first in range(0, len(table), len(tile)):
            count = fetch(table, tile, first)
            best, index = nearest_triangle(tile[:count], origin, direction, best, index, before + first)
        before += len(table)
    return best, index, before
