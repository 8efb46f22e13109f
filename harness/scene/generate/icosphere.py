"""Generates a sphere of triangles, an icosahedron whose triangles are quartered: as OBJ text and as a mirror."""

import numpy as np

from harness.errors import UserError
from harness.scene.mesh.mesh import rotate
from harness.scene.model import Material, Mesh

RADIUS = 3.0  # in the scene; the view has a half-extent of 3.3 at the centre
ROTATION = 23.0, 41.0, 67.0  # degrees: no edge and no mirror plane of the icosahedron is along an axis
MATERIAL = Material((0.6, 0.45, 0.3), 1.0, 30.0, (0.0, 0.0, 0.0), 1e6, 1.0)  # a mirror, as in the comparison scene


def icosphere(size=2):
    """Vertices (10 * 4^size + 2, 3) on the unit sphere and triangles int32 (20 * 4^size, 3), closed and outward.

    size: how often each triangle is quartered. UserError if it is negative.
    """
    if size < 0:
        raise UserError(f"expected a size from 0, found {size}")
    golden = (1 + 5**0.5) / 2
    corners = [(0.0, a, b * golden) for a in (-1, 1) for b in (-1, 1)]
    vertices = np.array([np.roll(corner, turn) for turn in range(3) for corner in corners]) / np.hypot(1, golden)
    linked = np.linalg.norm(vertices[:, None] - vertices, axis=2) < 1.1  # an edge is 1.05 long, the next distance 1.7
    triangles = np.array(
        [(i, j, k) for i in range(12) for j in range(i) for k in range(j) if linked[i, j] & linked[j, k] & linked[i, k]]
    )
    for _ in range(size):
        vertices, triangles = _quartered(vertices, triangles)
    inward = np.linalg.det(vertices[triangles]) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    return vertices, triangles.astype(np.int32)


def _quartered(vertices, triangles):
    """Splits each triangle into four. The middles of edges, moved to the sphere, are appended to the vertices."""
    starts, ends = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    keys = np.minimum(starts, ends) * len(vertices) + np.maximum(starts, ends)
    _, met, edges = np.unique(keys, return_index=True, return_inverse=True)
    order = np.argsort(met)
    numbers = np.empty(len(met), np.int64)
    numbers[order] = len(vertices) + np.arange(len(met))
    between = vertices[starts[met[order]]] + vertices[ends[met[order]]]
    between /= np.linalg.norm(between, axis=1, keepdims=True)
    (a, b, c), (ab, bc, ca) = triangles.T, numbers[edges].reshape(-1, 3).T
    finer = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1).reshape(-1, 3)
    return np.concatenate([vertices, between]), finer


def obj(size=2):
    """OBJ text of the mesh on the unit sphere, not turned."""
    vertices, triangles = icosphere(size)
    times = {0: "not", 1: "once", 2: "twice"}.get(size, f"{size} times")
    lines = [f"# An icosahedron whose triangles are quartered {times}, on the unit sphere."]
    lines += ["v {:.7f} {:.7f} {:.7f}".format(*vertex) for vertex in vertices.tolist()]
    lines += ["f {} {} {}".format(*triangle) for triangle in (triangles + 1).tolist()]
    return "\n".join(lines) + "\n"


def mirror(size=2):
    """The mesh as a `Mesh` for the view of the comparison scene: a mirror in general position."""
    vertices, triangles = icosphere(size)
    turned = RADIUS * vertices @ rotate(ROTATION).T
    return Mesh(MATERIAL, turned, triangles, True, "icosphere.obj", rotation=ROTATION, scale=RADIUS)
