"""S10: a closed mesh, and a closed wall of polygons, has no cracks, or has them."""

import numpy as np
import pytest
from nightly import by_night

from harness.scene.generate.icosphere import icosphere
from harness.stress.geometry.cracks import ROWS, faces

SEED = 20201107
PRECISIONS = ("float32", "float64")
ROW, WALL = ROWS
BOTH = pytest.mark.parametrize("row", [row.name for row in ROWS])


@pytest.fixture(params=[0, 1])
def level(request):
    """Near the origin, and anywhere."""
    return float(10 ** np.random.default_rng([SEED, request.param]).uniform(0, 5 * request.param))


@BOTH
@pytest.mark.parametrize("precision", PRECISIONS)
def test_the_shared_frame_has_no_cracks(strain, serial, level, precision, row):
    finding = strain(serial, row, level, precision, SEED, triangle="watertight")
    assert finding.count >= 9_000 and finding.failures == 0


@BOTH
@pytest.mark.parametrize("precision", PRECISIONS)
def test_moller_trumbore_has(strain, serial, level, precision, row):
    """In float64 as in float32."""
    finding = strain(serial, row, level, precision, SEED, triangle="moller-trumbore")
    assert finding.failures > 0.01 * finding.count


@BOTH
@pytest.mark.parametrize("precision", by_night(PRECISIONS, "float64"))
def test_contraction_opens_cracks_and_kahan_closes_them(strain, serial, precision, row):
    contracted = strain(serial, row, 1.0, precision, SEED, triangle="watertight", floating_point="contract")
    kahan = strain(serial, row, 1.0, precision, SEED, triangle="watertight-kahan", floating_point="contract")
    strict = strain(serial, "cracks", 1.0, precision, SEED, triangle="watertight-kahan")
    assert contracted.failures > 0
    assert kahan.failures == strict.failures == 0


@pytest.mark.parametrize("precision", PRECISIONS)
def test_origins_are_inside_however_far_the_mesh_is(precision):
    """Each triangle is seen from its inner side, so that what gets out has come through a crack."""
    print("seed", SEED)
    for level in ROW.levels:
        trial = ROW.make(level, precision, np.random.default_rng(SEED))
        (mesh,) = trial.scene.objects
        origins = trial.rays[::30, :3]
        arms = mesh.vertices[mesh.triangles] - origins[:, None, None]
        assert np.linalg.det(arms).min() > 0


@pytest.mark.parametrize("precision", PRECISIONS)
def test_polygons_are_seen_from_within(precision):
    """Each polygon of the wall, from each origin, is on the other side of its plane than the body."""
    print("seed", SEED)
    for level in WALL.levels:
        trial = WALL.make(level, precision, np.random.default_rng(SEED))
        for polygon in trial.scene.objects:
            arms = np.array(polygon.vertices)[:3] - trial.rays[::30, None, :3]
            assert np.abs(np.sign(np.linalg.det(arms)).sum()) == len(arms)


def test_the_wall_closes():
    """80 vertices, 12 pentagons and 30 hexagons; each edge has two of them, one on each side."""
    vertices, loops = faces(1)
    assert vertices.shape == (80, 3) and sorted(map(len, loops)) == [5] * 12 + [6] * 30
    edges = np.concatenate([np.stack([loop, np.roll(loop, -1)], axis=1) for loop in loops])
    assert len(np.unique(edges, axis=0)) == len(edges) == 240
    assert {*map(tuple, edges.tolist())} == {*map(tuple, edges[:, ::-1].tolist())}


def test_the_mesh_is_a_ball_of_320_triangles():
    vertices, triangles = icosphere(2)
    assert vertices.shape == (162, 3) and triangles.shape == (320, 3)
    np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), 1)
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    volume = np.linalg.det(vertices[triangles]).sum() / 6
    assert 0.94 * 4 / 3 * np.pi < volume < 4 / 3 * np.pi
