"""Tests whether triangle surfaces are closed, turns them outward, and counts their windings around points."""

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
    count = len(triangles)
    starts = np.concatenate([first, first + count])
    ends = np.concatenate([np.where(same, second + count, second), np.where(same, second, second + count)])
    labels = _parts(2 * count, starts, ends)
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


def _parts(count, starts, ends):
    """For each of `count` nodes the smallest that it is connected with by the edges from `starts` to `ends`.

    Labels shrink along edges, and so does the label of a label, until none does: few rounds, also of long chains
    (after Shiloach and Vishkin, Journal of Algorithms 3, 1982).
    """
    labels = np.arange(count)
    while True:
        low = np.minimum(labels[starts], labels[ends])
        smaller = labels.copy()
        for nodes in (starts, ends, labels[starts], labels[ends]):
            np.minimum.at(smaller, nodes, low)
        smaller = smaller[smaller]
        if (smaller == labels).all():
            return labels
        labels = smaller


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
