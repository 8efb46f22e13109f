"""Fits of time against work: known lines and powers are found, at the rate that the intervals promise."""

import itertools

import numpy as np
import pytest

from harness.statistics import fit

A, B = 2e-3, 2e-9
CELLS = np.array(list(itertools.product((1e3, 4e3, 16e3, 64e3), (1, 3, 10), (13, 51))))
WORK = CELLS.prod(axis=1)
RUNS = 400


def medians(seconds, noise, rng, processes=5):
    """Of so many processes a cell, with a relative noise (one, or one a cell)."""
    scatter = np.broadcast_to(noise, seconds.shape)[:, None] * rng.standard_normal((len(seconds), processes))
    return np.median(seconds[:, None] * (1 + scatter), axis=1)


def rate(covered):
    """Share of runs, which at 95 % lies in here but once in 10,000 times; HC3 errs to the safe side."""
    from scipy import stats  # here, as it takes a second to import

    low = stats.binom.ppf(1e-4, RUNS, 0.95) / RUNS
    share = sum(covered) / RUNS
    print(f"seeds 0 to {RUNS - 1}: covered {share:.3f}, at least {low:.3f}")
    return low <= share


@pytest.mark.parametrize("noise", [0.02, np.where(np.median(WORK) > WORK, 0.1, 0.02)], ids=["even", "short are noisy"])
def test_a_and_b_are_in_their_intervals_as_often_as_promised(noise):
    lines = [fit.line(WORK, medians(A + B * WORK, noise, np.random.default_rng(seed))) for seed in range(RUNS)]
    assert rate([line.a.low <= A <= line.a.high for line in lines])
    assert rate([line.b.low <= B <= line.b.high for line in lines])
    # nor are they needlessly wide
    assert np.median([(line.b.high - line.b.low) / B for line in lines]) < 0.2


def test_exponents_are_in_their_intervals_as_often_as_promised():
    true = {"p": 1.0, "d": 0.4, "o + l": 0.9}
    factors = dict(zip(true, CELLS.T, strict=True))
    seconds = 1e-7 * np.prod([factors[name] ** power for name, power in true.items()], axis=0)
    found = [fit.exponents(factors, medians(seconds, 0.03, np.random.default_rng(seed))) for seed in range(RUNS)]
    for name, power in true.items():
        assert rate([one[name].low <= power <= one[name].high for one in found])


def test_it_is_least_squares_of_relative_errors():
    seconds = medians(A + B * WORK, 0.1, np.random.default_rng(1))
    line = fit.line(WORK, seconds)
    from scipy.optimize import curve_fit

    (a, b), _ = curve_fit(lambda work, a, b: a * 1e-3 + b * 1e-9 * work, WORK, seconds, p0=(1, 1), sigma=seconds)
    assert (line.a.value, line.b.value) == pytest.approx((a * 1e-3, b * 1e-9), rel=1e-5)
    errors = line.seconds(WORK) / seconds - 1
    assert line.spread == pytest.approx(np.sqrt((errors**2).sum() / (len(WORK) - 2)))


def test_an_exact_line_has_no_width():
    line = fit.line(WORK, A + B * WORK)
    assert line.a == pytest.approx((A, A, A)) and line.b == pytest.approx((B, B, B)) and line.cells == 24


def test_a_constant_lowers_an_exponent_by_its_share():
    seconds = B * WORK * (1 + 0.1)  # as if a were a tenth of every time: then it is no constant, and lowers nothing
    assert fit.exponents({"w": WORK}, seconds)["w"].value == pytest.approx(1)
    work = np.geomspace(1, 1.1, 9)
    assert fit.exponents({"w": work}, 1.05 / 9 + work)["w"].value == pytest.approx(1 - 0.1, abs=1e-3)


@pytest.mark.parametrize(
    ("work", "why"),
    [
        ([1, 2, 3, 4], "4 cells, 5 are needed"),
        ([2, 2, 2, 2, 2], "work not varied"),
        ([0, 0, 0, 0, 0], "work not varied"),
        ([1, 1, 1, 1, 2], "a coefficient depends on one cell alone"),
    ],
)
def test_no_line_without_enough_cells(work, why):
    with pytest.raises(fit.Unfit, match=f"^{why}$"):
        fit.line(np.array(work), np.linspace(1, 1.5, len(work)))


def test_no_exponents_of_what_was_swept_together():
    p = np.array([1.0, 2, 4, 8, 16, 32])
    with pytest.raises(fit.Unfit, match=r"^not all of p, d varied independently$"):
        fit.exponents({"p": p, "d": p**2}, p)


def test_noise_is_the_standard_error_of_the_median():
    rng = np.random.default_rng(1)
    drawn = 10 + rng.standard_normal((4000, 25))
    assert np.mean([fit.noise(row) for row in drawn]) == pytest.approx(np.median(drawn, axis=1).std() / 10, rel=0.05)
    assert fit.noise([9, 10, 10, 10, 11, 99]) < 0.1  # of which one met another load
    assert np.isnan(fit.noise([1.0]))
