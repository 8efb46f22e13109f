"""S8: what an offset that is too long loses of a contact shadow."""

import numpy as np
import pytest

from harness.stress.light import leak
from harness.stress.light.leak import ROWS

BY_NAME = {row.name: row for row in ROWS}
SEED = 20201107
PRECISIONS = ("float32", "float64")


def drawn(low, high):
    return float(10 ** np.random.default_rng(SEED).uniform(low, high))


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("level", [1e2, 1.0, 1e-3, 1e-6, drawn(-6, 2)])
def test_an_offset_that_knows_the_scale_loses_none(strain, serial, level, precision):
    finding = strain(serial, "leak", level, precision, SEED)
    assert finding.failures == 0 and finding.count == leak.WIDTH * leak.HEIGHT


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("level", [1e-2, 1e-3, 1e-6, drawn(-3, -2)])
def test_a_fixed_offset_loses_what_theory_says(strain, serial, level, precision):
    finding = strain(serial, "leak", level, precision, SEED, offset="fixed")
    expected = leak.lost(1e-4 / level)
    assert abs(finding.errors - expected).max() <= 1.01 / leak.HEIGHT
    assert finding.failures > 0


@pytest.mark.parametrize("precision", PRECISIONS)
def test_by_the_offset(strain, serial, precision):
    for level in (1e-1, drawn(-2, -1)):
        finding = strain(serial, "leak-epsilon", level, precision, SEED)
        assert abs(finding.errors - leak.lost(level)).max() <= 1.01 / leak.HEIGHT
    assert strain(serial, "leak-epsilon", 1e-4, precision, SEED).failures == 0


@pytest.mark.parametrize("precision", PRECISIONS)
def test_a_fixed_offset_has_a_window(strain, serial, precision):
    """One length, 1e-4, is right for both rows, and much less or much more for one of them only."""
    tiny = {"float32": 1e-8, "float64": 1e-17}[precision]
    found = [
        [strain(serial, name, length, precision, SEED).failures > 0 for name in ("acne-epsilon", "leak-epsilon")]
        for length in (tiny, 1e-4, 0.05)
    ]
    assert found == [[True, False], [False, False], [False, True]]
