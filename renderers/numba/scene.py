"""The scene as the kernel reads it, and the questions asked of all its shapes together."""

import math
from typing import NamedTuple

import numpy as np

from .box import any_box, box_surface, box_table, nearest_box
from .ellipsoid import any_ellipsoid, ellipsoid_surface, ellipsoid_table, nearest_ellipsoid
from .polygon import any_polygon, nearest_polygon, polygon_surface, polygon_table
from .sphere import any_sphere, nearest_sphere, sphere_surface
from .vector import kernel

# Columns of the table of materials, after the three of the diffuse colour.
SPECULAR, EXPONENT, INDEX, PERMEABILITY = 3, 4, 5, 6

# Rows of the table of colours.
AMBIENT, BACKGROUND = 0, 1


class Scene(NamedTuple):
    """What the kernel reads. All numbers are of the job's precision, lengths in the scene's unit.

    The n shapes count on from spheres to boxes, polygons and ellipsoids, which is the order of HIT-2.
    """

    camera: np.ndarray  # (4, 3): C, u, v, e
    sample: np.ndarray  # (2,): place in the pixel
    colours: np.ndarray  # (2, 3), linear RGB: ambient light, background
    air: np.ndarray  # (2,): refractive index, mu_r
    epsilon: float  # of OFF-1
    lights: np.ndarray  # (L, 6): position, linear RGB
    materials: np.ndarray  # (M, 7): diffuse linear RGB, k_s, m, refractive index, mu_r
    ids: np.ndarray  # int32 (n, 2): object, row of materials
    sizes: np.ndarray  # (n,): size of OFF-1
    spheres: np.ndarray  # (S, 4): centre, radius
    boxes: np.ndarray  # (B, 10, 3): see box.py
    polygon_corners: np.ndarray  # (V, 3, 3): see polygon.py
    polygon_ranges: np.ndarray  # int32 (P, 2): first corner, number
    ellipsoids: np.ndarray  # (E, 7, 3): see ellipsoid.py


def load(job, real):
    """The arrays of the job as the kernel's Scene, all numbers rounded once to the type `real` (NUM-1)."""

    def read(name):
        return np.load(job.array(name))

    def rounded(array):
        return np.ascontiguousarray(array, dtype=real)

    spheres, boxes, ellipsoids = read("spheres"), read("boxes"), read("ellipsoids")
    vertices, ranges = read("polygon_vertices"), read("polygon_ranges")
    corners, polygon_sizes = polygon_table(vertices, ranges)
    axis_sizes = [np.abs(shapes[:, 3:]).max(axis=1, initial=0) for shapes in (boxes, ellipsoids)]
    sizes = np.concatenate([spheres[:, 3], axis_sizes[0], polygon_sizes, axis_sizes[1]])
    ids = [read(name) for name in ("sphere_ids", "box_ids", "polygon_ids", "ellipsoid_ids")]
    materials, air = read("materials"), read("air")
    eps_r, mu_r = materials[:, 8], materials[:, 9]
    return Scene(
        camera=rounded(read("camera")),
        sample=rounded(job.sample),
        colours=rounded([read("ambient"), read("background")]),
        air=rounded([np.sqrt(air[0] * air[1]), air[1]]),
        epsilon=real(job.epsilon),
        lights=rounded(read("lights")[:, :6]),
        materials=rounded(np.column_stack([materials[:, :5], np.sqrt(eps_r * mu_r), mu_r])),
        ids=np.concatenate(ids),
        sizes=rounded(sizes),
        spheres=rounded(spheres),
        boxes=rounded(box_table(boxes)),
        polygon_corners=rounded(corners),
        polygon_ranges=ranges,
        ellipsoids=rounded(ellipsoid_table(ellipsoids)),
    )


@kernel
def nearest(scene, origin, direction):
    """Distance to the nearest shape and its number; inf and -1 for a miss (HIT-1, HIT-2)."""
    best, index, first = type(direction[0])(math.inf), -1, 0
    best, index = nearest_sphere(scene.spheres, origin, direction, best, index, first)
    first += len(scene.spheres)
    best, index = nearest_box(scene.boxes, origin, direction, best, index, first)
    first += len(scene.boxes)
    best, index = nearest_polygon(scene.polygon_corners, scene.polygon_ranges, origin, direction, best, index, first)
    first += len(scene.polygon_ranges)
    return nearest_ellipsoid(scene.ellipsoids, origin, direction, best, index, first)


@kernel
def surface(scene, index, origin, direction, t):
    """Point (HIT-4) and normal (HIT-3) of the hit at `t` on the shape `index`."""
    i = index
    if i < len(scene.spheres):
        return sphere_surface(scene.spheres, i, origin, direction, t)
    i -= len(scene.spheres)
    if i < len(scene.boxes):
        return box_surface(scene.boxes, i, origin, direction)
    i -= len(scene.boxes)
    if i < len(scene.polygon_ranges):
        return polygon_surface(scene.polygon_corners, scene.polygon_ranges, i, origin, direction, t)
    return ellipsoid_surface(scene.ellipsoids, i - len(scene.polygon_ranges), origin, direction, t)


@kernel
def occluded(scene, origin, direction, limit):
    """Whether a feeler is stopped before `limit` (HIT-5)."""
    return (
        any_sphere(scene.spheres, origin, direction, limit)
        or any_box(scene.boxes, origin, direction, limit)
        or any_polygon(scene.polygon_corners, scene.polygon_ranges, origin, direction, limit)
        or any_ellipsoid(scene.ellipsoids, origin, direction, limit)
    )
