"""Spheres (SPH-1 to SPH-3)."""

import numpy as np

from .shape import Shapes
from .vector import dot, normalise, of_rays


class Spheres(Shapes):
    """The spheres of a scene: centres (3, S) and radii (S,). `method` is that of SPH-3."""

    def __init__(self, rows, precision, method="robust"):
        rows = rows.T.astype(precision)
        self.centres, self.radii = rows[:3], rows[3]
        self.root = {"robust": None, "textbook": textbook, "stable": stable}[method]

    def __len__(self):
        return len(self.radii)

    def hits(self, shape, origins, directions):
        """The rays that hit sphere number `shape`: their indices, and the distances t (SPH-1)."""
        if self.root:
            return self._solve(shape, origins, directions)
        rays, *roots = self._meet(shape, origins, directions)
        return rays, first_root(*roots)

    def boundaries(self, shape, origins, directions):
        """The rays whose lines cross sphere number `shape`, and the distances t (2, n) of the crossings (CSG-1)."""
        rays, *roots = self._meet(shape, origins, directions)
        return rays, both_roots(*roots)

    def surface(self, shapes, origins, directions, t):
        """Points, outward normals (3, N) and sizes where ray i hits sphere `shapes[i]` at the distance t[i] (SPH-2)."""
        centres, radii = self.centres.take(shapes, axis=1), self.radii[shapes]
        normals = normalise(origins + t * directions - centres)
        return centres + radii * normals, normals, radii

    def _meet(self, shape, origins, directions):
        """The rays whose lines meet sphere number `shape`, and their k, b and √Δ."""
        r2 = self.radii[shape] * self.radii[shape]
        f = origins - self.centres[:, shape, np.newaxis]
        h = dot(f, directions)  # -b
        l = h * directions  # noqa: E741, the SPEC's letter
        l2 = dot(np.subtract(f, l, out=l), l)
        rays = np.flatnonzero(l2 <= r2)
        f = of_rays(f, rays)
        return rays, dot(f, f) - r2, -h[rays], np.sqrt(r2 - l2[rays])

    def _solve(self, shape, origins, directions):
        """As `hits`, from the coefficients of the equation (SPH-3)."""
        f = origins - self.centres[:, shape, np.newaxis]
        a, h = dot(directions, directions), 2 * dot(f, directions)
        k = dot(f, f) - self.radii[shape] * self.radii[shape]
        discriminant = h * h - 4 * a * k
        rays = np.flatnonzero(discriminant >= 0)
        k = np.broadcast_to(k, h.shape)  # eye rays share their origin
        return rays, self.root(a[rays], h[rays], k[rays], np.sqrt(discriminant[rays]))


def textbook(a, h, k, s):
    """The smaller of the two distances with t > 0, if there is one, where s is √D (SPH-3)."""
    near = (-h - s) / (2 * a)
    return np.where(near > 0, near, (-h + s) / (2 * a))


def stable(a, h, k, s):
    """The same without subtracting √D from a number close to it (SPH-3)."""
    q = -(h + np.where(h >= 0, s, -s)) / 2
    x, y = q / a, k / q
    return np.where((x > 0) & ~((y > 0) & (y < x)), x, y)


def first_root(k, b, s, a=1):
    """Distance to a sphere or ellipsoid that the ray's line meets; negative if it lies behind (SPH-1, ELL-1).

    `s` is √(a Δ). No line with Δ ≥ 0 has k > 0 and b = 0, for then Δ = -k.
    """
    q = b + np.where(b >= 0, s, -s)
    return np.where((k <= 0) & (b >= 0), q / a, k / q)


def both_roots(k, b, s, a=1):
    """Distances (2, n) to the two sides of a sphere or ellipsoid that the line meets (CSG-1)."""
    q = b + np.where(b >= 0, s, -s)
    x, y = q / a, np.where(q == 0, 0, k / q)
    return np.where(b >= 0, [y, x], [x, y])
