"""Each gate is shown to pass what it should and to fail what it should."""

import numpy as np
import pytest

from harness.judge import judge as judges
from harness.judge.judge import Reference, compare_rays, errors

RNG = np.random.default_rng(8)
REFERENCE = RNG.uniform(0, 1, (5, 6, 3))
CLEAR = np.zeros((5, 6), dtype=bool)


def judge(picture, reference, mask, precision, *more, low=0.0, high=0.0, left=(0, 0, 0, 0)):
    """The Verdict beside a reference whose span is so far below and above it in each channel."""
    inside = reference[mask] if reference.shape[:2] == mask.shape else np.zeros((mask.sum(), 3))
    found = Reference("maker", reference, mask, None, np.stack([inside - low, inside + high]), left)
    return judges.judge(picture, found, precision, *more)


def changed(value, place=(2, 3, 1), dtype=np.float64):
    picture = REFERENCE.astype(dtype)
    picture[place] += value
    return picture


def test_the_same_picture():
    found = judge(REFERENCE.copy(), REFERENCE, CLEAR, "float64")
    assert found.wrong is None
    assert (found.max_outside, found.max_inside, found.rmse, found.bad_pixels, found.mask_fraction) == (
        0,
        None,
        0,
        0,
        0,
    )


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_not_finite_comes_first(value):
    masked = ~CLEAR
    for reference in (REFERENCE, REFERENCE[:2]):
        assert judge(changed(value), reference, masked, "float64").wrong == "1 pixels are not finite"


def test_shape():
    for picture in (REFERENCE[:4], REFERENCE[:, :, :2], REFERENCE.transpose(1, 0, 2)):
        assert judge(picture, REFERENCE, CLEAR, "float64").wrong.startswith("its shape is (")


@pytest.mark.parametrize(
    ("precision", "good", "bad"),
    [("float64", 0.9e-9, 1.1e-9), ("float32", 0.99 / 255, 1.01 / 255), ("mp60", 0.9e-9, 1.1e-9)],
)
def test_tolerance(precision, good, bad):
    for sign in (1, -1):
        assert judge(changed(sign * good), REFERENCE, CLEAR, precision).wrong is None
        assert judge(changed(sign * bad), REFERENCE, CLEAR, precision).wrong.startswith("1 pixels off by more than")


def test_mask():
    """A single pixel inside the mask says nothing about a picture; each of its neighbours does."""
    mask = CLEAR.copy()
    mask[2, 3] = True
    found = judge(changed(0.25), REFERENCE, mask, "float64")
    assert found.wrong is None
    assert (found.max_outside, found.max_inside) == pytest.approx((0, 0.25))
    assert (found.bad_pixels, found.mask_fraction) == pytest.approx((1 / 30, 1 / 30))
    assert judge(changed(0.25, (2, 4, 1)), REFERENCE, mask, "float64").wrong


def test_all_masked():
    found = judge(changed(0.25), REFERENCE, ~CLEAR, "float64")
    assert found.wrong is None and found.max_outside is None


@pytest.mark.parametrize(("value", "wrong"), [(0.3, True), (-0.3, True), (0.15, False), (-0.075, False)])
def test_inside_the_mask_all_pixels_together_are_judged(value, wrong):
    """Spans reach 0.1 above the reference and 0.05 below it, and grow by half of 0.15, and by the tolerance."""
    found = judge(REFERENCE + value, REFERENCE, ~CLEAR, "float64", low=0.05, high=0.1)
    assert (found.wrong is not None) == wrong, found.wrong
    if wrong:
        worst = abs(value) - (0.175 if value > 0 else 0.125) - 0.1 / 255
        assert found.wrong == (
            "30 of 30 pixels inside the mask are further off than moves of the sample by some float32 steps bring "
            f"them, the worst by {worst:.3g}; in a right picture at most 12 are"
        )


def test_a_cut_off_is_allowed_its_bound_inside_the_mask_too():
    far = np.full(CLEAR.shape, 0.31)
    assert judge(REFERENCE - 0.3, REFERENCE, ~CLEAR, "float64", False, far).wrong is None
    assert judge(REFERENCE - 0.3, REFERENCE, ~CLEAR, "float64", False, far - 0.02).wrong


def test_numbers_by_hand():
    picture = REFERENCE.copy()
    picture[0, 0] += (0.3, 0, -0.1)
    picture[1, 1] += (0, 0.003, 0)
    found = judge(picture, REFERENCE, CLEAR, "float64")
    assert found.wrong == "2 pixels off by more than 1e-09 outside the mask, the worst by 0.3"
    assert found.rmse == pytest.approx(np.sqrt((0.09 + 0.01 + 0.003**2) / 90))
    assert found.bad_pixels == pytest.approx(1 / 30)
    assert found.record()["tolerance"] == 1e-9


def test_the_picture_may_be_float32():
    found = judge(REFERENCE.astype(np.float32), REFERENCE, CLEAR, "float32")
    assert found.wrong is None and 0 < found.max_outside < 1e-7


def counts(**changed):
    return {"primary": 10**6, "reflected": 5000, "transmitted": 0, "shadow": 300, "non_finite": 0, **changed}


@pytest.mark.parametrize(
    ("changes", "precision", "wrong"),
    [
        ({}, "float64", None),
        ({"primary": 10**6 + 100}, "float64", None),
        ({"primary": 10**6 + 101}, "float64", "1000101 primary rays, the reference has 1000000"),
        ({"reflected": 4999}, "float64", "4999 reflected rays, the reference has 5000"),
        ({"reflected": 4950}, "float32", None),
        ({"reflected": 4949}, "float32", "4949 reflected rays, the reference has 5000"),
        ({"transmitted": 1}, "float32", "1 transmitted rays, the reference has 0"),
        ({"shadow": 0}, "float64", "0 shadow rays, the reference has 300"),
        ({"non_finite": 7}, "float64", None),
    ],
)
def test_rays(changes, precision, wrong):
    assert compare_rays(counts(**changes), counts(), precision) == wrong


def test_rays_that_are_not_told_are_not_compared():
    assert compare_rays(None, counts(), "float64") is None
    assert compare_rays(counts(), None, "float64") is None


def test_relative_mse_by_hand():
    """0.1 off where the reference is 0, and where it is 1: 0.01 / 0.01 and 0.01 / 1.01, of 90 channels."""
    reference = np.zeros((5, 6, 3))
    reference[1, 1, 0] = 1.0
    picture = reference.copy()
    picture[0, 0, 2] += 0.1
    picture[1, 1, 0] -= 0.1
    found = judge(picture, reference, CLEAR, "float64")
    assert found.relative_mse == pytest.approx((1 + 0.01 / 1.01) / 90)


def test_errors_by_hand():
    truth = np.zeros((1, 4, 3))
    picture = truth.copy()
    picture[0, 0, 1], picture[0, 1] = 0.3, 1 / 300
    found = errors(picture, truth, None, None)
    assert found["rmse"] == pytest.approx(np.sqrt((0.09 + 3 / 90000) / 12)) and found["rmse_standard_error"] == 0
    assert found["max"] == pytest.approx(0.3) and found["bad_pixels"] == 0.25 and found["mask_fraction"] is None
    assert found["relative_mse"] == pytest.approx((0.09 + 3 / 90000) / 12 / 0.01)
    assert errors(picture, truth, None, np.array([[True, False, False, False]]))["mask_fraction"] == 0.25


def test_the_noise_of_the_truth_is_taken_off():
    """Of many noisy truths the mean square is that of the right one, and it scatters as its standard error says."""
    seed = np.random.SeedSequence().entropy % 2**32
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    right = rng.uniform(0, 1, (20, 30, 3))
    picture = right + rng.normal(0, 0.01, right.shape)
    wanted = np.sqrt(np.mean((picture - right) ** 2))
    noise, told = rng.uniform(0.01, 0.04, right.shape), []
    for _ in range(200):
        pictures = right + 2 * noise * rng.normal(size=(4, *right.shape))
        told.append(errors(picture, pictures.mean(axis=0), pictures.std(axis=0, ddof=1) / 2, None))
    squares = np.array([one["rmse"] ** 2 for one in told])
    spread = squares.std(ddof=1)
    assert abs(squares.mean() - wanted**2) < 4.5 * spread / np.sqrt(200)
    assert np.mean(noise**2) > 2 * wanted**2  # what would be added were it not taken off
    said = np.mean([2 * one["rmse"] * one["rmse_standard_error"] for one in told if one["rmse"]])
    assert 0.8 < said / spread < 1.25


def test_where_noise_hides_an_error_it_is_told_so():
    """A right picture beside a noisy truth: an error of 0 or little, and a standard error that is no smaller."""
    rng = np.random.default_rng(62)
    print("seed 62")
    right = rng.uniform(0, 1, (16, 16, 3))
    for _ in range(20):
        pictures = right + 0.05 * rng.normal(size=(4, *right.shape))
        found = errors(right, pictures.mean(axis=0), pictures.std(axis=0, ddof=1) / 2, None)
        assert found["rmse"] < 3.5 * found["rmse_standard_error"] + 1e-12
