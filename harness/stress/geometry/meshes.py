"""Closed meshes made from their description: an icosahedron whose triangles are quartered."""

import numpy as np


def icosphere(quarterings: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 3) on the unit sphere, and triangles (20 · 4^quarterings, 3), outward."""
    golden = (1 + 5**0.5) / 2
    vertices = [(a, b * golden, 0) for a in (-1, 1) for b in (-1, 1)]
    vertices = [np.roll(v, shift) for shift in range(3) for v in vertices]
    vertices = [v / np.linalg.norm(v) for v in vertices]
    length = min(np.linalg.norm(vertices[0] - v) for v in vertices[1:])
    near = np.linalg.norm(np.subtract(vertices, np.array(vertices)[:, None]), axis=-1) < 1.01 * length
    triangles = []
    for a in range(12):
        for b in range(a + 1, 12):
            for c in range(b + 1, 12):
                if near[a, b] and near[b, c] and near[c, a]:
                    out = np.dot(np.cross(vertices[b] - vertices[a], vertices[c] - vertices[a]), vertices[a]) > 0
                    triangles.append((a, b, c) if out else (a, c, b))
    for _ in range(quarterings):
        triangles = _quartered(vertices, triangles)
    return np.array(vertices), np.array(triangles, np.int32)


def _quartered(vertices: list, triangles: list) -> list:
    """Each triangle as four; the middles of edges, moved onto the sphere, are added to `vertices`."""
    middles: dict[tuple[int, int], int] = {}

    def middle(a, b):
        key = min(a, b), max(a, b)
        if key not in middles:
            middles[key] = len(vertices)
            between = vertices[a] + vertices[b]
            vertices.append(between / np.linalg.norm(between))
        return middles[key]

    finer = []
    for a, b, c in triangles:
        ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
        finer += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return finer
