"""S11: triangles that are almost lines."""

import numpy as np

from harness.scene.model import Mesh
from harness.stress import exact
from harness.stress.row import Row, Trial, directions, in_general_position, rounded

SLIVERS = 48
AIMED = 20_000  # rays; rounding moves some beside the triangle that they are aimed at
AWAY = 2.0  # distance of the origins


def make(level, precision, rng) -> Trial:
    """An open mesh of slivers of length 1 and height `level`, and rays that all hit the sliver they are aimed at."""
    turns = np.array([in_general_position(rng) for _ in range(SLIVERS)])
    ends, tip = rng.uniform(-1, 1, (SLIVERS, 3)), rng.uniform(0.2, 0.8, (SLIVERS, 1))
    corners = np.stack([ends, ends + turns[:, 0], ends + tip * turns[:, 0] + level * turns[:, 1]], axis=1)
    corners = rounded(corners, precision)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    corners = corners[np.square(normals).sum(axis=1) > 0]  # as scene/surface.py does with a mesh that it reads
    which = rng.integers(0, len(corners), AIMED)
    aims = np.einsum("ri,rij->rj", rng.dirichlet((1, 1, 1), AIMED), corners[which])
    d = rounded(directions(rng, AIMED), precision)
    rays = np.hstack([rounded(aims - AWAY * d, precision), d])
    hit = exact.triangle(rays, corners[which]).hit
    mesh = Mesh(
        exact.MATERIAL, corners.reshape(-1, 3), np.arange(corners.size // 3, dtype=np.int32).reshape(-1, 3), False
    )
    return Trial(exact.scene(mesh), exact.must_hit, rays[hit])


ROWS = (
    Row(
        "slivers",
        code="S11",
        title="Triangles that are all but lines",
        stress="height / length of the triangle",
        failure="rays that go through the triangle and miss it",
        levels=(1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14),
        make=make,
        method="triangle",
        source="Woop, Benthin, Wald 2013; Möller, Trumbore 1997",
        # Rounding by u moves a point of the ray across the sliver.
        limit=lambda u, methods: AWAY * u,
    ),
)
