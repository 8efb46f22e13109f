"""Spheres (SPH-1 to SPH-3)."""

import numpy as np

from ..vector import dot, normalise, of_rays
from .exact import twoproduct, twosum
from .shapes import Shapes


class Spheres(Shapes):
    """The spheres of a scene: centres (3, S) and radii (S,). `method` is that of SPH-3."""

    def __init__(self, rows, precision, method="robust"):
        rows = rows.T.astype(precision)
        self.centres, self.radii = rows[:3], rows[3]
        self.sizes = self.radii
        self.root = ROOTS.get(method)
        self.meet = self._meet_widely if method == "wide" else self._meet
        is_narrow = method == "robust" and rows.dtype == np.float32
        self.unsure = 4 * np.finfo(rows.dtype).eps if is_narrow else 0  # 8 u of SPH-1

    def __len__(self):
        return len(self.radii)

    def hits(self, shape, origins, directions):
        """The rays that hit sphere number `shape`: their indices, and the distances t (SPH-1)."""
        if self.root:
            return self._solve(shape, origins, directions)
        if self.unsure:
            return self._hits_narrowly(shape, origins, directions)
        rays, *roots = self.meet(shape, origins, directions)
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
        r2, l2, *line = self._line(shape, origins, directions)
        return _roots(np.flatnonzero(l2 <= r2), r2, l2, *line)

    def _hits_narrowly(self, shape, origins, directions):
        """As `hits`; in twice the digits where rounding leaves the sign of Δ open."""
        r2, l2, f, h = self._line(shape, origins, directions)
        radius = self.radii[shape]
        is_open = np.abs(r2 - l2) < self.unsure * radius * (np.abs(h) + radius)
        rays, *roots = _roots(np.flatnonzero((l2 <= r2) & ~is_open), r2, l2, f, h)
        t, some = first_root(*roots), np.flatnonzero(is_open)
        if not some.size:
            return rays, t
        found, *roots = self._meet_widely(shape, of_rays(origins, some), directions.take(some, axis=1))
        return np.concatenate([rays, some[found]]), np.concatenate([t, first_root(*roots)])

    def _line(self, shape, origins, directions):
        """r², l·l, f and -b of SPH-1."""
        f = origins - self.centres[:, shape, np.newaxis]
        h = dot(f, directions)
        l = h * directions  # noqa: E741, the SPEC's letter
        return self.radii[shape] * self.radii[shape], dot(np.subtract(f, l, out=l), l), f, h

    def _meet_widely(self, shape, origins, directions):
        """As `_meet`, with f, l and k in twice the digits (SPH-3)."""
        r2, r2_error = twoproduct(self.radii[shape], self.radii[shape])
        f, e = twosum(origins, -self.centres[:, shape, np.newaxis])
        b = -dot(f, directions)
        p, q = twoproduct(b, directions)
        s, g = twosum(f, p)
        m = s + (g + q + e)
        l = m - dot(m, directions) * directions  # noqa: E741, the SPEC's letter
        l2 = dot(l, l)
        rays = np.flatnonzero(l2 <= r2)
        f, e = of_rays(f, rays), of_rays(e, rays)
        squares, errors = twoproduct(f, f)
        s = x = np.zeros_like(f[0])
        for axis in range(3):
            s, y = twosum(s, squares[axis])
            x = x + (y + errors[axis] + 2 * f[axis] * e[axis])
        s, y = twosum(s, -r2)
        return rays, s + (x + (y - r2_error)), b[rays], np.sqrt(r2 - l2[rays])

    def _solve(self, shape, origins, directions):
        """As `hits`, from the coefficients of the equation (SPH-3)."""
        f = origins - self.centres[:, shape, np.newaxis]
        a, h = dot(directions, directions), 2 * dot(f, directions)
        k = dot(f, f) - self.radii[shape] * self.radii[shape]
        discriminant = h * h - 4 * a * k
        rays = np.flatnonzero(discriminant >= 0)
        k = np.broadcast_to(k, h.shape)  # eye rays share their origin
        return rays, self.root(a[rays], h[rays], k[rays], np.sqrt(discriminant[rays]))


def _roots(rays, r2, l2, f, h):
    """`rays`, and their k, b and √Δ."""
    f = of_rays(f, rays)
    return rays, dot(f, f) - r2, -h[rays], np.sqrt(r2 - l2[rays])


def textbook(a, h, k, s):
    """The smaller of the two distances with t > 0, if there is one, where s is √D (SPH-3)."""
    near = (-h - s) / (2 * a)
    return np.where(near > 0, near, (-h + s) / (2 * a))


def stable(a, h, k, s):
    """The same without subtracting √D from a number close to it (SPH-3)."""
    q = -(h + np.where(h >= 0, s, -s)) / 2
    x, y = q / a, k / q
    return np.where((x > 0) & ~((y > 0) & (y < x)), x, y)


ROOTS = {"textbook": textbook, "stable": stable}


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
