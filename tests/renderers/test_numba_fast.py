"""numba with `floating_point` fast: what is not finite is counted all the same, though the compiler believes in no such
numbers (NUM-3, CNT-2)."""

import numpy as np
import pytest

pytest.importorskip("numba")
SIZE = {"width": 12, "height": 9, "depth": 0, "exact": True}
CAMERA = "CAMERA (0,0,0) (2,0,0) (0,2,0) (0,0,40)\n"


@pytest.mark.slow
def test_highlights_without_a_power_are_counted(bench):
    """LOC-4, in float64."""
    source = CAMERA + "LIGHT (9,2,9) (1,1,1) 0\nSPHERE (0,0,0) 1 (0.5,0.6,0.7) 0.5 2.5 (0,0,0) 9 1\n"
    methods = {"phong": "unclamped", **SIZE}
    strict, fast = (bench.result("numba", source, floating_point=method, **methods) for method in ("strict", "fast"))
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
