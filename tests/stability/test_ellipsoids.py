"""S5: flat and long ellipsoids, their hits and their normals."""

import mpmath as mp
import numpy as np
import pytest

from harness.stress.geometry.ellipsoids import ROWS, Truth
from harness.stress.row import ROUNDOFF

BY_NAME = {row.name: row for row in ROWS}
SEED = 20201107
PRECISIONS = ("float32", "float64")


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", BY_NAME)
def test_the_formula_loses_thin_ellipsoids(strain, serial, name, precision):
    level = 5 * BY_NAME[name].limit(ROUNDOFF[precision], {"sphere": "textbook"})
    finding = strain(serial, name, level, precision, SEED, sphere="textbook")
    assert finding.failures > 0.1 * finding.count


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", BY_NAME)
def test_the_robust_form_keeps_them(strain, serial, name, precision):
    u = ROUNDOFF[precision]
    level = 5 * BY_NAME[name].limit(u, {"sphere": "textbook"})
    finding = strain(serial, name, level, precision, SEED, sphere="robust")
    # A needle of 1e3 u^-1/2 is seen from 1e4 of its radii: some rays pass the rim by less than its rounding.
    assert finding.failures <= 10 * u * level * finding.count
    assert np.median(finding.errors) < 10 * BY_NAME[name].expected(level, u, {"sphere": "robust"})


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("method", ["textbook", "robust"])
def test_normals_are_off_as_theory_says(strain, serial, method, precision):
    u = ROUNDOFF[precision]
    for name, row in BY_NAME.items():
        level = float(10 ** np.random.default_rng([SEED, len(name)]).uniform(1, 2))
        finding = strain(serial, name, level, precision, SEED, sphere=method)
        expected = row.expected(level, u, {"sphere": method})
        assert expected / 10 < np.median(finding.errors) < 30 * expected


@pytest.mark.parametrize("name", BY_NAME)
def test_truth_is_that_of_50_digits(name):
    print("seed", SEED)
    for level in BY_NAME[name].levels[::3]:
        trial = BY_NAME[name].make(level, "float64", np.random.default_rng(SEED))
        (ellipsoid,) = trial.scene.objects
        truth = Truth(trial.rays[:60], np.array(ellipsoid.centre), np.array(ellipsoid.axes))
        for number, ray in enumerate(trial.rays[:60]):
            t, normal = by_digits(ray, ellipsoid)
            assert truth.hits.hit[number] == (t is not None)
            if t is not None:
                with mp.workdps(80):
                    assert abs(mp.ldexp(int(truth.hits.t[number]), -truth.hits.bits) - t) < mp.mpf(10) ** -18 * t
                np.testing.assert_allclose(truth.normals(np.array([number]))[0], normal, rtol=0, atol=1e-15)


def by_digits(ray, ellipsoid):
    """First t > 0 with |M⁻¹ (o + t d - c)| = 1 and the gradient there, a unit vector."""
    with mp.workdps(80):
        o, d, c = (mp.matrix([mp.mpf(float(x)) for x in part]) for part in (ray[:3], ray[3:], ellipsoid.centre))
        inverse = mp.matrix([[mp.mpf(x) for x in axis] for axis in ellipsoid.axes]).T ** -1
        f, d = inverse * (o - c), inverse * d
        a, b, k = mp.fdot(d, d), mp.fdot(f, d), mp.fdot(f, f) - 1
        discriminant = b * b - a * k
        roots = [(-b + sign * mp.sqrt(discriminant)) / a for sign in (-1, 1)] if discriminant >= 0 else []
        t = min((root for root in roots if root > 0), default=None)
        if t is None:
            return None, None
        normal = inverse.T * (f + t * d)
        return t, [float(x / mp.norm(normal)) for x in normal]
