"""Bounds of the shapes along the axes, in float64 at load; the hierarchy is built from them."""

import numpy as np

ROUNDING = 64  # what rounding can do to a hit, in units of eps of the largest coordinate (kernel/shapes/bvh.h)
SKEWED = 16  # from which on rounding moves hits further than that (HIT-6)


def of_spheres(spheres):
    centre, radius = spheres[:, :3], spheres[:, 3:]
    return centre - radius, centre + radius


def of_boxes(boxes):
    corner, edges = boxes[:, :3], boxes[:, 3:].reshape(-1, 3, 3)
    return corner + np.minimum(edges, 0).sum(axis=1), corner + np.maximum(edges, 0).sum(axis=1)


def of_ellipsoids(ellipsoids):
    centre, axes = ellipsoids[:, :3], ellipsoids[:, 3:].reshape(-1, 3, 3)
    reach = np.sqrt((axes**2).sum(axis=1))
    return centre - reach, centre + reach


def of_corners(corners):
    """corners: (n, k, 3), k corners of each shape."""
    return corners.min(axis=1), corners.max(axis=1)


def of_ranges(corners, ranges):
    """corners: (V, 3). ranges: (n, 2), first corner of each shape and number."""
    each = [corners[first : first + count] for first, count in ranges]
    return tuple(np.array([side(one, axis=0) for one in each], float).reshape(-1, 3) for side in (np.min, np.max))


def of_solids(code, ranges, parts):
    """parts: bounds of the parts by their kind. Every boundary of a solid is on a face of a part (CSG-3)."""
    low, high = np.full((len(ranges), 3), np.inf), np.full((len(ranges), 3), -np.inf)
    for solid, (first, count) in enumerate(ranges):
        for kind, row in code[first : first + count]:
            if kind < len(parts):
                low[solid] = np.minimum(low[solid], parts[kind][0][row])
                high[solid] = np.maximum(high[solid], parts[kind][1][row])
    return low, high


def padded(low, high, real):
    pad = ROUNDING * np.finfo(real).eps * np.maximum(np.abs(low), np.abs(high)).max(axis=1, keepdims=True, initial=0)
    return low - pad, high + pad


def skewed(axes, reciprocals):
    """Whether an error in a point grows too much on its way to coordinates along axes and back. Both: (n, 3, 3)."""
    growth = np.linalg.norm(axes, axis=2) * np.linalg.norm(reciprocals, axis=2)
    return ~(growth.max(axis=1, initial=0) < SKEWED)
