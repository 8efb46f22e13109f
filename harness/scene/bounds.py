"""Computes axis-aligned bounding boxes of objects: arrays (2, 3) of the low and the high corner.

A box whose low corner is above its high one is empty; a box from -inf to inf contains everything.
"""

import numpy as np

from harness.scene.model import Box, Csg, Ellipsoid, Mesh, Polygon, Sphere

_EMPTY = np.array([[np.inf] * 3, [-np.inf] * 3])
_ALL = -_EMPTY

# Relative to the largest coordinate of a box: a bound of rounding errors. Padded boxes with a common face touch.
PADDING = 2.0**-46


def bounds(objects):
    """The boxes (N, 2, 3) of the objects."""
    return np.array([_BOUNDS[type(thing)](thing) for thing in objects], np.float64).reshape(-1, 2, 3)


def padded(boxes):
    """The boxes (N, 2, 3), larger by a bound of rounding errors."""
    finite = np.where(np.isfinite(boxes), np.abs(boxes), 0)
    padding = PADDING * finite.max(axis=(1, 2), initial=0)[:, None, None]
    return boxes + padding * [[[-1.0], [1.0]]]


def volume(box):
    """The volume of a box, rounded to nine digits, so that equal shapes in different places have equal volumes."""
    return float(f"{np.maximum(box[1] - box[0], 0).prod():.8e}")


def _sphere(sphere):
    (x, y, z), r = sphere.centre, sphere.radius
    return (x - r, y - r, z - r), (x + r, y + r, z + r)


def _box(box):
    edges = np.array(box.edges)
    return box.corner + np.minimum(edges, 0).sum(axis=0), box.corner + np.maximum(edges, 0).sum(axis=0)


def _ellipsoid(ellipsoid):
    # The largest m . (x a1 + y a2 + z a3) over the unit sphere is the length of (m.a1, m.a2, m.a3).
    axes = np.array(ellipsoid.axes)
    reach = np.hypot(np.hypot(axes[0], axes[1]), axes[2])
    return ellipsoid.centre - reach, ellipsoid.centre + reach


def _polygon(polygon):
    return np.min(polygon.vertices, axis=0), np.max(polygon.vertices, axis=0)


def _mesh(mesh):
    return mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)


def _csg(csg):
    def part(thing):
        return np.array(_BOUNDS[type(thing)](thing))

    def either(a, b):
        return np.array([np.minimum(a[0], b[0]), np.maximum(a[1], b[1])])

    def both(a, b):
        box = np.array([np.maximum(a[0], b[0]), np.minimum(a[1], b[1])])
        return box if (box[0] <= box[1]).all() else _EMPTY

    return csg.fold(part, either, both, lambda _: _ALL)


_BOUNDS = {Sphere: _sphere, Box: _box, Ellipsoid: _ellipsoid, Polygon: _polygon, Mesh: _mesh, Csg: _csg}
