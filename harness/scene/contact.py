"""Finds whether faces of several objects can be in one place over an area, where that is seen (MED-6, MED-9).

Conservative: it takes for one place what only comes close, and faces of parts that are no surface of their CSG solid.
What crosses at an angle is not in one place.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from harness.scene.bounds import bounds, padded
from harness.scene.media import OPAQUE, close, density, media, solid
from harness.scene.model import Csg, Ellipsoid, Mesh, Polygon, Sphere

# Distances count as none up to this share of a face's extent, and of the coordinates: 4 times what float32 takes for
# one place (OFF-1). Faces at smaller angles than the first, in radians, count as parallel.
OF_EXTENT, OF_COORDINATES = 2.0**-17, 2.0**-20
FEW = 64  # triangles of an object from which on those far from all other objects are left out


class Flats(NamedTuple):
    """Triangles (n, 3, 3), their unit normals (n, 3) and boxes (n, 2, 3), and the indices of their objects (n,)."""

    corners: np.ndarray
    normals: np.ndarray
    boxes: np.ndarray
    owners: np.ndarray

    def take(self, which):
        return Flats(*(array[which] for array in self))


class Rounds(NamedTuple):
    """Ellipsoids: centres (n, 3), semi-axes (n, 3, 3), and the indices of their objects (n,)."""

    centres: np.ndarray
    axes: np.ndarray
    owners: np.ndarray

    def take(self, which):
        return Rounds(*(array[which] for array in self))

    def pair(self, k):
        """Centre and semi-axes of one."""
        return self.centres[k], self.axes[k]


@lru_cache(maxsize=8)
def contact(scene):
    """Whether a clear solid with a rank touches another object, two other surfaces in one place are both seen, or a
    light lies on a surface.
    """
    if len(scene.objects) < 2 and not scene.lights:
        return False
    ranked = np.zeros(len(scene.objects), bool)
    ranked[[i for i, _ in media(scene)]] = True
    boxes = bounds(scene.objects)
    slack = _slack(np.where(np.isfinite(boxes), boxes, 0))[:, None, None]
    boxes = boxes + slack * [[[-1.0], [1.0]]]
    places = np.array([light.position for light in scene.lights]).reshape(-1, 3)
    flats = _flats(scene.objects, np.concatenate([boxes, np.repeat(places[:, None], 2, axis=1)]))
    rounds = _rounds(scene.objects)
    if _light_on(places, flats, rounds):
        return True
    return _flats_touch(scene, flats, ranked) or _rounds_touch(rounds, flats, ranked)


def precedence(scene):
    """int32 (objects,): of surfaces in one place that of the object with the largest number is there (MED-7).

    Empty if there is no contact.
    """
    if not contact(scene):
        return np.zeros(0, np.int32)
    rank = {i: place for place, (i, _) in enumerate(media(scene))}
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


def _parts(thing):
    return thing.parts() if isinstance(thing, Csg) else [thing]


def _is_round(part):
    return isinstance(part, Sphere | Ellipsoid)


def _rounds(objects):
    """The spheres and ellipsoids of all objects as Rounds."""
    parts = [(part, i) for i, thing in enumerate(objects) for part in _parts(thing) if _is_round(part)]
    centres = np.array([part.centre for part, _ in parts], float).reshape(-1, 3)
    axes = [part.radius * np.eye(3) if isinstance(part, Sphere) else part.axes for part, _ in parts]
    return Rounds(centres, np.array(axes, float).reshape(-1, 3, 3), np.array([i for _, i in parts], int))


def _flats(objects, boxes):
    """The plane faces of all objects as Flats, but those of large objects that meet no other of the boxes (n, 2, 3)."""
    corners, owners = [np.zeros((0, 3, 3))], [np.zeros(0, int)]
    for i, thing in enumerate(objects):
        pieces = [_triangles(part) for part in _parts(thing) if not _is_round(part)]
        triangles = np.concatenate([np.zeros((0, 3, 3)), *pieces])
        if len(triangles) > FEW:
            triangles = triangles[_near_others(triangles, i, boxes)]
        corners.append(triangles)
        owners.append(np.full(len(triangles), i))
    corners, owners = np.concatenate(corners), np.concatenate(owners)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    proper = lengths > 0
    corners, owners, normals = corners[proper], owners[proper], normals[proper] / lengths[proper, None]
    return Flats(corners, normals, np.stack([corners.min(axis=1), corners.max(axis=1)], axis=1), owners)


def _triangles(part):
    """Triangles (n, 3, 3) of a part with plane faces, outward if it is a solid."""
    if isinstance(part, Mesh):
        return part.vertices[part.triangles]
    if isinstance(part, Polygon):
        v = np.array(part.vertices)
        return np.stack([np.broadcast_to(v[0], v[2:].shape), v[1:-1], v[2:]], axis=1)
    corner, edges = np.array(part.corner), np.array(part.edges)
    right = np.linalg.det(edges) > 0
    triangles = []
    for a in range(3):
        b, c = edges[a - 2], edges[a - 1]
        for start, outward in ((corner, False), (corner + edges[a], True)):
            for triangle in ([start, start + b, start + b + c], [start, start + b + c, start + c]):
                triangles.append(triangle if outward == right else triangle[::-1])
    return np.array(triangles)


def _near_others(triangles, i, boxes):
    """Those that meet the box of an object other than `i`."""
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    meets = ((boxes[:, 0] <= boxes[i, 1]) & (boxes[i, 0] <= boxes[:, 1])).all(axis=1)
    meets[i] = False
    near = np.zeros(len(triangles), bool)
    for j in np.flatnonzero(meets):
        near |= ((low <= boxes[j, 1]) & (boxes[j, 0] <= high)).all(axis=1)
    return near


def _light_on(places, flats, rounds):
    """Whether one of the points (n, 3) lies on a surface."""
    inverse = np.linalg.inv(rounds.axes)
    least = np.linalg.norm(rounds.axes, axis=2).min(axis=1, initial=np.inf)
    for place in places:
        room = _slack(flats.boxes) + OF_COORDINATES * np.abs(place).max()
        on = np.abs(((place - flats.corners[:, 0]) * flats.normals).sum(axis=1)) <= room
        on &= ((flats.boxes[:, 0] - room[:, None] <= place) & (place <= flats.boxes[:, 1] + room[:, None])).all(axis=1)
        away = np.linalg.norm(((place - rounds.centres)[:, None] @ inverse)[:, 0], axis=1)
        if on.any() or (np.abs(away - 1) <= OF_EXTENT + OF_COORDINATES * np.abs(place).max() / least).any():
            return True
    return False


def _flats_touch(scene, flats, ranked):
    """Whether plane faces of two objects overlap in one plane."""
    eye = np.add(scene.camera.centre, scene.camera.e)
    solids = np.array([solid(thing) for thing in scene.objects], bool)
    slack = _slack(flats.boxes)
    low, high = flats.boxes[:, 0] - slack[:, None], flats.boxes[:, 1] + slack[:, None]
    for some in close(low):
        near = ((low <= high[some].max(axis=0)) & (low[some].min(axis=0) <= high)).all(axis=1)
        near = np.flatnonzero(near & (flats.owners > flats.owners[some].min()))
        a, b = np.nonzero(_one_plane(flats, some, near, slack, low, high))
        a, b = some[a], near[b]
        outside = [((eye - flats.corners[k, 0]) * flats.normals[k]).sum(axis=1) > 0 for k in (a, b)]
        seen = (outside[0] | ~solids[flats.owners[a]]) & (outside[1] | ~solids[flats.owners[b]])
        mask, room = ranked[flats.owners[a]] | ranked[flats.owners[b]] | seen, slack[a] + slack[b]
        if _overlap(flats.corners[a[mask]], flats.corners[b[mask]], flats.normals[a[mask]], room[mask]).any():
            return True
    return False


def _one_plane(flats, some, near, slack, low, high):
    """Which of `some` and `near` (n, m) are faces of two objects in one plane whose boxes meet, each pair once."""
    normals = flats.normals[some]
    pairs = flats.owners[some][:, None] < flats.owners[near]
    pairs &= 1 - (normals @ flats.normals[near].T) ** 2 <= OF_EXTENT**2
    start = (flats.corners[some, 0] * normals).sum(axis=1)[:, None]
    for corner in range(3):
        pairs &= np.abs(normals @ flats.corners[near, corner].T - start) <= 3 * (slack[some][:, None] + slack[near])
    for axis in range(3):
        pairs &= low[some, axis][:, None] <= high[near, axis]
        pairs &= low[near, axis] <= high[some, axis][:, None]
    return pairs


def _overlap(a, b, normals, room):
    """Which triangles a and b (n, 3, 3), two in one plane, share more than an edge: no side parts them."""
    apart = np.zeros(len(a), bool)
    for triangles in (a, b):
        for k in range(3):
            across = np.cross(triangles[:, k] - triangles[:, k - 1], normals)
            across /= np.linalg.norm(across, axis=1, keepdims=True)
            first, second = ((some * across[:, None]).sum(axis=2) for some in (a, b))
            common = np.minimum(first.max(axis=1), second.max(axis=1)) - np.maximum(
                first.min(axis=1), second.min(axis=1)
            )
            apart |= common <= room
    return ~apart


def _rounds_touch(rounds, flats, ranked):
    """Whether a round face touches a plane one or another round one, or is the same."""
    reach = np.sqrt((rounds.axes**2).sum(axis=1))
    slack = _slack(np.stack([rounds.centres - reach, rounds.centres + reach], axis=1))
    low, high = rounds.centres - reach - slack[:, None], rounds.centres + reach + slack[:, None]
    is_clear = ranked[rounds.owners]
    room = _room(rounds)[:, None]
    for some in close(rounds.centres):  # the same have one centre
        a, b = _meeting(
            rounds.centres - room, rounds.centres + room, some, rounds.centres - room, rounds.centres + room
        )
        others = (a < b) & (rounds.owners[a] != rounds.owners[b]) & ~is_clear[a] & ~is_clear[b]
        if _same(rounds.take(a[others]), rounds.take(b[others])).any():
            return True
    clear = np.flatnonzero(is_clear)
    for some in close(rounds.centres[clear]):
        a, b = _meeting(low, high, clear[some], low, high)
        others = (rounds.owners[a] != rounds.owners[b]) & ((a < b) | ~is_clear[b])
        if any(_touch(rounds.pair(k), rounds.pair(n)) for k, n in zip(a[others], b[others], strict=True)):
            return True
    if not ranked.any():
        return False
    room = _slack(flats.boxes)
    start, end = flats.boxes[:, 0] - room[:, None], flats.boxes[:, 1] + room[:, None]
    for some in close(start):
        a, b = _meeting(start, end, some, low, high)
        others = flats.owners[a] != rounds.owners[b]
        others &= ranked[flats.owners[a]] | ranked[rounds.owners[b]]
        a, b = a[others], b[others]
        away = np.abs(((rounds.centres[b] - flats.corners[a, 0]) * flats.normals[a]).sum(axis=1))
        along = np.linalg.norm((rounds.axes[b] @ flats.normals[a][:, :, None])[:, :, 0], axis=1)
        if (np.abs(away - along) <= room[a] + slack[b]).any():
            return True
    return False


def _meeting(low, high, some, start, end):
    """The pairs of boxes from low to high (n, 3) with indices `some` and boxes from start to end that meet, as two
    arrays of indices.
    """
    near = np.flatnonzero(((start <= high[some].max(axis=0)) & (low[some].min(axis=0) <= end)).all(axis=1))
    pairs = np.ones((len(some), len(near)), bool)
    for axis in range(3):
        pairs &= low[some, axis][:, None] <= end[near, axis]
        pairs &= start[near, axis] <= high[some, axis][:, None]
    a, b = np.nonzero(pairs)
    return some[a], near[b]


def _room(rounds):
    """By how much the centres of ellipsoids that are one may differ (n,)."""
    size = np.abs(rounds.axes).max(axis=(1, 2))
    return OF_EXTENT * size + OF_COORDINATES * np.abs(rounds.centres).max(axis=1)


def _same(a, b):
    """Which ellipsoids of two Rounds are one (n,)."""
    size = np.abs(a.axes).max(axis=(1, 2))
    forms = a.axes.transpose(0, 2, 1) @ a.axes - b.axes.transpose(0, 2, 1) @ b.axes
    moved = np.abs(a.centres - b.centres).max(axis=1) + np.abs(forms).max(axis=(1, 2)) / size
    return moved <= _room(a)


def _touch(a, b):
    """Whether two ellipsoids touch: their surfaces are parallel where they meet.

    Where `a` is the unit sphere, |x| = 1, and `b` is x' M x - 2 x' M c + c' M c = 1, they are parallel where
    M (x - c) = t x. All such t are eigenvalues (Gander, Golub, von Matt, "A constrained eigenvalue problem", Linear
    Algebra and its Applications 114, 1989).
    """
    (centre, axes), (other, other_axes) = a, b
    inverse = np.linalg.inv(axes)
    slack = 4 * OF_EXTENT * max(np.abs(axes).max(), np.abs(other_axes).max())
    slack = np.linalg.norm(inverse, 2) * (slack + OF_COORDINATES * max(np.abs(centre).max(), np.abs(other).max()))
    form = axes @ np.linalg.inv(other_axes)
    m, turn = np.linalg.eigh(form @ form.T)
    c = (other - centre) @ inverse @ turn
    system = np.block([[np.diag(m), -np.eye(3)], [-np.outer(m * c, m * c), np.diag(m)]])
    for t in np.linalg.eigvals(system).real:
        apart = np.where(np.abs(m - t) < 1e-16 * m.max(), 1e-16 * m.max(), m - t)
        x = m * c / apart
        k = np.abs(apart).argmin()  # where M (x - c) = t x leaves x[k] free, |x| = 1 decides it
        rest = np.delete(x, k)
        free = np.sqrt(max(0, 1 - rest @ rest))
        for place in (x, np.insert(rest, k, free), np.insert(rest, k, -free)):
            length = np.linalg.norm(place)
            if not 0 < length < np.inf:
                continue
            away = place / length - c
            slope = 2 * np.linalg.norm(m * away)
            if abs(m @ away**2 - 1) <= slack * (slope + slack * m.max()):
                return True
    return False
