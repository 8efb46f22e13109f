"""Spheres (SPH-1, SPH-2)."""

import numpy as np

from .vector import dot, normalise, of_rays


class Spheres:
    """The spheres of a scene: centres (3, S) and radii (S,)."""

    def __init__(self, rows, precision):
        rows = rows.T.astype(precision)
        self.centres, self.radii = rows[:3], rows[3]
        self.sizes = self.radii

    def __len__(self):
        return len(self.radii)

    def hits(self, shape, origins, directions):
        """The rays that hit sphere number `shape`: their indices, and the distances t (SPH-1)."""
        r2 = self.radii[shape] * self.radii[shape]
        f = origins - self.centres[:, shape, np.newaxis]
        h = dot(f, directions)  # -b
        l = h * directions  # noqa: E741, the SPEC's letter
        l2 = dot(np.subtract(f, l, out=l), l)
        rays = np.flatnonzero(l2 <= r2)
        f = of_rays(f, rays)
        return rays, first_root(dot(f, f) - r2, -h[rays], np.sqrt(r2 - l2[rays]))

    def surface(self, shapes, origins, directions, t):
        """Points and outward normals (3, N) where ray i hits sphere `shapes[i]` at the distance t[i] (SPH-2)."""
        centres = self.centres.take(shapes, axis=1)
        normals = normalise(origins + t * directions - centres)
        return centres + self.radii[shapes] * normals, normals


def first_root(k, b, s, a=1):
    """Distance to a sphere or ellipsoid that the ray's line meets; negative if it lies behind (SPH-1, ELL-1).

    `s` is √(a Δ). No line with Δ ≥ 0 has k > 0 and b = 0, for then Δ = -k.
    """
    q = b + np.where(b >= 0, s, -s)
    return np.where((k <= 0) & (b >= 0), q / a, k / q)
