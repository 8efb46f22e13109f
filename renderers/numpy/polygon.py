"""Convex planar polygons (POL-1 to POL-3)."""

import numpy as np

from .shape import Shapes
from .vector import dot, largest, normalise, of_rays


class Polygons(Shapes):
    """The polygons of a scene: first vertices and normals (3, P), and for each polygon its vertices and
    vectors in its plane, at right angles to the edges and pointing inside (3, m)."""

    def __init__(self, vertices, ranges, precision):
        polygons = [vertices[first : first + count].T for first, count in ranges]
        normals = np.stack([_normal(polygon) for polygon in polygons], axis=1)
        inward = [
            np.cross(normal, np.roll(polygon, -1, axis=1) - polygon, axisb=0).T
            for polygon, normal in zip(polygons, normals.T, strict=True)
        ]
        self.first = np.stack([polygon[:, 0] for polygon in polygons], axis=1).astype(precision)
        self.normals = normals.astype(precision)
        self.vertices = [polygon.astype(precision) for polygon in polygons]
        self.inward = [vectors.astype(precision) for vectors in inward]
        self.sizes = np.array([largest(each - each[:, :1]).max() for each in self.vertices])

    def __len__(self):
        return len(self.vertices)

    def hits(self, shape, origins, directions):
        """The rays that hit polygon number `shape`: their indices, and the distances t (POL-1, POL-2)."""
        first, normal = self.first[:, shape, np.newaxis], self.normals[:, shape, np.newaxis]
        t = dot(first - origins, normal) / dot(directions, normal)
        rays = np.flatnonzero((t > 0) & (t < np.inf))  # w = 0 makes t infinite or NaN
        t = t[rays]
        points = of_rays(origins, rays) + t * directions.take(rays, axis=1)
        inside = np.ones(len(rays), bool)
        for vertex, inward in zip(self.vertices[shape].T, self.inward[shape].T, strict=True):
            inside &= dot(inward, points - vertex[:, np.newaxis]) >= 0
        return rays[inside], t[inside]

    def surface(self, shapes, origins, directions, t):
        """Points, normals (3, N) towards the origin, and sizes where ray i hits polygon `shapes[i]` at t[i] (POL-3)."""
        normals = self.normals.take(shapes, axis=1)
        points = on_plane(origins + t * directions, self.first.take(shapes, axis=1), normals)
        return points, np.where(dot(directions, normals) < 0, normals, -normals), self.sizes[shapes]


def on_plane(points, first, normals):
    """The points moved onto the planes through `first` (HIT-4)."""
    points -= dot(points - first, normals) * normals
    return points


def _normal(polygon):
    """N (3,) of the vertices `polygon` (3, m), after Newell (POL-1)."""
    arms = polygon - polygon[:, :1]
    return normalise(np.cross(arms[:, :-1], arms[:, 1:], axis=0).sum(axis=1))
