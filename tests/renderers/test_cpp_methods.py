"""The arithmetic that the C++ renderer is built for (NUM-3)."""

import numpy as np
import pytest
from nightly import by_night

MIRROR = "(0.5,0.5,0.5) 0.5 2.5 (0,0,0) 9 1"


@pytest.mark.slow
@pytest.mark.parametrize("precision", ["float64", "float32"])
@pytest.mark.parametrize("floating_point", by_night(["strict", "contract", "fast"], "contract"))
def test_non_finite_samples_are_counted(bench, floating_point, precision):
    """CNT-2 of highlights behind, which have no power (LOC-4); fast-math believes there is no such number."""
    source = "CAMERA (0,0,3) (0.8,0,0) (0,0.8,0) (0.03,0.02,5)\nLIGHT (9,2,1) (1,1,1) 0\nBACKGROUND (0.2,0.3,0.4)\n"
    source += f"SPHERE (0,0,0) 1 {MIRROR}\n"
    methods = {"floating_point": floating_point, "precision": precision, "phong": "unclamped"}
    result = bench.result("cpp", source, width=12, height=12, depth=2, **methods)
    missing = np.count_nonzero(~np.isfinite(result.array).all(axis=-1))
    assert 0 < missing == result.said.rays["non_finite"]
    assert result.said.used["methods"]["floating_point"] == floating_point
    assert ("-ffast-math" in result.said.versions["flags"]) == (floating_point == "fast")
