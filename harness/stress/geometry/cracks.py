"""S10: rays from inside a closed mesh or wall of polygons, at edges and vertices; one that gets out found a crack."""

import numpy as np

from harness.scene.generate.icosphere import icosphere
from harness.scene.model import Mesh, Polygon
from harness.stress import exact
from harness.stress.row import Row, Trial, directions, in_general_position, rounded

AT_EDGES, AT_VERTICES = 6_000, 3_000
BUMPS = 1.0, 1.3  # radii of the vertices
INSIDE = 0.2  # origins are nearer to the centre than this, which is inside


STRETCH = 1.0, 1.5  # along three axes, of the body of polygons


def aimed(vertices, edges, centre, precision, rng) -> np.ndarray:
    """Rays (R, 6) from near `centre` at places on the edges (E, 2) and at vertices."""
    count = AT_EDGES + AT_VERTICES
    origins = rounded(centre + INSIDE * rng.uniform(0, 1, (count, 1)) * directions(rng, count), precision)
    a, b = vertices[edges[rng.integers(0, len(edges), AT_EDGES)].T]
    ends = vertices[rng.integers(0, len(vertices), AT_VERTICES)]
    arms = np.concatenate([a + rng.uniform(0, 1, (AT_EDGES, 1)) * (b - a), ends]) - origins
    return np.hstack([origins, rounded(arms / np.linalg.norm(arms, axis=1, keepdims=True), precision)])


def make(level, precision, rng) -> Trial:
    vertices, triangles = icosphere(2)
    centre = level * directions(rng, 1)[0]
    turned = vertices * rng.uniform(*BUMPS, (len(vertices), 1)) @ in_general_position(rng)
    vertices = rounded(centre + turned, precision)
    rays = aimed(vertices, triangles[:, :2], centre, precision, rng)
    return Trial(exact.scene(Mesh(exact.MATERIAL, vertices, triangles, True)), exact.must_hit, rays)


def faces(size) -> tuple[np.ndarray, list[np.ndarray]]:
    """Vertices (V, 3) and faces (rows of vertices, in order) of a convex body of pentagons and hexagons.

    Its faces touch the unit sphere at the vertices of `icosphere(size)`; three meet at each vertex.
    """
    normals, triangles = icosphere(size)
    vertices = np.linalg.solve(normals[triangles], np.ones((len(triangles), 3, 1)))[..., 0]
    loops = []
    for number, normal in enumerate(normals):
        (around,) = np.nonzero((triangles == number).any(axis=1))
        arms = vertices[around] - normal
        angles = np.arctan2(np.cross(arms[0], arms) @ normal, arms @ arms[0])
        loops.append(around[np.argsort(angles)])
    return vertices, loops


def make_wall(level, precision, rng) -> Trial:
    vertices, loops = faces(1)
    centre = level * directions(rng, 1)[0]
    vertices = rounded(centre + vertices * rng.uniform(*STRETCH, 3) @ in_general_position(rng), precision)
    edges = np.concatenate([np.stack([loop, np.roll(loop, -1)], axis=1) for loop in loops])
    polygons = [Polygon(exact.MATERIAL, tuple(map(exact.triple, vertices[loop]))) for loop in loops]
    return Trial(exact.scene(*polygons), exact.must_hit, aimed(vertices, edges, centre, precision, rng))


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
    Row(
        "polygon-cracks",
        code="S10",
        title="Edges and vertices of a closed wall of polygons, from its inside",
        stress="distance of the wall from (0, 0, 0) / its radius",
        failure="rays that get out of the wall",
        levels=(1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6),
        make=make_wall,
        method="triangle",
        source="Woop, Benthin, Wald 2013; Kahan's difference of products in pbrt 4e, 3.3.2",
    ),
)
