"""Ellipsoids of a centre and three semi-axes (ELL-1, ELL-2): images of the unit sphere."""

import numpy as np

from .sphere import first_root
from .vector import coordinates, dot, normalise, of_rays, reciprocal


class Ellipsoids:
    """The ellipsoids of a scene: centres (3, E), semi-axes and their reciprocal vectors g (axis, 3, E)."""

    def __init__(self, rows, precision):
        centres, *axes = rows.T.reshape(4, 3, -1)
        axes = np.stack(axes)
        self.centres = centres.astype(precision)
        self.axes = axes.astype(precision)
        self.g = reciprocal(axes).astype(precision)
        self.sizes = np.abs(self.axes).max(axis=(0, 1))

    def __len__(self):
        return self.centres.shape[1]

    def hits(self, shape, origins, directions):
        """The rays that hit ellipsoid number `shape`: their indices, and the distances t (ELL-1)."""
        f, delta = self._unit_sphere(slice(shape, shape + 1), origins, directions)
        a, b = dot(delta, delta), -dot(f, delta)
        l = f + (b / a) * delta  # noqa: E741, the SPEC's letter
        discriminant = 1 - dot(l, l)
        rays = np.flatnonzero(discriminant >= 0)
        f, a = of_rays(f, rays), a[rays]
        return rays, first_root(dot(f, f) - 1, b[rays], np.sqrt(a * discriminant[rays]), a)

    def surface(self, shapes, origins, directions, t):
        """Points and outward normals (3, N) where ray i hits ellipsoid `shapes[i]` at t[i] (ELL-2)."""
        f, delta = self._unit_sphere(shapes, origins, directions)
        on_unit = normalise(f + t * delta)[:, np.newaxis]
        points = self.centres[:, shapes] + (on_unit * self.axes[:, :, shapes]).sum(axis=0)
        return points, normalise((on_unit * self.g[:, :, shapes]).sum(axis=0))

    def _unit_sphere(self, shapes, origins, directions):
        """f = m(o) and δ: the rays where the ellipsoids `shapes` are the unit sphere (ELL-1)."""
        g = self.g[:, :, shapes]
        return coordinates(g, origins - self.centres[:, shapes]), coordinates(g, directions)
