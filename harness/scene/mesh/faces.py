"""Cuts the faces of a mesh into triangles: convex and concave ones, planar or not."""

from dataclasses import dataclass

import numpy as np

from harness.scene import check, concave

_LEVEL = 1e-12  # of a sine or of an area: from here on a turn is one, and not only rounding


class Fault(Exception):
    """A mesh file that cannot be read right. place: "line 5" or "face 17" of the file, or "" for all of it.

    The message quotes nothing of the file, which a scene may name without the reader's right to see it.
    """

    def __init__(self, message: str, place: str = "", remedy: str = ""):
        super().__init__(message)
        self.message, self.place, self.remedy = message, place, remedy


@dataclass(frozen=True)
class Faces:
    """The faces of a file. corners: numbers of vertices, one face after the other; counts: of corners of each face;
    places: of the faces, as numbers; kind: "line" or "face", what these numbers count.
    """

    corners: np.ndarray
    counts: np.ndarray
    places: np.ndarray
    kind: str = "line"

    def place(self, face: int) -> str:
        return f"{self.kind} {self.places[face]}"

    def place_of_corner(self, corner: int) -> str:
        return self.place(int(np.searchsorted(np.cumsum(self.counts), corner, side="right")))


def triangles(vertices: np.ndarray, faces: Faces) -> np.ndarray:
    """Triangles (T, 3) that cover the faces, in their order. vertices: (V, 3).

    A convex face becomes the fan round its first corner. Of a quadrilateral the diagonal is taken that lies inside, of
    other faces that are not convex the Delaunay triangulation (concave.py), both as seen along the face's normal
    (POL-1). A face without an area gives triangles without one. Fault, with the face's place, for a face of fewer than
    three corners, a corner that does not exist, is not finite or too far away, and a face that crosses itself.
    """
    _check(vertices, faces)
    three = np.flatnonzero(faces.counts == 3)
    starts = np.cumsum(faces.counts) - faces.counts
    parts = [faces.corners[starts[three][:, None] + np.arange(3)]]
    owners = [three]
    for count in np.unique(faces.counts[faces.counts > 3]):
        group = np.flatnonzero(faces.counts == count)
        rings = faces.corners[starts[group][:, None] + np.arange(count)]
        points = vertices[rings]
        again = (points == np.roll(points, -1, axis=1)).all(axis=2)
        if repeated := np.flatnonzero(again.any(axis=1)).tolist():
            for i in repeated:
                cut = _ring(vertices, rings[i][~again[i]], faces.place(group[i]))
                parts.append(cut)
                owners.append(np.full(len(cut), group[i]))
            kept = ~again.any(axis=1)
            group, rings, points = group[kept], rings[kept], points[kept]
        cut, of = _polygons(points, rings, lambda i, group=group: faces.place(group[i]))
        parts.append(cut)
        owners.append(group[of])
    order = np.argsort(np.concatenate(owners), kind="stable")
    return np.concatenate(parts)[order]


def _check(vertices, faces: Faces) -> None:
    few = faces.counts < 3
    if few.any():
        face = int(few.argmax())
        count = faces.counts[face]
        why = f"a face with {count} {'corner' if count == 1 else 'corners'}; it needs 3 or more"
        raise Fault(why, faces.place(face), "remove it")
    outside = (faces.corners < 0) | (faces.corners >= len(vertices))
    if outside.any():
        corner = int(outside.argmax())
        why = f"a face refers to a vertex that does not exist; the file has {len(vertices):,}"
        raise Fault(why, faces.place_of_corner(corner), "the file is incomplete, or was edited; export it again")
    bad = ~(np.abs(vertices) <= check.LARGEST).all(axis=1)
    if bad.any() and (used := bad[faces.corners]).any():
        corner = int(used.argmax())
        number = faces.corners[corner]
        far = f"farther than {check.LARGEST:g} from the origin"
        what = far if np.isfinite(vertices[number]).all() else "that is not finite"
        why = f"a face has a vertex {what}; it is number {number + 1:,} of the file, from 1"
        raise Fault(why, faces.place_of_corner(corner), "correct the vertex, or remove the face")


def _ring(vertices, ring, place: str) -> np.ndarray:
    """Triangles of one face whose repeated corners are removed."""
    if len(ring) < 4:
        return ring.reshape(-1, 3) if len(ring) == 3 else np.empty((0, 3), np.int64)
    return _polygons(vertices[ring][None], ring[None], lambda _: place)[0]


def _polygons(points, rings, place) -> tuple[np.ndarray, np.ndarray]:
    """Triangles of faces of n > 3 corners each, and the index of each triangle's face.

    points: (F, n, 3); rings: numbers of vertices (F, n); place: returns the place of a face by its index.
    """
    count = rings.shape[1]
    arms = points - points[:, :1]
    extent = np.abs(arms).max(axis=(1, 2), initial=0)
    scaled = arms / np.where(extent > 0, extent, 1)[:, None, None]
    area = np.cross(scaled[:, :-1], scaled[:, 1:]).sum(axis=1)
    size = np.linalg.norm(area, axis=1)
    normal = area / np.where(size > 0, size, 1)[:, None]
    fan = np.stack([np.zeros(count - 2, int), np.arange(1, count - 1), np.arange(2, count)], axis=1)
    cuts = rings[:, fan]  # (F, n - 2, 3)
    flat = size <= check.FLAT
    for face in np.flatnonzero(flat):
        longest = scaled[face][np.linalg.norm(scaled[face], axis=1).argmax()]
        if (np.linalg.norm(np.cross(scaled[face], longest), axis=1) > check.FLAT).any():
            raise Fault("a face crosses itself", place(face), "cut it into triangles")
    if count == 4:
        a, b = (np.einsum("fi,fi->f", normal, _area(scaled, *three)) for three in ((0, 1, 2), (0, 2, 3)))
        c, d = (np.einsum("fi,fi->f", normal, _area(scaled, *three)) for three in ((1, 2, 3), (1, 3, 0)))
        first, second = np.minimum(a, b), np.minimum(c, d)
        other = ~flat & (first <= _LEVEL) & (second > first)
        cuts[other] = rings[other][:, [[1, 2, 3], [1, 3, 0]]]
        crossing = ~flat & (np.maximum(first, second) < -_LEVEL)
        if crossing.any():
            raise Fault("a face crosses itself", place(int(crossing.argmax())), "cut it into triangles")
        return cuts.reshape(-1, 3), np.repeat(np.arange(len(rings)), 2)
    edges = np.roll(scaled, -1, axis=1) - scaled
    before = np.roll(edges, 1, axis=1)
    lengths = np.linalg.norm(edges, axis=2) * np.linalg.norm(before, axis=2)
    sines = np.einsum("fi,fni->fn", normal, np.cross(before, edges))
    cosines = np.einsum("fni,fni->fn", before, edges)
    once = np.arctan2(sines, cosines).sum(axis=1) < 3 * np.pi
    convex = flat | ((sines > _LEVEL * lengths).all(axis=1) & once)
    cuts, owners = list(cuts), np.arange(len(rings))
    for face in np.flatnonzero(~convex).tolist():
        cuts[face] = rings[face][_concave(scaled[face], normal[face], place(face))]
    owners = np.repeat(np.arange(len(rings)), [len(cut) for cut in cuts])
    return np.concatenate([np.empty((0, 3), rings.dtype), *cuts]), owners


def _area(points, a, b, c):
    return np.cross(points[:, b] - points[:, a], points[:, c] - points[:, a])


def _concave(points, normal, place: str) -> np.ndarray:
    """Triangles (T, 3) of the corners of one face, turned as it is. points: (n, 3), the first at the origin."""
    if len(points) > concave.MOST:
        why = f"a face of {len(points):,} corners that is not convex; at most {concave.MOST:,} are cut into triangles"
        raise Fault(why, place, "cut it into smaller ones")
    cut = concave.cut(concave.seen(points - (points @ normal)[:, None] * normal, normal))
    if isinstance(cut, check.Fault):
        raise Fault(cut.text.replace("the polygon", "a face"), place, "cut it into triangles")
    a, b, c = (points[corner] for corner in cut.T)
    return cut if np.cross(b - a, c - a).sum(axis=0) @ normal > 0 else cut[:, ::-1]
