"""Triangles of meshes (TRI-1, TRI-2): tests every block of triangles against every block of rays."""

from typing import Any, NamedTuple

import numpy as np

from ..vector import dot, largest, normalise, of_rays
from .polygon import on_plane
from .shapes import Shapes

TRIANGLES = 64  # of a block
RAYS = 256  # of a block: its arrays stay in the processor's cache


class Block(NamedTuple):
    """Triangles that follow each other."""

    first: int  # number of the first
    vertices: Any  # (3, V), each once: neighbours share what is worked out for a vertex
    corners: Any  # (3, T), columns of `vertices`


class Triangles:
    """Triangles of `vertices` (V, 3) and rows `corners` (T, 3): first vertices and normals (3, T), and blocks."""

    def __init__(self, vertices, corners, precision):
        v0, v1, v2 = (vertices[corner] for corner in corners.T)
        cross = np.cross(v1 - v0, v2 - v0).T
        self.normals = normalise(cross).astype(precision)
        v0, v1, v2 = (v.T.astype(precision) for v in (v0, v1, v2))
        self.first = v0
        self.sizes = np.maximum(largest(v1 - v0), largest(v2 - v0))
        self.precision = precision
        self.blocks = []
        for first in range(0, len(corners), TRIANGLES):
            rows, columns = np.unique(corners[first : first + TRIANGLES].T, return_inverse=True)
            self.blocks.append(Block(first, vertices[rows].T.astype(precision), columns.reshape(3, -1)))

    def __len__(self):
        return len(self.sizes)

    def crossings(self, origins, directions, once=False):
        """Where lines `cross` triangles: for one block after the other, in the order of its triangles."""
        groups = list(shear(origins, directions))
        for block in self.blocks:
            for group in groups:
                yield cross(block, group, once)

    def points(self, triangles, origins, directions, t):
        """Points (3, N) and normals N where ray i hits triangle `triangles[i]` at t[i] (TRI-2)."""
        normals = self.normals.take(triangles, axis=1)
        return on_plane(origins + t * directions, self.first.take(triangles, axis=1), normals), normals


class Sheared(NamedTuple):
    """Rays with the same k_x, k_y and k_z (TRI-1)."""

    rays: Any  # (N,) their numbers
    axes: Any  # k_x, k_y, k_z
    origins: Any  # (3, N) or (3, 1)
    shears: Any  # S_x, S_y, S_z


def shear(origins, directions):
    """All rays, in groups of Sheared."""
    k = np.abs(directions).argmax(axis=0)
    turned = np.take_along_axis(directions, k[np.newaxis], axis=0)[0] < 0
    kinds = 2 * k + turned
    for kind in range(6):
        members = np.flatnonzero(kinds == kind)
        z = kind // 2
        x, y = (z + 1) % 3, (z + 2) % 3
        if kind % 2:
            x, y = y, x
        for begin in range(0, len(members), RAYS):
            rays = members[begin : begin + RAYS]
            d = directions.take(rays, axis=1)
            yield Sheared(rays, (x, y, z), of_rays(origins, rays), (d[x] / d[z], d[y] / d[z], 1 / d[z]))


def cross(block, group, once):
    """Triangles of `block` that the lines of `group` cross, those rays, and the distances t (TRI-1).

    A line through an edge crosses both its triangles, but where it passes between them `once`, one of them (CSG-2).
    """
    kx, ky, kz = group.axes
    sx, sy, sz = group.shears
    z = block.vertices[kz, :, np.newaxis] - group.origins[kz]
    x = block.vertices[kx, :, np.newaxis] - group.origins[kx] - sx * z
    y = block.vertices[ky, :, np.newaxis] - group.origins[ky] - sy * z
    (ax, bx, cx), (ay, by, cy) = (tuple(v.take(corner, axis=0) for corner in block.corners) for v in (x, y))
    u, v, w = cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax
    within = ((u >= 0) & (v >= 0) & (w >= 0)) | ((u <= 0) & (v <= 0) & (w <= 0))
    pairs = np.flatnonzero(within)
    triangles, rays = np.divmod(pairs, within.shape[1])
    u, v, w = (each.ravel()[pairs] for each in (u, v, w))
    column = rays if z.shape[1] > 1 else 0
    az, bz, cz = (sz[rays] * z[corner[triangles], column] for corner in block.corners)
    det = u + v + w
    t = (u * az + v * bz + w * cz) / det
    good = det != 0
    if once:
        good &= _crossed_once((u, v, w), *([p.ravel()[pairs] for p in each] for each in ((ax, bx, cx), (ay, by, cy))))
    good = np.flatnonzero(good)
    return block.first + triangles[good], group.rays[rays[good]], t[good]


def _crossed_once(values, x, y):
    """Whether U, V and W agree where one that is 0 has the sign of its edge (CSG-2)."""
    positive = []
    for value, first, second in zip(values, (1, 2, 0), (2, 0, 1), strict=True):
        run, rise = x[second] - x[first], y[second] - y[first]
        positive.append((value > 0) | ((value == 0) & ((rise > 0) | ((rise == 0) & (run > 0)))))
    return (positive[0] == positive[1]) & (positive[1] == positive[2])


class Meshes(Shapes):
    """The meshes of a scene; each of their triangles is a shape."""

    def __init__(self, vertices, triangles, ranges, precision):
        corners = [triangles[first : first + count] for first, count, _ in ranges]
        self.triangles = Triangles(vertices, np.concatenate(corners), precision)
        self.closed = np.repeat(ranges[:, 2] != 0, ranges[:, 1])

    def __len__(self):
        return len(self.triangles)

    def nearest(self, first, origins, directions, t, shapes):
        for triangles, rays, distances in self.triangles.crossings(origins, directions):
            closer = np.flatnonzero((distances > 0) & (distances < t[rays]))
            if len(closer):
                triangles, rays, distances = triangles[closer], rays[closer], distances[closer]
                np.minimum.at(t, rays, distances)
                best = np.flatnonzero(distances == t[rays])[::-1]  # the first of equals is written last (HIT-2)
                shapes[rays[best]] = first + triangles[best]

    def block(self, origins, directions, limits, blocked):
        for _, rays, distances in self.triangles.crossings(origins, directions):
            blocked[rays[(distances > 0) & (distances < limits[rays])]] = True

    def surface(self, shapes, origins, directions, t):
        """Points, normals (3, N) and sizes where ray i hits triangle `shapes[i]` at t[i] (TRI-2)."""
        points, normals = self.triangles.points(shapes, origins, directions, t)
        away = self.closed[shapes] | (dot(directions, normals) < 0)
        return points, np.where(away, normals, -normals), self.triangles.sizes[shapes]
