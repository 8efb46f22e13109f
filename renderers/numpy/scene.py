"""The scene of a job as arrays of one precision (NUM-1), and the search for hits in it (HIT-1, HIT-2, HIT-5)."""

import numpy as np

from .box import Boxes
from .ellipsoid import Ellipsoids
from .polygon import Polygons
from .sphere import Spheres
from .vector import of_rays


class Scene:
    """Lights, materials and shapes.

    `kinds` holds the kinds of shape that the scene has, in the order of HIT-2, each with the number of its first
    shape: all shapes are numbered in that order. `objects`, `sizes` and what is known of their materials, from
    `diffuse` (3, shapes) to `mu`, have an entry for each shape.
    """

    def __init__(self, job, precision):
        def array(name):
            return np.load(job.array(name))

        def vector(name):
            return array(name).astype(precision)[:, np.newaxis]

        self.precision = precision
        self.epsilon = job.epsilon
        self.ambient, self.background = vector("ambient"), vector("background")
        self.air_refractive_index, self.air_mu = _index_and_mu(*array("air")[:2]).astype(precision)
        lights = array("lights").T.astype(precision)
        self.lights = [(lights[:3, i : i + 1], lights[3:6, i : i + 1]) for i in range(lights.shape[1])]

        kinds, ids = [], [np.zeros((0, 2), np.int32)]
        for name, make in (
            ("sphere", lambda: Spheres(array("spheres"), precision)),
            ("box", lambda: Boxes(array("boxes"), precision)),
            ("polygon", lambda: Polygons(array("polygon_vertices"), array("polygon_ranges"), precision)),
            ("ellipsoid", lambda: Ellipsoids(array("ellipsoids"), precision)),
        ):
            rows = array(name + "_ids")
            if len(rows):
                kinds.append((sum(map(len, ids)), make()))
                ids.append(rows)
        self.kinds = kinds
        self.objects, rows = np.concatenate(ids).T
        materials = array("materials")[rows].T
        self.diffuse, (self.k_s, self.exponent) = np.split(materials[:5].astype(precision), [3])
        self.refractive_index, self.mu = _index_and_mu(*materials[8:10]).astype(precision)
        self.sizes = np.concatenate([kind.sizes for _, kind in kinds] or [np.zeros(0, precision)])

    def nearest(self, origins, directions):
        """Distance t (N,) to the first hit of each ray, inf if none, and number of the shape, -1 if none."""
        t = np.full(directions.shape[1], np.inf, self.precision)
        shapes = np.full(directions.shape[1], -1)
        for first, kind in self.kinds:
            for shape in range(len(kind)):
                rays, distances = kind.hits(shape, origins, directions)
                closer = (distances > 0) & (distances < t[rays])
                rays = rays[closer]
                t[rays] = distances[closer]
                shapes[rays] = first + shape
        return t, shapes

    def blocked(self, origins, directions, limits):
        """Whether anything is hit with 0 < t < limit (N,) (HIT-5)."""
        blocked = np.zeros(len(limits), bool)
        for _, kind in self.kinds:
            for shape in range(len(kind)):
                rays, distances = kind.hits(shape, origins, directions)
                blocked[rays[(distances > 0) & (distances < limits[rays])]] = True
        return blocked

    def surface(self, shapes, origins, directions, t):
        """Points and normals (3, N) where ray i hits shape `shapes[i]` at the distance t[i] (HIT-3, HIT-4)."""
        if len(self.kinds) == 1:
            return self.kinds[0][1].surface(shapes, origins, directions, t)
        points, normals = np.empty((2, *directions.shape), self.precision)
        for first, kind in self.kinds:
            rays = np.flatnonzero((shapes >= first) & (shapes < first + len(kind)))
            points[:, rays], normals[:, rays] = kind.surface(
                shapes[rays] - first, of_rays(origins, rays), directions[:, rays], t[rays]
            )
        return points, normals


def _index_and_mu(eps_r, mu_r):
    """The refractive index √(ε_r μ_r) and μ_r (REF-1)."""
    return np.stack([np.sqrt(eps_r * mu_r), mu_r])
