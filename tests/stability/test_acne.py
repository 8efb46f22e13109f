"""S7: no surface shadows itself, whatever the scale and wherever the scene lies; without an offset half of it does."""

from dataclasses import replace

import numpy as np
import pytest

from harness import stress
from harness.renderer.parameters import Parameters
from harness.stress.light import acne
from harness.stress.row import ROUNDOFF

BY_NAME = {row.name: row for row in acne.ROWS}
SEED = 20201107
PRECISIONS = ("float32", "float64")
CELLS = [(10.0**k, 0.0) for k in range(-6, 7, 2)] + [(1.0, 1e3), (1e2, 1e3)]  # radius, distance in radii


def drawn(low, high, number):
    """A level that no list has."""
    return float(10 ** np.random.default_rng([SEED, number]).uniform(low, high))


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("radius, away", [*CELLS, (drawn(-6, 6, 0), 0.0), (drawn(-6, 6, 1), drawn(0, 3, 2))])
def test_the_bounded_offset_leaves_no_acne(strain, serial, monkeypatch, radius, away, precision):
    def make(level, precision, rng):
        return acne.ball(radius, away, precision, rng)

    monkeypatch.setitem(stress.rows(), "acne-cell", replace(BY_NAME["acne-scale"], name="acne-cell", make=make))
    finding = strain(serial, "acne-cell", radius, precision, SEED)
    assert finding.failures == 0 and finding.count > 5_000
    told = Parameters(precision=precision).values()
    assert told["offset"] == "bounded" and acne.displacement(radius, away, told) < 1e-3


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name, level", [("acne-scale", 1e-6), ("acne-scale", drawn(-3, 6, 3)), ("acne-offset", 1e3)])
def test_without_an_offset_there_is_acne_everywhere(strain, serial, name, level, precision):
    finding = strain(serial, name, level, precision, SEED, offset="none")
    assert finding.failures > 0.05 * finding.count


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", ["acne-scale", "acne-offset"])
def test_a_fixed_offset_is_lost_where_the_row_says(strain, serial, name, precision):
    """A length of 1e-4 is nothing to numbers of 1e-4/u, and all that there is to small ones."""
    told = Parameters(precision=precision, offset="fixed").values()
    limit = BY_NAME[name].limit(ROUNDOFF[precision], told)
    assert strain(serial, name, 10 * limit, precision, SEED, offset="fixed").failures > 100
    assert strain(serial, name, limit / 30, precision, SEED, offset="fixed").failures == 0
    assert acne.displacement(1e-6, 0, told) == pytest.approx(100)


@pytest.mark.parametrize("precision", PRECISIONS)
def test_a_relative_offset_moves_far_scenes_by_more(strain, serial, precision):
    assert strain(serial, "acne-offset", 1e3, precision, SEED, offset="relative").failures == 0
    bounded, relative = (
        acne.displacement(1, 1e3, Parameters(precision=precision, offset=name).values())
        for name in ("bounded", "relative")
    )
    assert relative > 7 * bounded


@pytest.mark.parametrize("precision", PRECISIONS)
def test_a_fixed_offset_must_exceed_the_rounding(strain, serial, precision):
    (below, above) = (BY_NAME["acne-epsilon"].limit(ROUNDOFF[precision], {}) * by for by in (1 / 30, 30))
    assert strain(serial, "acne-epsilon", below, precision, SEED).failures > 100
    assert strain(serial, "acne-epsilon", above, precision, SEED).failures == 0
