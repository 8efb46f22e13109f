"""The arithmetic that the C++ renderer is built for (NUM-3)."""

import numpy as np
import pytest
from nightly import by_night
from tessellate import block, obj

MIRROR = "(0.5,0.5,0.5) 0.5 3 (0,0,0) 9 1"


@pytest.mark.slow
@pytest.mark.parametrize("precision", ["float64", "float32"])
@pytest.mark.parametrize("floating_point", by_night(["strict", "contract", "fast"], "contract"))
def test_non_finite_samples_are_counted(bench, tmp_path, floating_point, precision):
    """CNT-2 of rays that cross 80 faces of a mesh, where 64 fit (CSG-6); fast-math believes there is no such number."""
    vertices, triangles = (np.asarray(part) for part in block())
    layers = [vertices * (1, 1, 0.01) - (0, 0, 0.03 * i) for i in range(40)]
    path = tmp_path / "layers.obj"
    path.write_text(obj(np.vstack(layers), np.vstack([triangles + len(vertices) * i for i in range(40)])))
    source = "CAMERA (0.5,0.5,3) (0.8,0,0) (0,0.8,0) (0.03,0.02,5)\nLIGHT (1,2,6) (1,1,1) 0\nBACKGROUND (0.2,0.3,0.4)\n"
    source += f'AND MESH "{path}" (0,0,0) (0,0,0) 1 BOX (-9,-9,-9) (18,0,0) (0,18,0) (0,0,18) END {MIRROR}\n'
    methods = {"floating_point": floating_point, "precision": precision}
    result = bench.result("cpp", source, width=12, height=12, depth=2, **methods)
    missing = np.count_nonzero(~np.isfinite(result.array).all(axis=-1))
    assert 0 < missing == result.said.rays["non_finite"]
    assert result.said.used["methods"]["floating_point"] == floating_point
    assert ("-ffast-math" in result.said.versions["flags"]) == (floating_point == "fast")
