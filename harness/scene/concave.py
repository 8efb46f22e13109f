"""Cuts concave polygons into the triangles of a flat mesh.

The constrained Delaunay triangulation of the outline (the library CDT, whose geometric predicates are exact) covers
exactly the polygon, without overlaps, and uses only the polygon's vertices.
"""

import re

import numpy as np

from harness.scene import check, surface

# Vertices, at most. Most outlines take 0.05 s then; some take time quadratic in their number, here 1 s.
MOST = 10_000

# Of the largest coordinate: how far off their plane rounding can leave vertices that are in it, 16 u.
FLAT = 2.0**-49

_CROSSING = re.compile(r"\((\d+), (\d+)\) intersects \((\d+), (\d+)\)")


def triangulate(vertices):
    """Points (N, 3) and triangles (T, 3) of the polygon round `vertices`, or the `check.Fault` of its outline.

    `vertices` passed `check.polygon`, except that they are concave. The points are the vertices where these are in the
    plane of POL-1 to rounding, so that no ray passes between the polygon and its neighbours (POL-2). Else, as in files
    with six digits, they are moved along the normal to that plane, so that all triangles have the polygon's normal.
    """
    if len(vertices) > MOST:
        why = f"a concave polygon of {len(vertices):,} vertices; at most {MOST:,} are cut into triangles"
        return check.Fault(0, why, "cut it into smaller ones")
    vertices = np.array(vertices, np.float64)
    arms = vertices - vertices[0]
    normal = np.array(check.unit(np.cross(arms[:-1], arms[1:]).sum(axis=0).tolist()))
    heights = arms @ normal
    is_flat = np.abs(heights).max() <= FLAT * np.abs(vertices).max()
    points = vertices if is_flat else vertices - heights[:, None] * normal
    triangles = cut(seen(points, normal))
    return triangles if isinstance(triangles, check.Fault) else surface.with_area(points, triangles)


def seen(points, normal):
    """Points (N, 2) for the points (N, 3) of a plane with this normal.

    One coordinate is dropped instead of rotating the frame, which would round the others.
    """
    return np.delete(points, np.abs(normal).argmax(), axis=1)


def cut(points):
    """Triangles (N - 2, 3) of the polygon round points (N, 2), or its `check.Fault` if it crosses or touches itself."""
    import pythoncdt  # here, because few scenes have a concave polygon

    fault = _repeated(points)
    if fault:
        return fault
    ends = np.arange(len(points), dtype=np.uintc)
    outline = np.stack([ends, np.roll(ends, -1)], axis=1)
    order, strategy = pythoncdt.VertexInsertionOrder.AUTO, pythoncdt.IntersectingConstraintEdges.NOT_ALLOWED
    cdt = pythoncdt.Triangulation(order, strategy, 0.0)
    try:
        cdt.insert_vertices(points)
        # In random order few sides cross many triangles; in the order of the outline all sides of a serpentine do
        # (Shewchuk and Brown, Fast segment insertion, Computational Geometry 48(8), 2015).
        cdt.insert_edges(np.random.default_rng(0).permutation(outline))
    except RuntimeError as error:
        crossing = _CROSSING.search(str(error))
        if not crossing:
            raise
        a, b, c, d = map(int, crossing.groups())
        first, second = sorted((_start(a, b), _start(c, d)))
        why = f"the polygon crosses itself; the sides after vertices {first + 1} and {second + 1} meet"
        return check.Fault(second, why)
    cdt.erase_outer_triangles()
    triangles = cdt.triangles_array()["vertices"].astype(np.int64)
    # An edge through a vertex is two edges in the triangulation.
    sides = np.sort(np.concatenate([triangles[:, :2], triangles[:, 1:], triangles[:, ::2]]), axis=1)
    whole = np.isin(_keys(np.sort(outline.astype(np.int64), axis=1)), _keys(sides))
    if not whole.all():
        start = int(whole.argmin())
        why = f"the polygon touches itself; the side after vertex {start + 1} passes through another vertex"
        return check.Fault(start, why)
    return triangles


def _start(a, b):
    """The vertex that the side between vertices a and b begins at: the last one, if it closes the outline."""
    return min(a, b) if abs(a - b) == 1 else max(a, b)


def _repeated(points):
    """The `check.Fault` of two equal points, or None."""
    order = np.lexsort(points.T)
    equal = np.flatnonzero((points[order[1:]] == points[order[:-1]]).all(axis=1))
    if not len(equal):
        return None
    i, j = sorted(order[equal[0] : equal[0] + 2].tolist())
    return check.Fault(j, f"the polygon touches itself; vertices {i + 1} and {j + 1} are the same point")


def _keys(edges):
    """One integer for each of the edges (N, 2)."""
    return (edges[:, 0] << 32) | edges[:, 1]
