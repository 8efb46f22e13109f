"""S10: rays from inside a closed mesh at its edges and vertices; a ray that gets out has found a crack."""

import numpy as np

from harness.scene.generate.icosphere import icosphere
from harness.scene.model import Mesh
from harness.stress import exact
from harness.stress.row import Row, Trial, directions, in_general_position, rounded

AT_EDGES, AT_VERTICES = 6_000, 3_000
BUMPS = 1.0, 1.3  # radii of the vertices
INSIDE = 0.2  # origins are nearer to the centre than this, which is inside


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
    return Trial(exact.scene(Mesh(exact.MATERIAL, vertices, triangles, True)), exact.must_hit, rays)


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
