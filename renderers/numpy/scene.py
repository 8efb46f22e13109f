"""The scene of a job as arrays of one precision (NUM-1), and the search for hits in it (HIT-1, HIT-2, HIT-5)."""

import numpy as np

from .contact import Contact
from .media import Media
from .random import Points
from .shapes.box import Boxes
from .shapes.csg import Box, Csg, Mesh, Solid
from .shapes.ellipsoid import Ellipsoids
from .shapes.mesh import Meshes, Triangles
from .shapes.polygon import Polygons
from .shapes.sphere import Spheres
from .vector import of_rays


class Scene:
    """Lights, materials and shapes, and the job's parameters.

    `kinds` holds the kinds of shape that the scene has, in the order of HIT-2, each with the number of its first
    shape: all shapes are numbered in that order, each triangle of a mesh is one. `objects`, `diffuse` (3, shapes),
    `k_s`, `exponent`, `rough`, `lobe`, `clear` and `flat` have an entry for each shape; `refractive_index`, `mu` and
    `attenuation` (3, materials + 1) one for each material, and AIR last.
    """

    def __init__(self, job, precision):
        self.precision, self.seed = precision, job.seed
        self.offset, self.epsilon = job.offset, job.epsilon
        self.depth = job.depth if "reflection" in job.needs else 0
        self.shadows, self.soft, self.feelers = job.shadows, "soft" in job.needs, job.feelers
        self.transmits, self.attenuates = "transmission" in job.needs, "attenuation" in job.needs
        materials = _load(job, "materials").T
        rough = (materials[3] > 0) & (materials[10] > 0)
        self.glossy_rays = job.glossy_rays if "glossy" in job.needs and rough.any() else 0  # G of GLO-1
        self.glossy_study = job.glossy_weight == "study"
        self.branches = max(self.glossy_rays, 1) + 1  # B (RND-4)
        self.chain = not self.transmits and self.glossy_rays <= 1
        self.cuts, self.cutoff = "cutoff" in job.needs, job.cutoff
        self.draws = self.glossy_rays > 0 or self.soft  # on the way, beyond the eye

        self.ambient, self.background = (_load(job, name).astype(precision)[:, np.newaxis] for name in LIGHTING)
        lights = _load(job, "lights").astype(precision)[:, :, np.newaxis]
        self.lights = [(light[:3], light[3:6], light[6]) for light in lights]
        self.points = None  # SOB-1
        if job.sampler == "sobol":
            soft = self.soft and self.feelers > 0 and any(radius > 0 for _, _, radius in self.lights)
            ways = "lens" in job.needs and job.lens_radius > 0, len(lights) if soft else 0, self.glossy_rays > 0
            self.points = Points(job.seed, precision, _load(job, "sobol"), *ways)

        self.kinds, counts, ids = [], [], [np.zeros((0, 2), np.int32)]
        for name, make in KINDS.items():
            rows = _load(job, name + "_ids")
            if len(rows):
                kind = make(job, precision)
                self.kinds.append((sum(counts), kind))
                counts.append(len(kind))
                ids.append(rows if name != "mesh" else np.repeat(rows, _load(job, "mesh_ranges")[:, 1], axis=0))
        self.objects, rows = np.concatenate(ids).T
        self.flat = np.concatenate([np.zeros(0, bool), *(_flat(kind) for _, kind in self.kinds)])

        self.diffuse, (self.k_s, self.exponent) = np.split(materials[:5, rows].astype(precision), [3])
        self.rough = rough[rows]
        self.lobe = (2 / np.where(rough, materials[10], 1) ** 2 - 2)[rows].astype(precision)  # GLO-2
        eps_r, mu_r, *air = _load(job, "air")
        self.mu = np.append(materials[9], mu_r)
        self.refractive_index = np.sqrt(np.append(materials[8], eps_r) * self.mu).astype(precision)  # REF-1
        self.mu = self.mu.astype(precision)
        attenuation = np.column_stack([materials[5:8], air])
        opaque = (attenuation == 0).all(axis=0)
        self.clear = ~opaque[rows]  # MED-1
        self.attenuation = np.where(opaque, 1, attenuation).astype(precision)  # ATT-1
        ranked = _load(job, "media") if "media" in job.needs else []
        self.media = Media(ranked, self.objects, rows, materials.shape[1])
        touches = "contact" in job.needs and job.merge == "tolerant"
        self.contact = Contact(self, _load(job, "precedence")) if touches else None

    def nearest(self, origins, directions):
        """Distance t (N,) to the first hit of each ray, inf if none, and number of the shape, -1 if none."""
        t = np.full(directions.shape[1], np.inf, self.precision)
        shapes = np.full(directions.shape[1], -1)
        for first, kind in self.kinds:
            kind.nearest(first, origins, directions, t, shapes)
        return t, shapes

    def blocked(self, origins, directions, limits):
        """Whether anything is hit with 0 < t < limit (N,) (HIT-5)."""
        blocked = np.zeros(len(limits), bool)
        for _, kind in self.kinds if len(limits) else ():
            kind.block(origins, directions, limits, blocked)
        return blocked

    def surface(self, shapes, origins, directions, t):
        """Points, normals (3, N) and sizes where ray i hits shape `shapes[i]` at the distance t[i] (HIT-3, HIT-4)."""
        if len(self.kinds) == 1:
            return self.kinds[0][1].surface(shapes, origins, directions, t)
        points, normals = np.empty((2, *directions.shape), self.precision)
        sizes = np.empty_like(t)
        for first, kind in self.kinds:
            rays = np.flatnonzero((shapes >= first) & (shapes < first + len(kind)))
            points[:, rays], normals[:, rays], sizes[rays] = kind.surface(
                shapes[rays] - first, of_rays(origins, rays), directions[:, rays], t[rays]
            )
        return points, normals, sizes


LIGHTING = "ambient", "background"


def _load(job, name):
    return np.load(job.array(name))


def _spheres(job, precision):
    return Spheres(_load(job, "spheres"), precision, job.sphere)


def _boxes(job, precision):
    return Boxes(_load(job, "boxes"), precision)


def _polygons(job, precision):
    return Polygons(_load(job, "polygon_vertices"), _load(job, "polygon_ranges"), precision)


def _ellipsoids(job, precision):
    return Ellipsoids(_load(job, "ellipsoids"), precision, job.sphere)


def _meshes(job, precision):
    return Meshes(_load(job, "mesh_vertices"), _load(job, "mesh_triangles"), _load(job, "mesh_ranges"), precision)


def _csg(job, precision):
    spheres = Spheres(_load(job, "csg_spheres"), precision)
    boxes = Boxes(_load(job, "csg_boxes"), precision)
    ellipsoids = Ellipsoids(_load(job, "csg_ellipsoids"), precision)
    meshes = _load(job, "csg_meshes")

    def mesh(row):
        first, count = meshes[row]
        corners = _load(job, "mesh_triangles")[first : first + count]
        return Mesh(Triangles(_load(job, "mesh_vertices"), corners, precision))

    make = [
        lambda row: Solid(spheres, row),
        lambda row: Box(boxes, row),
        lambda row: Solid(ellipsoids, row),
        mesh,
    ]
    code, ranges = _load(job, "csg_code"), _load(job, "csg_ranges")
    return Csg(lambda kind, row: make[kind](row), code, ranges, precision, job.sliver)


def _flat(kind):
    """Whether each of these shapes bounds no medium (MED-4)."""
    if isinstance(kind, Meshes):
        return ~kind.closed
    return np.full(len(kind), isinstance(kind, Polygons))


KINDS = {  # in the order of HIT-2
    "sphere": _spheres,
    "box": _boxes,
    "polygon": _polygons,
    "ellipsoid": _ellipsoids,
    "mesh": _meshes,
    "csg": _csg,
}
