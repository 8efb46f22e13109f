"""S15: R at the critical angle and past it."""

import numpy as np
import pytest
from random_scenes import random_scene, random_stage

from harness.stress.row import ROUNDOFF

SEED = 20201107
PRECISIONS = ("float32", "float64")


def drawn(low, high):
    return float(10 ** np.random.default_rng(SEED).uniform(low, high))


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("level", [1e-2, 1e-6, 1e-10, 1e-16, drawn(-14, -2)])
def test_just_before_the_critical_angle(strain, serial, level, precision):
    finding = strain(serial, "critical", level, precision, SEED)
    assert finding.failures == 0 and len(finding.errors) == finding.count


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("level", [1e-5, 1e-3, 0.3, drawn(-5, -0.5)])
def test_past_it_all_is_reflected(strain, serial, level, precision):
    finding = strain(serial, "total-reflection", level, precision, SEED)
    assert finding.failures == 0 and finding.count > 100


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("level", [1e-5, 1e-3, 0.3])
def test_past_it_the_bare_formula_has_no_number(strain, serial, level, precision):
    finding = strain(serial, "total-reflection", level, precision, SEED, fresnel="unclamped")
    assert finding.failures == finding.count > 100


@pytest.mark.parametrize("precision", PRECISIONS)
def test_rounding_puts_rays_past_it(strain, serial, precision):
    near = strain(serial, "critical", ROUNDOFF[precision], precision, SEED, fresnel="unclamped")
    assert near.failures > 0.05 * near.count
    assert strain(serial, "critical", 1e-3, precision, SEED, fresnel="unclamped").failures == 0


def anything(rng):
    """A clear material of any index, permeability and exponent that a file may reasonably have."""
    eps, mu = 10 ** rng.uniform(-3, 6), 10 ** rng.uniform(-2, 2)
    exponent = rng.choice([0, 1, 2.5, 50, 10 ** rng.uniform(0, 6)])
    return f"(0.2,0.3,0.1) 0.9 {exponent} (1,0.9,1) {eps!r} {mu!r}"


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("seed", [SEED, SEED + 1])
def test_no_index_and_no_exponent_makes_a_sample_that_is_no_number(bench, serial, seed, precision):
    """Snell, Fresnel and Phong at every angle: overlapping shapes of all kinds, from inside and outside."""
    print("seed", seed)
    rng = np.random.default_rng(seed)
    source = random_scene(rng, 5, 3, 3, 3, material=anything, rest=random_stage(rng))
    side = bench.by_speed(serial, 16, 48)
    jobs = {"width": side, "height": side, "depth": 6, "shadows": True, "precision": precision}
    result = bench.result(serial, source, **jobs)
    assert result.said.rays["non_finite"] == 0 and np.isfinite(result.array).all()
