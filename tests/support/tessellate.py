"""Meshes made here: a block and a ball of triangles, as OBJ text."""

import numpy as np

CUBE = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=float)
CUBE_FACES = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]  # seen from outside


def block():
    """Vertices (8, 3) and triangles (12, 3) of the unit cube, outward."""
    return CUBE, np.array([t for a, b, c, d in CUBE_FACES for t in ((a, b, c), (a, c, d))])


def ball(subdivisions):
    """Vertices on the unit sphere and triangles, from an octahedron whose triangles are quartered so often."""
    vertices = [np.array(v, float) for v in ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))]
    faces = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
    for _ in range(subdivisions):
        middle, finer = {}, []

        def between(i, j, middle=middle):
            key = min(i, j), max(i, j)
            if key not in middle:
                sum_ = vertices[i] + vertices[j]
                middle[key] = len(vertices)
                vertices.append(sum_ / np.linalg.norm(sum_))
            return middle[key]

        for a, b, c in faces:
            ab, bc, ca = between(a, b), between(b, c), between(c, a)
            finer += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        faces = finer
    return np.array(vertices), np.array(faces)


def obj(vertices, triangles):
    """OBJ text with 17 digits."""
    lines = ["v " + " ".join(repr(float(x)) for x in v) for v in vertices]
    return "\n".join(lines + ["f " + " ".join(str(i + 1) for i in t) for t in triangles]) + "\n"
