"""Finds whether a surface of a ranked clear solid can lie where another object has one too, over an area (MED-6).

Conservative: what it takes for touching may only come close, or touch outside of a CSG solid's surface. What crosses at
an angle does not touch.
"""

from typing import NamedTuple

import numpy as np

from harness.scene.bounds import bounds, padded
from harness.scene.media import OPAQUE, density, solid
from harness.scene.model import Box, Csg, Ellipsoid, Mesh, Polygon, Sphere

# Distances count as none up to this share of a face's extent, and of the coordinates: 4 times what float32 takes for
# one place (OFF-1). Faces at smaller angles than the first, in radians, count as parallel.
OF_EXTENT, OF_COORDINATES = 2.0**-17, 2.0**-20
MOST_PAIRS = 1 << 24  # of faces; two objects with more that come close count as touching


class Flats(NamedTuple):
    """Plane faces: unit normals (n, 3), a vertex of each (n, 3), and their boxes (n, 2, 3)."""

    normals: np.ndarray
    points: np.ndarray
    boxes: np.ndarray

    def take(self, which):
        return Flats(*(array[which] for array in self))


def contact(scene, ranked):
    """Whether one of the solids `ranked`, indices of objects, touches another object."""
    if not len(ranked):
        return False
    exact = bounds(scene.objects)
    finite = np.where(np.isfinite(exact), exact, 0)
    slack = _slack(finite)[:, None]
    low, high = exact[:, 0] - slack, exact[:, 1] + slack
    faces = {}

    def faces_of(i):
        if i not in faces:
            faces[i] = _faces(scene.objects[i])
        return faces[i]

    done = set()
    for i in ranked:
        done.add(i)
        near = np.flatnonzero(((low <= high[i]) & (low[i] <= high)).all(axis=1))
        for j in near.tolist():
            if j not in done and _touch(faces_of(i), faces_of(j)):
                return True
    return False


def precedence(scene, ranked):
    """int32 (objects,): of surfaces in one place that of the object with the largest number is there (MED-7).

    ranked: clear solids in the order of MED-2, indices of objects. Empty if none of them touches another object.
    """
    if not contact(scene, ranked):
        return np.zeros(0, np.int32)
    rank = {i: place for place, i in enumerate(ranked)}
    extent = np.nan_to_num(padded(bounds(scene.objects)), posinf=1e30, neginf=-1e30)

    def key(i):
        thing = scene.objects[i]
        if i in rank:
            return (0, rank[i])
        clear_and_flat = thing.material.attenuation != OPAQUE and not solid(thing)
        across = float(f"{np.linalg.norm(extent[i][1] - extent[i][0]):.8e}")
        return (1 if clear_and_flat else 2, -across, density(thing.material), i)

    numbers = np.empty(len(scene.objects), np.int32)
    numbers[sorted(range(len(scene.objects)), key=key)] = np.arange(len(scene.objects))
    return numbers


def _slack(boxes):
    """What counts as no distance, for faces with these boxes (n, 2, 3)."""
    extent = (boxes[:, 1] - boxes[:, 0]).max(axis=1, initial=0)
    return OF_EXTENT * extent + OF_COORDINATES * np.abs(boxes).max(axis=(1, 2), initial=0)


def _faces(thing):
    """The plane faces of an object or of its parts as Flats, and its round ones: a list of (centre, axes (3, 3))."""
    corners, rounds = [], []
    for part in thing.parts() if isinstance(thing, Csg) else [thing]:
        match part:
            case Sphere():
                rounds.append((np.array(part.centre), part.radius * np.eye(3)))
            case Ellipsoid():
                rounds.append((np.array(part.centre), np.array(part.axes)))
            case Polygon():
                corners.append(_fan(np.array(part.vertices)))
            case Mesh():
                corners.append(part.vertices[part.triangles])
            case Box():
                corners.append(_sides(np.array(part.corner), np.array(part.edges)))
    return _flats(corners), rounds


def _fan(vertices):
    """Triangles (m - 2, 3, 3) of a polygon."""
    return np.stack([np.broadcast_to(vertices[0], vertices[2:].shape), vertices[1:-1], vertices[2:]], axis=1)


def _sides(corner, edges):
    """Two triangles (12, 3, 3) of each side of a box."""
    found = []
    for a in range(3):
        b, c = edges[a - 2], edges[a - 1]
        for start in (corner, corner + edges[a]):
            found += [[start, start + b, start + c], [start + b + c, start + b, start + c]]
    return np.array(found)


def _flats(corners):
    """Flats of triangles (n, 3, 3); those without an area are none."""
    corners = np.concatenate([np.zeros((0, 3, 3)), *corners])
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    real = lengths > 0
    corners, normals = corners[real], normals[real] / lengths[real, None]
    return Flats(normals, corners[:, 0], np.stack([corners.min(axis=1), corners.max(axis=1)], axis=1))


def _touch(some, others):
    (flats, rounds), (other_flats, other_rounds) = some, others
    return (
        _flats_touch(flats, other_flats)
        or any(_round_touches(each, other_flats) for each in rounds)
        or any(_round_touches(each, flats) for each in other_rounds)
        or any(_rounds_touch(a, b) for a in rounds for b in other_rounds)
    )


def _flats_touch(a, b):
    a, b = _near(a, b), _near(b, a)
    if len(a.points) * len(b.points) > MOST_PAIRS:
        return True
    slack_a, slack_b = _slack(a.boxes), _slack(b.boxes)
    for normal, point, box, slack in zip(*a, slack_a, strict=True):
        room = slack + slack_b
        meet = ((box[0] <= b.boxes[:, 1] + room[:, None]) & (b.boxes[:, 0] <= box[1] + room[:, None])).all(axis=1)
        parallel = np.linalg.norm(np.cross(b.normals, normal), axis=1) <= OF_EXTENT
        if (meet & parallel & (np.abs((b.points - point) @ normal) <= room)).any():
            return True
    return False


def _near(flats, others):
    """Those of `flats` that lie in the box of the others."""
    if not len(others.points):
        return flats.take(slice(0))
    slack = (_slack(flats.boxes) + _slack(others.boxes).max())[:, None]
    low, high = others.boxes[:, 0].min(axis=0), others.boxes[:, 1].max(axis=0)
    return flats.take(((flats.boxes[:, 0] - slack <= high) & (low <= flats.boxes[:, 1] + slack)).all(axis=1))


def _round_touches(ellipsoid, flats):
    """Whether a plane face touches an ellipsoid without crossing it."""
    centre, axes = ellipsoid
    reach = np.sqrt((axes**2).sum(axis=0))
    slack = _slack(flats.boxes) + _slack(np.array([[centre - reach, centre + reach]]))
    away = np.abs(((centre - flats.points) * flats.normals).sum(axis=1))
    tangent = np.abs(away - np.linalg.norm(flats.normals @ axes.T, axis=1)) <= slack
    room = slack[:, None]
    meet = (flats.boxes[:, 0] - room <= centre + reach) & (centre - reach <= flats.boxes[:, 1] + room)
    return bool((tangent & meet.all(axis=1)).any())


def _rounds_touch(a, b):
    """Whether two ellipsoids touch: neither apart, nor one within the other, nor spheres that cross."""
    radii = [np.linalg.norm(axes, axis=1) for _, axes in (a, b)]
    if all(np.allclose(axes @ axes.T, np.eye(3) * r[0] ** 2, rtol=0, atol=1e-12 * r[0] ** 2)
           for (_, axes), r in zip((a, b), radii, strict=True)):  # fmt: skip
        away, (r, s) = np.linalg.norm(a[0] - b[0]), (radii[0][0], radii[1][0])
        slack = 4 * OF_EXTENT * max(r, s) + OF_COORDINATES * max(np.abs(a[0]).max(), np.abs(b[0]).max())
        return bool(min(abs(away - (r + s)), abs(away - abs(r - s))) <= slack)
    return not any(_clear_of(first, second) for first, second in ((a, b), (b, a)))


def _clear_of(a, b):
    """Whether, where `a` is the unit sphere, a sphere around `b` is surely outside or inside of it."""
    (centre, axes), (other, other_axes) = a, b
    inverse = np.linalg.inv(axes)
    away = np.linalg.norm((other - centre) @ inverse)
    reach = np.linalg.norm(other_axes @ inverse, 2)
    slack = 8 * OF_EXTENT * max(1, away)
    return away - reach > 1 + slack or away + reach < 1 - slack
