"""The scene in the form that the kernel in lanes reads."""

from collections import namedtuple

import numpy as np

from . import shade, sphere
from .lanes import COUNT

SIDE = 32  # of a tile, in pixels
RAY_ROWS = 7  # of a ray that waits: origin, direction, weight

# Numbers of the job's precision, but for the integers of `ids`, `kept_ids` and `places`.
Scene = namedtuple(
    "Scene",
    [
        # Of three numbers, shape (1, 3). Each row of a larger array would be compiled for itself.
        "eye",  # C + e
        "u",  # of CAM-1
        "v",
        "e",
        "background",  # linear RGB, as is
        "ambient",
        "sample",  # (2,): place in the pixel
        "epsilon",  # of OFF-1
        "lights",  # (L, 3): positions
        "light_colours",  # (L, 3)
        "count",  # S, of spheres
        "spheres",  # (6, S and more): see sphere.py
        "ids",  # int32 (1, S and more): 0, 1, ..
        "surfaces",  # (13, S): see shade.py
        # Work memory, a block for each thread.
        "kept",  # as `spheres`, of those that the tile can see
        "kept_ids",  # as `ids`
        "rays",  # (threads, 7, rays and more): those of one order that wait
        "places",  # int32 (threads, 1, rays and more): the pixels that they are of, numbered as in render.py
        "colours",  # (threads, 3, rays and more): of the tile's pixels
    ],
)


def tiles(region):
    """The number of tiles."""
    x0, y0, x1, y1 = region
    return -(-(x1 - x0) // SIDE) * -(-(y1 - y0) // SIDE)


def load(job, real, threads):
    """The Scene of as many threads. All numbers are rounded once to the type `real` (NUM-1)."""

    def read(name):
        return np.load(job.array(name))

    def rounded(array):
        return np.ascontiguousarray(array, dtype=real)

    def block(rows, columns, dtype=real):
        return np.zeros((threads, rows, columns + COUNT), dtype)  # lanes may be read and written beyond the end

    camera, spheres, lights = read("camera"), read("spheres"), read("lights")
    count, pixels = len(spheres), SIDE * SIDE
    table = np.zeros((sphere.ROWS, count + COUNT))
    table[:, :count] = sphere_rows(spheres, np.finfo(real).eps)
    return Scene(
        eye=rounded(camera[:1] + camera[3:]),
        u=rounded(camera[1:2]),
        v=rounded(camera[2:3]),
        e=rounded(camera[3:]),
        sample=rounded(job.sample),
        background=rounded([read("background")]),
        ambient=rounded([read("ambient")]),
        epsilon=real(job.epsilon),
        lights=rounded(lights[:, :3]),
        light_colours=rounded(lights[:, 3:6]),
        count=count,
        spheres=rounded(table),
        ids=np.arange(count + COUNT, dtype=np.int32)[None],
        surfaces=rounded(surface_rows(spheres, read("materials")[read("sphere_ids")[:, 1]], read("air"))),
        kept=block(sphere.ROWS, count),
        kept_ids=block(1, count, np.int32),
        rays=block(RAY_ROWS, pixels),
        places=block(1, pixels, np.int32),
        colours=block(3, pixels),
    )


def sphere_rows(spheres, eps):
    """A ray whose b is below BEHIND is outside and moves away: |b| ≤ |f|, but for some u, and inside |f| ≤ r."""
    radius = spheres[:, 3]
    return np.vstack([spheres.T, radius**2, -(1 + 32 * eps) * radius])


def surface_rows(spheres, materials, air):
    """Of each sphere with its material, in AIR."""
    diffuse, specular, exponent = materials[:, :3], materials[:, 3], materials[:, 4]
    index, permeability = np.sqrt(materials[:, 8] * materials[:, 9]), materials[:, 9]
    n, m = np.sqrt(air[0] * air[1]) / index, air[1] / permeability
    rows = np.vstack([spheres.T, diffuse.T, specular, exponent, n, m, 1 / n, 1 / m])
    assert len(rows) == shade.ROWS
    return rows
