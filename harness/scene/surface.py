"""Tests whether triangle surfaces are closed, turns them outward, and counts their windings around points; removes
triangles without an area."""

import numpy as np


def outward(vertices, triangles):
    """The triangles (T, 3) turned outward, or None if they do not close.

    Closed: every edge has two triangles, which can be turned so that the edge runs in opposite directions in them. A
    connected part within an odd number of other parts bounds a hollow: there, outward is into the hollow.
    """
    joined = _pairs(triangles)
    if joined is None:
        return None
    first, second, same = joined
    # Each triangle has two nodes, as it is and turned over; edges join nodes that must go together.
    from scipy.sparse import coo_array  # here, because few scenes have a mesh
    from scipy.sparse.csgraph import connected_components

    count = len(triangles)
    starts = np.concatenate([first, first + count])
    ends = np.concatenate([np.where(same, second + count, second), np.where(same, second, second + count)])
    graph = coo_array((np.ones(len(starts), np.int8), (starts, ends)), (2 * count, 2 * count))
    labels = connected_components(graph, directed=False)[1]
    if (labels[:count] == labels[count:]).any():
        return None  # one-sided, such as a Klein bottle
    volumes = _volumes(vertices, triangles)
    sums = np.bincount(labels, np.concatenate([volumes, -volumes]))[labels[:count]]
    if not sums.all():
        return None  # two sheets back to back
    turned = np.where(sums[:, None] < 0, triangles[:, ::-1], triangles)
    parts = np.unique(np.minimum(labels[:count], labels[count:]), return_inverse=True)[1]
    hollow = _nesting(vertices, turned, parts) % 2 == 1
    return np.where(hollow[parts][:, None], turned[:, ::-1], turned)


def with_area(vertices, triangles):
    """Vertices and triangles without triangles that have no normal (TRI-2), and without unused vertices.

    Call it after `outward`, for which triangles without an area may close a seam.
    """
    a, b, c = (vertices[corner] for corner in triangles.T)
    normals = np.cross(b - a, c - a)
    triangles = triangles[np.einsum("ij,ij->i", normals, normals) > 0]
    used = np.zeros(len(vertices), bool)
    used[triangles] = True
    return vertices[used], (np.cumsum(used, dtype=np.int32) - 1)[triangles]


def unpaired(triangles):
    """The number of edges that have one triangle (T, 3), and of those that have more than two."""
    edges = np.sort(np.concatenate([triangles[:, :2], triangles[:, 1:], triangles[:, ::2]]), axis=1)
    counts = np.unique(edges, axis=0, return_counts=True)[1]
    return int((counts == 1).sum()), int((counts > 2).sum())


def winding(vertices, triangles, points):
    """The winding number of the surface around points (N, 3): 1 inside, 0 outside of a closed surface turned outward.

    It is the sum of solid angles (van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30(2), 1983).
    """
    sums = []
    for point in points:
        a, b, c = (vertices[corner] - point for corner in triangles.T)
        la, lb, lc = (np.linalg.norm(arm, axis=1) for arm in (a, b, c))
        numerator = np.einsum("ij,ij->i", a, np.cross(b, c))
        denominator = la * lb * lc + _dots(a, b) * lc + _dots(b, c) * la + _dots(c, a) * lb
        sums.append(np.arctan2(numerator, denominator).sum() / (2 * np.pi))
    return np.array(sums)


def _dots(a, b):
    return np.einsum("ij,ij->i", a, b)


def _pairs(triangles):
    """The two triangles of each edge, and whether it runs in the same direction in both. None unless each has two."""
    starts, ends = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    low, high = np.minimum(starts, ends), np.maximum(starts, ends)
    order = np.lexsort((high, low))
    low, high, forward = low[order], high[order], (starts < ends)[order]
    if len(order) % 2:
        return None
    twice = (low[::2] == low[1::2]) & (high[::2] == high[1::2])
    again = (low[2::2] == low[:-2:2]) & (high[2::2] == high[:-2:2])
    if not twice.all() or again.any():
        return None
    faces = order // 3
    return faces[::2], faces[1::2], forward[::2] == forward[1::2]


def _volumes(vertices, triangles):
    """Six times the signed volume between each triangle and the centre of the bounding box."""
    middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    a, b, c = (vertices[corner] - middle for corner in triangles.T)
    return np.einsum("ij,ij->i", a, np.cross(b, c))


def _nesting(vertices, triangles, parts):
    """For each connected part, the number of other parts that contain it. parts: the part of each triangle."""
    count = parts.max() + 1
    depth = np.zeros(count, np.int64)
    if count == 1:
        return depth
    corners = vertices[triangles]
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, parts, corners.min(axis=1))
    np.maximum.at(high, parts, corners.max(axis=1))
    order = np.argsort(parts, kind="stable")
    firsts = np.searchsorted(parts[order], np.arange(count))
    members = np.split(order, firsts[1:])
    for outer in range(count):
        within = ((low > low[outer]) & (high < high[outer])).all(axis=1)
        for inner in np.flatnonzero(within):
            # Several vertices are tested, as parts that intersect do not contain each other.
            some = vertices[np.unique(triangles[members[inner]])]
            some = some[:: max(1, len(some) // 4)]
            depth[inner] += np.all(winding(vertices, triangles[members[outer]], some) > 0.5)
    return depth
