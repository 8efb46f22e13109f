"""numba with `floating_point` fast: what is not finite is counted all the same, though the compiler believes in no such
numbers (NUM-3, CNT-2)."""

import numpy as np
import pytest
from tessellate import obj

pytest.importorskip("numba")
SIZE = {"width": 12, "height": 9, "depth": 0, "exact": True}
CAMERA = "CAMERA (0,0,0) (2,0,0) (0,2,0) (0,0,40)\n"


def comb(teeth):
    """A mesh of so many thin bricks one behind the other, 1 wide: a line through all crosses it twice as often."""
    corners = np.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]) - (0.5, 0.5, 0)
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    triangles = np.array([t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))])
    bricks = [corners * (1, 1, 0.1) - (0, 0, 0.3 * k) for k in range(teeth)]
    return np.concatenate(bricks), np.concatenate([triangles + 8 * k for k in range(teeth)])


@pytest.mark.slow
def test_lines_that_cross_a_mesh_too_often_are_counted(bench, tmp_path):
    """CSG-6, in float64."""
    (tmp_path / "comb.obj").write_text(obj(*comb(40)))
    source = CAMERA + "AMBIENT (1,1,1)\nAND SPHERE (0,0,0) 30\n"
    source += f'MESH "{tmp_path / "comb.obj"}" (0,0,0) (0,0,0) 1 END (0.5,0.6,0.7) 0 1 (0,0,0) 1 1\n'
    strict, fast = (bench.result("numba", source, floating_point=method, **SIZE) for method in ("strict", "fast"))
    nan = np.isnan(strict.array).any(axis=2)
    assert 0 < nan.sum() < nan.size and strict.said.rays["non_finite"] == nan.sum()
    assert fast.said.rays == strict.said.rays
    np.testing.assert_array_equal(np.isnan(fast.array).any(axis=2), nan)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["strict", "contract", "fast"])
def test_products_that_overflow_are_counted(bench, method):
    """In float32. Colours are decoded as sRGB, 1e10 to 1e24, and multiplied."""
    source = CAMERA + "AMBIENT (1e10,1,1)\nSPHERE (0,0,0) 1 (1e10,0.5,0.5) 0 1 (0,0,0) 1 1\n"
    result = bench.result("numba", source, precision="float32", floating_point=method, **SIZE)
    infinite = ~np.isfinite(result.array).all(axis=2)
    assert 0 < infinite.sum() < infinite.size
    assert result.said.rays["non_finite"] == infinite.sum()
    assert result.said.used["methods"]["floating_point"] == method
