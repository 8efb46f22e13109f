"""Bounds of the shapes, in float64 at load; the tree is built from them."""

import numpy as np

from .box import RECIPROCAL


def of_spheres(spheres):
    centre, radius = spheres[:, :3], spheres[:, 3:]
    return centre - radius, centre + radius


def of_boxes(boxes):
    corner, edges = boxes[:, :3], boxes[:, 3:].reshape(-1, 3, 3)
    return corner + np.minimum(edges, 0).sum(axis=1), corner + np.maximum(edges, 0).sum(axis=1)


def of_ellipsoids(ellipsoids):
    centre, axes = ellipsoids[:, :3], ellipsoids[:, 3:].reshape(-1, 3, 3)
    half = np.sqrt((axes**2).sum(axis=1))
    return centre - half, centre + half


def of_polygons(vertices, ranges):
    v = [vertices[first : first + count] for first, count in ranges]
    return _rows([p.min(axis=0) for p in v]), _rows([p.max(axis=0) for p in v])


def of_triangles(triangles):
    v = triangles[:, :3]
    return v.min(axis=1), v.max(axis=1)


def of_solids(code, ranges, parts):
    """Bounds of CSG solids: all of space for an unbounded one. parts: bounds of the parts by kind."""
    found = [_of_solid(code[first : first + count], parts) for first, count in ranges]
    return _rows([low for low, _ in found]), _rows([high for _, high in found])


def _of_solid(code, parts):
    stack = []
    for operation, i in code:
        if operation < 4:
            stack.append((parts[operation][0][i], parts[operation][1][i]))
        elif operation == 6:
            stack[-1] = np.full(3, -np.inf), np.full(3, np.inf)
        else:
            (low1, high1), (low2, high2) = stack.pop(), stack.pop()
            outer, inner = (np.minimum, np.maximum) if operation == 4 else (np.maximum, np.minimum)
            stack.append((outer(low1, low2), inner(high1, high2)))
    low, high = stack[0]
    return np.minimum(low, high), high  # parts that do not meet


def skewness(tables):
    """The factor by which the error of a test may exceed the usual, for the worst of some boxes and ellipsoids.

    It is |g| |a| of the axes and their reciprocal vectors, 1 for a cube or a sphere, and no more than 2^10 here: a
    wider margin would spoil the tree for the sake of one needle.
    """
    worst = 1.0
    for table in tables:
        if len(table):
            axes, g = table[:, 1:4], table[:, RECIPROCAL : RECIPROCAL + 3]
            longest = np.linalg.norm(axes, axis=2).max(axis=1) * np.linalg.norm(g, axis=2).max(axis=1)
            worst = max(worst, longest.max())
    return min(worst, 1024.0)


def _rows(found):
    return np.array(found, float).reshape(-1, 3)
