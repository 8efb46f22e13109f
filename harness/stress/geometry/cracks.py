"""S10: rays from the inside of a closed mesh, at its edges and vertices: each that gets out has found a crack."""

import numpy as np

from harness.scene.model import Mesh
from harness.stress import exact
from harness.stress.row import Finding, Row, Trial, directions, in_general_position, rounded

AT_EDGES, AT_VERTICES = 6_000, 3_000
BUMPS = 1.0, 1.3  # radii of the vertices
INSIDE = 0.2  # origins are nearer to the centre than this, which is inside


def icosphere(quarterings: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices on the unit sphere and triangles, outward; an icosahedron's, each quartered so many times."""
    golden = (1 + 5**0.5) / 2
    corners = [(0.0, a, b * golden) for a in (-1, 1) for b in (-1, 1)]
    vertices = [np.roll(corner, turn) / np.hypot(1, golden) for turn in range(3) for corner in corners]
    near = 1.1  # an edge is 1.05 long, the next distance 1.7
    linked = np.linalg.norm(np.subtract.outer(vertices, vertices).diagonal(axis1=1, axis2=3), axis=2) < near
    triangles = [
        (i, j, k) for i in range(12) for j in range(i) for k in range(j) if linked[i, j] & linked[j, k] & linked[i, k]
    ]
    for _ in range(quarterings):
        middles, finer = {}, []
        for a, b, c in triangles:
            ab, bc, ca = (_middle(vertices, middles, *edge) for edge in ((a, b), (b, c), (c, a)))
            finer += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        triangles = finer
    vertices, triangles = np.array(vertices), np.array(triangles, np.int32)
    inward = np.linalg.det(vertices[triangles]) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    return vertices, triangles


def _middle(vertices, middles, a, b):
    """The number of the vertex between two, made once."""
    edge = min(a, b), max(a, b)
    if edge not in middles:
        middles[edge] = len(vertices)
        between = vertices[a] + vertices[b]
        vertices.append(between / np.linalg.norm(between))
    return middles[edge]


def judge(result) -> Finding:
    hits = result.array
    return Finding(len(hits), int((~((hits[:, 7] >= 0) & exact.are_proper(hits))).sum()))


def make(level, precision, rng) -> Trial:
    vertices, triangles = icosphere(2)
    centre = level * directions(rng, 1)[0]
    turned = vertices * rng.uniform(*BUMPS, (len(vertices), 1)) @ in_general_position(rng)
    vertices = rounded(centre + turned, precision)
    count = AT_EDGES + AT_VERTICES
    origins = rounded(centre + INSIDE * rng.uniform(0, 1, (count, 1)) * directions(rng, count), precision)
    a, b = vertices[triangles[rng.integers(0, len(triangles), AT_EDGES), :2].T]
    ends = vertices[rng.integers(0, len(vertices), AT_VERTICES)]
    arms = np.concatenate([a + rng.uniform(0, 1, (AT_EDGES, 1)) * (b - a), ends]) - origins
    rays = np.hstack([origins, rounded(arms / np.linalg.norm(arms, axis=1, keepdims=True), precision)])
    return Trial(exact.scene(Mesh(exact.MATERIAL, vertices, triangles, True)), judge, rays)


ROWS = (
    Row(
        "cracks",
        code="S10",
        title="Edges and vertices of a closed mesh, from its inside",
        stress="distance of the mesh from (0, 0, 0) / its radius",
        failure="rays that get out of the closed mesh",
        levels=(1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6),
        make=make,
        method="triangle",
        source="Woop, Benthin, Wald 2013; Möller, Trumbore 1997; Kahan's difference of products in pbrt 4e, 3.3.2",
    ),
)
