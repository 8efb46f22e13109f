"""CSG solids: expressions over parts, by the boundaries of all parts along a line (CSG-1 to CSG-6)."""

from typing import Any, NamedTuple

import numpy as np

from ..vector import dot, largest, of_rays
from .shapes import Shapes

OR, AND, NOT = 4, 5, 6


class Solid:
    """A sphere, box or ellipsoid as a part: number `row` of the shapes `kind`."""

    def __init__(self, kind, row):
        self.kind, self.row = kind, row

    def boundaries(self, origins, directions):
        """Distances (2, N) of the crossings, infinite where there is none, and names (2, N) of the faces crossed."""
        t = np.full((2, directions.shape[1]), np.inf, directions.dtype)
        rays, distances = self.kind.boundaries(self.row, origins, directions)
        t[:, rays] = distances
        return t, np.broadcast_to([[0], [1]], t.shape)

    def extent(self):
        """Its size."""
        return self.kind.sizes[self.row]

    def surface(self, faces, origins, directions, t):
        """Points, normals (3, N) and sizes where ray i crosses face `faces[i]` at t[i]."""
        return self.kind.surface(np.full(len(faces), self.row), origins, directions, t)


class Box(Solid):
    def surface(self, faces, origins, directions, t):
        return self.kind.surface(np.full(len(faces), self.row), origins, directions, t, enters=faces == 0)


class Mesh:
    """A closed mesh as a part."""

    def __init__(self, triangles):
        self.triangles = triangles

    def boundaries(self, origins, directions):
        """Distances (n, N) of the crossings, infinite after a line's last, and triangles (n, N) crossed."""
        found = [*self.triangles.crossings(origins, directions, once=True)]
        if not found:  # no rays
            return np.full((0, 0), np.inf, directions.dtype), np.zeros((0, 0), int)
        triangles, rays, distances = map(np.concatenate, zip(*found, strict=True))
        order = np.argsort(rays, kind="stable")
        triangles, rays, distances = triangles[order], rays[order], distances[order]
        counts = np.bincount(rays, minlength=directions.shape[1])
        ranks = np.arange(len(rays)) - (np.cumsum(counts) - counts)[rays]
        t = np.full((counts.max(initial=0), len(counts)), np.inf, directions.dtype)
        faces = np.zeros(t.shape, int)
        t[ranks, rays], faces[ranks, rays] = distances, triangles
        return t, faces

    def extent(self):
        """Its largest size."""
        return self.triangles.sizes.max()

    def surface(self, faces, origins, directions, t):
        return *self.triangles.points(faces, origins, directions, t), self.triangles.sizes[faces]


class Hits(NamedTuple):
    """Where rays hit one solid first."""

    rays: Any  # (n,)
    t: Any
    owners: Any  # the parts' numbers
    faces: Any
    enters: Any  # whether into the solid


class Csg(Shapes):
    """The CSG solids of a scene: for each a list of parts and its postfix code, with the numbers of the parts in it."""

    def __init__(self, make, code, ranges, precision, sliver=None):
        """`make(kind, row)` makes a part of what a row of the job's code names."""
        self.codes = [code[first : first + count].copy() for first, count in ranges]
        self.parts = []
        for rows in self.codes:
            leaves = rows[rows[:, 0] < OR]
            self.parts.append([make(kind, row) for kind, row in leaves])
            rows[rows[:, 0] < OR, 1] = np.arange(len(leaves))
        self.tolerance = np.dtype(precision).type(sliver or 16 * np.finfo(precision).eps / 2)  # CSG-4: 16 u (NUM-2)

    def __len__(self):
        return len(self.codes)

    def hits(self, shape, origins, directions):
        """The rays that hit solid number `shape`: their indices, and the distances t (CSG-5)."""
        hits = self._hits(shape, origins, directions)
        return hits.rays, hits.t

    def surface(self, shapes, origins, directions, t):
        """Points, normals (3, N) and sizes where ray i hits solid `shapes[i]` (CSG-5)."""
        points, normals = np.empty((2, *directions.shape), directions.dtype)
        sizes = np.empty_like(t)
        for shape in np.unique(shapes):
            rays = np.flatnonzero(shapes == shape)
            hits = self._hits(shape, of_rays(origins, rays), directions.take(rays, axis=1))
            rays = rays[hits.rays]
            d = directions.take(rays, axis=1)
            crossing = hits.owners, hits.faces, of_rays(origins, rays), d, hits.t
            points[:, rays], outward, sizes[rays] = surface_of(self.parts[shape], *crossing)
            d_dot_n = dot(d, outward)
            turn = np.where(hits.enters, d_dot_n > 0, d_dot_n < 0)
            normals[:, rays] = np.where(turn, -outward, outward)
        return points, normals, sizes

    def _hits(self, shape, origins, directions):
        """Where the rays hit solid number `shape`."""
        parts = self.parts[shape]
        found = [part.boundaries(origins, directions) for part in parts]
        t, faces = (np.concatenate(arrays) for arrays in zip(*found, strict=True))
        owners = np.repeat(np.arange(len(parts)), [len(distances) for distances, _ in found])
        front = ((t > 0) & (t < np.inf)).any(axis=0)
        rays = np.flatnonzero(front)
        t = t.take(rays, axis=1)
        order = np.argsort(t, axis=0, kind="stable")
        t, owners, faces = np.take_along_axis(t, order, axis=0), owners[order], faces[order, rays]
        inside = [np.logical_xor.accumulate(owners == part, axis=0) for part in range(len(parts))]
        value = evaluate(self.codes[shape], inside)  # beyond each boundary (CSG-3)
        at_first = evaluate(self.codes[shape], [np.zeros((1, len(rays)), bool)] * len(parts))
        changes = (value != np.concatenate([at_first, value[:-1]])) & (t < np.inf)
        kept = self._kept(parts, changes, owners, faces, of_rays(origins, rays), directions.take(rays, axis=1), t)
        kept &= t > 0
        hit = np.flatnonzero(kept.any(axis=0))
        at = kept[:, hit].argmax(axis=0) if len(hit) else hit, hit  # of meshes that no line crosses there are no rows
        return Hits(rays[hit], t[at], owners[at], faces[at], value[at])

    def _kept(self, parts, changes, owners, faces, origins, directions, t):
        """Those of the boundaries `changes` of a solid that do not bound a sliver or a gap (CSG-4)."""
        _, rays = at = np.nonzero(changes)
        d = directions.take(rays, axis=1)
        crossing = owners[at], faces[at], of_rays(origins, rays), d, t[at]
        _, normals, sizes = surface_of(parts, *crossing)
        steep, size, extent = np.zeros((3, *t.shape), t.dtype)
        steep[at], size[at] = np.abs(dot(d, normals)), sizes
        extent[at] = np.maximum(np.maximum(largest(crossing[2] + t[at] * d), largest(crossing[2])), sizes)
        kept = np.zeros_like(changes)
        stack = np.zeros(t.shape, int)  # boundaries kept, of each ray
        depths = np.zeros(t.shape[1], int)
        for k in range(len(t)):
            rays = np.flatnonzero(changes[k])
            last = stack[depths[rays] - 1, rays]
            reach = self.tolerance * np.maximum(extent[last, rays], size[k, rays])
            thin = t[k, rays] - t[last, rays] <= reach / np.minimum(steep[last, rays], steep[k, rays])
            thin &= depths[rays] > 0
            kept[last[thin], rays[thin]] = False
            depths[rays[thin]] -= 1
            rays = rays[~thin]
            stack[depths[rays], rays] = k
            depths[rays] += 1
            kept[k, rays] = True
        return kept


def evaluate(code, inside):
    """The value of a solid's expression where its parts are or are not, `inside` (CSG-3)."""
    stack = []
    for kind, row in code:
        if kind == OR:
            stack[-2:] = [stack[-2] | stack[-1]]
        elif kind == AND:
            stack[-2:] = [stack[-2] & stack[-1]]
        elif kind == NOT:
            stack[-1] = ~stack[-1]
        else:
            stack.append(inside[row])
    return stack[0]


def surface_of(parts, owners, faces, origins, directions, t):
    """Points, normals (3, N) and sizes where ray i crosses face `faces[i]` of part `owners[i]` at t[i]."""
    points, normals = np.empty((2, *directions.shape), directions.dtype)
    sizes = np.empty_like(t)
    for number, part in enumerate(parts):
        rays = np.flatnonzero(owners == number)
        if len(rays):
            found = part.surface(faces[rays], of_rays(origins, rays), directions.take(rays, axis=1), t[rays])
            points[:, rays], normals[:, rays], sizes[rays] = found
    return points, normals, sizes
