"""The meshes of a job, as Embree and as NumPy need them. Arrays are float32, vectors (3, N), but rows for Embree."""

import time

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def rows(a):
    return np.ascontiguousarray(a.T)


def normalise(a):
    """NUM-4"""
    return a / np.sqrt(dot(a, a))


class Scene:
    """All triangles as one mesh of Embree, whose numbers are those of the triangles in the job."""

    def __init__(self, job):
        def single(name):
            return np.load(job.array(name)).astype(np.float32)

        vertices, ranges = np.load(job.array("mesh_vertices")), np.load(job.array("mesh_ranges"))
        corners = [np.load(job.array("mesh_triangles"))[first : first + count] for first, count, _ in ranges]
        corners, meshes = (
            np.concatenate([np.empty((0, 3), np.int32), *corners]),
            np.repeat(np.arange(len(ranges)), ranges[:, 1]),
        )
        objects, materials = np.load(job.array("mesh_ids")).T
        self.objects, materials = objects[meshes], materials[meshes]
        self.closed = ranges[meshes, 2] != 0
        v0, v1, v2 = (vertices[corner] for corner in corners.T)
        self.normals = normalise(np.cross(v1 - v0, v2 - v0).T).astype(np.float32)
        self.first = v0.T.astype(np.float32)
        self.sizes = np.maximum(np.abs(v1 - v0).max(axis=1), np.abs(v2 - v0).max(axis=1)).astype(np.float32)  # OFF-1
        self.epsilon = np.float32(job.epsilon)
        self.camera, self.ambient, self.background = single("camera"), single("ambient"), single("background")
        self.lights = single("lights")
        table, air = np.load(job.array("materials"))[materials], np.load(job.array("air"))
        self.diffuse, self.k_s, self.exponent = (table.T[c].astype(np.float32) for c in (slice(0, 3), 3, 4))
        n, mu = np.sqrt(table[:, 8] * table[:, 9]), table[:, 9]
        n_of_air, mu_of_air = np.sqrt(air[0] * air[1]), air[1]
        self.entering = np.stack([n_of_air / n, mu_of_air / mu]).astype(np.float32)  # N and M of REF-1
        self.leaving = np.stack([n / n_of_air, mu / mu_of_air]).astype(np.float32)
        self.searching = 0.0  # s in Embree since it was last taken
        self.embree = EmbreeScene(robust=True)
        if len(corners):
            TriangleMesh(self.embree, vertices.astype(np.float32), corners.astype(np.int32))

    def build(self):
        """Builds the hierarchy: Embree does so at the first query."""
        self.embree.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))

    def nearest(self, origins, directions):
        """Distances and numbers of the triangles that rays hit, -1 for a miss (HIT-1)."""
        found = self._run(rows(origins), rows(directions), output=True)
        return found["tfar"], found["primID"]

    def blocked(self, origins, directions, limits):
        """Returns which feelers hit something nearer than their limit (HIT-5)."""
        return self._run(rows(origins), rows(directions), dists=limits, query="OCCLUDED") >= 0

    def _run(self, *rays, **how):
        start = time.monotonic()
        found = self.embree.run(*rays, **how)
        self.searching += time.monotonic() - start
        return found

    def parts(self):
        """Returns the seconds that Embree searched in each frame since the last call."""
        told, self.searching = self.searching, 0.0
        return {"search": told}

    def surface(self, triangles, origins, directions, t):
        """Points and normals of hits (TRI-2)."""
        normals, p = self.normals.take(triangles, axis=1), origins + t * directions
        points = p - dot(p - self.first.take(triangles, axis=1), normals) * normals
        away = self.closed[triangles] | (dot(directions, normals) < 0)
        return points, np.where(away, normals, -normals)
