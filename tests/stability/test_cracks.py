"""S10: a closed mesh has no cracks, or has them."""

import numpy as np
import pytest
from nightly import by_night

from harness.scene.generate.icosphere import icosphere
from harness.stress.geometry.cracks import ROWS

SEED = 20201107
PRECISIONS = ("float32", "float64")
(ROW,) = ROWS


@pytest.fixture(params=[0, 1])
def level(request):
    """Near the origin, and anywhere."""
    return float(10 ** np.random.default_rng([SEED, request.param]).uniform(0, 5 * request.param))


@pytest.mark.parametrize("precision", PRECISIONS)
def test_the_shared_frame_has_no_cracks(strain, serial, level, precision):
    finding = strain(serial, "cracks", level, precision, SEED, triangle="watertight")
    assert finding.count >= 9_000 and finding.failures == 0


@pytest.mark.parametrize("precision", PRECISIONS)
def test_moller_trumbore_has(strain, serial, level, precision):
    """In float64 as in float32."""
    finding = strain(serial, "cracks", level, precision, SEED, triangle="moller-trumbore")
    assert finding.failures > 0.01 * finding.count


@pytest.mark.parametrize("precision", by_night(PRECISIONS, "float64"))
def test_contraction_opens_cracks_and_kahan_closes_them(strain, serial, precision):
    contracted = strain(serial, "cracks", 1.0, precision, SEED, triangle="watertight", floating_point="contract")
    kahan = strain(serial, "cracks", 1.0, precision, SEED, triangle="watertight-kahan", floating_point="contract")
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


def test_the_mesh_is_a_ball_of_320_triangles():
    vertices, triangles = icosphere(2)
    assert vertices.shape == (162, 3) and triangles.shape == (320, 3)
    np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), 1)
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    volume = np.linalg.det(vertices[triangles]).sum() / 6
    assert 0.94 * 4 / 3 * np.pi < volume < 4 / 3 * np.pi
