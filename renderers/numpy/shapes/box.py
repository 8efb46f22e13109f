"""Boxes of a corner and three edges, at any angle (BOX-1, BOX-2)."""

import numpy as np

from ..vector import coordinates, dot, largest, reciprocal
from .shapes import Shapes


class Boxes(Shapes):
    """The boxes of a scene: corners (3, B), edges, reciprocal vectors g and normals (axis, 3, B)."""

    def __init__(self, rows, precision):
        corners, *edges = rows.T.reshape(4, 3, -1)
        edges = np.stack(edges)
        g = reciprocal(edges)
        self.corners = corners.astype(precision)
        self.edges = edges.astype(precision)
        self.g = g.astype(precision)
        self.normals = (g / np.linalg.norm(g, axis=1, keepdims=True)).astype(precision)
        self.sizes = largest(self.edges).max(axis=0)

    def __len__(self):
        return self.corners.shape[1]

    def hits(self, shape, origins, directions):
        """The rays that hit box number `shape`: their indices, and the distances t (BOX-1)."""
        entry, leave, _ = self._slabs(slice(shape, shape + 1), origins, directions)
        t0, t1 = entry.max(axis=0), leave.min(axis=0)
        t = np.where(t0 > 0, t0, t1)
        rays = np.flatnonzero((t0 <= t1) & (t > 0))
        return rays, t[rays]

    def boundaries(self, shape, origins, directions):
        """The rays whose lines cross box number `shape`, and the distances t (2, n) of the crossings (CSG-1)."""
        entry, leave, _ = self._slabs(slice(shape, shape + 1), origins, directions)
        t0, t1 = entry.max(axis=0), leave.min(axis=0)
        rays = np.flatnonzero(t0 <= t1)
        return rays, np.stack([t0[rays], t1[rays]])

    def surface(self, shapes, origins, directions, t, enters=None):
        """Points, outward normals (3, N) and sizes where ray i hits box `shapes[i]` at the distance t[i] (BOX-2).

        It is hit where the ray enters it if that is in front of the ray, or where `enters` says so.
        """
        entry, leave, w = self._slabs(shapes, origins, directions)
        if enters is None:
            enters = entry.max(axis=0) > 0
        axis = np.where(enters, entry.argmax(axis=0), leave.argmin(axis=0))
        high = (w[axis, np.arange(len(axis))] < 0) == enters
        outward = self.normals[axis, :, shapes].T
        normals = np.where(high, outward, -outward)
        on_face = self.corners[:, shapes] + np.where(high, self.edges[axis, :, shapes].T, 0)
        points = origins + t * directions
        return points - dot(points - on_face, normals) * normals, normals, self.sizes[shapes]

    def _slabs(self, shapes, origins, directions):
        """Distances (axis, N) where the rays enter and leave each slab of the boxes `shapes`, and w = g·d."""
        g = self.g[:, :, shapes]
        s = coordinates(g, origins - self.corners[:, shapes])
        w = coordinates(g, directions)
        low, high = (0 - s) / w, (1 - s) / w
        entry, leave = np.where(w > 0, low, high), np.where(w > 0, high, low)
        parallel = w == 0
        if parallel.any():
            between = (s >= 0) & (s <= 1)
            entry = np.where(parallel, -np.inf, entry)
            leave = np.where(parallel, np.where(between, np.inf, -np.inf), leave)
        return entry, leave, w
