"""Convex planar polygons (POL-1 to POL-3)."""

from typing import Any, NamedTuple

import numpy as np

from ..vector import dot, largest, normalise, of_rays
from .shapes import Shapes

GRAZING = 2.0**-10  # |w| of POL-1 below which rounding can move t past the polygon


class Frame(NamedTuple):
    """The frame of TRI-1 of each ray."""

    axes: Any  # (3, N): k_x, k_y, k_z
    origins: Any  # (3, N), along those axes
    shears: Any  # (3, N): S_x, S_y, S_z

    def of(self, rays):
        """The frames of some rays."""
        return Frame(*(values.take(rays, axis=1) for values in self))

    def place(self, vertex):
        """The vertex (3,) in each frame (3, N)."""
        x, y, z = vertex[self.axes] - self.origins
        return x - self.shears[0] * z, y - self.shears[1] * z, self.shears[2] * z


def frames(origins, directions):
    kz = np.abs(directions).argmax(axis=0)
    kx, ky = (kz + 1) % 3, (kz + 2) % 3
    down = np.take_along_axis(directions, kz[np.newaxis], axis=0)[0] < 0
    axes = np.stack([np.where(down, ky, kx), np.where(down, kx, ky), kz])
    x, y, z = np.take_along_axis(directions, axes, axis=0)
    from_ = np.take_along_axis(np.broadcast_to(origins, directions.shape), axes, axis=0)
    return Frame(axes, from_, np.stack([x / z, y / z, 1 / z]))


class Polygons(Shapes):
    """The polygons of a scene: first vertices and normals (3, P), and the vertices (3, m) of each."""

    def __init__(self, vertices, ranges, precision):
        polygons = [vertices[first : first + count].T for first, count in ranges]
        self.first = np.stack([polygon[:, 0] for polygon in polygons], axis=1).astype(precision)
        self.normals = np.stack([_normal(polygon) for polygon in polygons], axis=1).astype(precision)
        self.vertices = [polygon.astype(precision) for polygon in polygons]
        self.sizes = np.array([largest(each - each[:, :1]).max() for each in self.vertices])

    def __len__(self):
        return len(self.vertices)

    def seen(self, origins, directions):
        return origins, directions, frames(origins, directions)

    def hits(self, shape, origins, directions, frame):
        """The rays that hit polygon number `shape`: their indices, and the distances t (POL-1, POL-2)."""
        first, normal = self.first[:, shape, np.newaxis], self.normals[:, shape, np.newaxis]
        w = dot(directions, normal)
        height = dot(first - origins, normal)
        t = height / w
        grazes = (np.abs(w) < GRAZING) & (w != 0)
        rays = np.flatnonzero(grazes | ((t > 0) & (t < np.inf)))  # w = 0 makes t infinite or NaN
        frame = frame.of(rays)
        inside, crossings = cross_fan([frame.place(vertex) for vertex in self.vertices[shape].T])
        slack = 4 * np.finfo(t.dtype).eps * np.abs(normal)  # 8 u
        starts = of_rays(origins, rays)
        inside &= np.abs(of_rays(height[np.newaxis], rays)[0]) > dot(slack, np.abs(starts) + np.abs(first))
        t = np.where(grazes[rays], crossings, t[rays])
        return rays[inside], t[inside]

    def surface(self, shapes, origins, directions, t):
        """Points, normals (3, N) towards the origin, and sizes where ray i hits polygon `shapes[i]` at t[i] (POL-3)."""
        normals = self.normals.take(shapes, axis=1)
        points = on_plane(origins + t * directions, self.first.take(shapes, axis=1), normals)
        return points, np.where(dot(directions, normals) < 0, normals, -normals), self.sizes[shapes]


def cross_fan(places):
    """Which lines cross a triangle v_0, v_i, v_(i+1) of a polygon, and where, by TRI-1 (POL-2).

    places: x, y and z of each vertex in the rays' frames.
    """
    (ax, ay, az), (bx, by, bz) = places[:2]
    inside, t = np.zeros(ax.shape, bool), np.zeros_like(ax)
    w = ax * by - ay * bx
    for cx, cy, cz in places[2:]:
        u, v = bx * cy - by * cx, cx * ay - cy * ax
        det = u + v + w
        met = (((u >= 0) & (v >= 0) & (w >= 0)) | ((u <= 0) & (v <= 0) & (w <= 0))) & (det != 0)
        t = np.where(met, (u * az + v * bz + w * cz) / det, t)
        inside |= met
        w, bx, by, bz = -v, cx, cy, cz
    return inside, t


def on_plane(points, first, normals):
    """The points moved onto the planes through `first` (HIT-4)."""
    points -= dot(points - first, normals) * normals
    return points


def _normal(polygon):
    """N (3,) of the vertices `polygon` (3, m), after Newell (POL-1)."""
    arms = polygon - polygon[:, :1]
    return normalise(np.cross(arms[:, :-1], arms[:, 1:], axis=0).sum(axis=1))
