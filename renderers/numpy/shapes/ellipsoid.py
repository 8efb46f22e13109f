"""Ellipsoids of a centre and three semi-axes (ELL-1 to ELL-3): images of the unit sphere."""

import numpy as np

from ..vector import coordinates, dot, normalise, of_rays, reciprocal
from .shapes import Shapes
from .sphere import ROOTS, both_roots, first_root


class Ellipsoids(Shapes):
    """The ellipsoids of a scene: centres (3, E), semi-axes and their reciprocal vectors g (axis, 3, E).

    `method` is that of spheres.
    """

    def __init__(self, rows, precision, method="robust"):
        self.root = ROOTS.get(method)
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
        if self.root:
            return self._solve(shape, origins, directions)
        rays, *roots = self._meet(shape, origins, directions)
        return rays, first_root(*roots)

    def boundaries(self, shape, origins, directions):
        """The rays whose lines cross ellipsoid number `shape`, and the distances t (2, n) of the crossings (CSG-1)."""
        rays, *roots = self._meet(shape, origins, directions)
        return rays, both_roots(*roots)

    def surface(self, shapes, origins, directions, t):
        """Points, outward normals (3, N) and sizes where ray i hits ellipsoid `shapes[i]` at t[i] (ELL-2)."""
        f, delta = self._unit_sphere(shapes, origins, directions)
        on_unit = normalise(f + t * delta)[:, np.newaxis]
        points = self.centres[:, shapes] + (on_unit * self.axes[:, :, shapes]).sum(axis=0)
        return points, normalise((on_unit * self.g[:, :, shapes]).sum(axis=0)), self.sizes[shapes]

    def _meet(self, shape, origins, directions):
        """The rays whose lines meet ellipsoid number `shape`, and their k, b, √(a Δ) and a."""
        f, delta = self._unit_sphere(slice(shape, shape + 1), origins, directions)
        a, b = dot(delta, delta), -dot(f, delta)
        l = f + (b / a) * delta  # noqa: E741, the SPEC's letter
        discriminant = 1 - dot(l, l)
        rays = np.flatnonzero(discriminant >= 0)
        f, a = of_rays(f, rays), a[rays]
        return rays, dot(f, f) - 1, b[rays], np.sqrt(a * discriminant[rays]), a

    def _solve(self, shape, origins, directions):
        """As `hits`, from the coefficients of the equation (ELL-3)."""
        f, delta = self._unit_sphere(slice(shape, shape + 1), origins, directions)
        a, h, k = dot(delta, delta), 2 * dot(f, delta), dot(f, f) - 1
        discriminant = h * h - 4 * a * k
        rays = np.flatnonzero(discriminant >= 0)
        k = np.broadcast_to(k, h.shape)  # eye rays share their origin
        return rays, self.root(a[rays], h[rays], k[rays], np.sqrt(discriminant[rays]))

    def _unit_sphere(self, shapes, origins, directions):
        """f = m(o) and δ: the rays where the ellipsoids `shapes` are the unit sphere (ELL-1)."""
        g = self.g[:, :, shapes]
        return coordinates(g, origins - self.centres[:, shapes]), coordinates(g, directions)
