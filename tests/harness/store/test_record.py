import pytest

from harness.store import record


@pytest.mark.parametrize(
    ("rmse", "worst", "beyond", "words"),
    [
        (0.5, None, 0.1, "error unavailable"),
        (0.0123, 0.5, 0.25, "RMSE 0.012, largest error 0.5, 25 % of pixels beyond 1/255"),
        (0.0123, 0.5, 0.0, "RMSE 0.012, largest error 0.5, no pixel beyond 1/255"),
        (0.0, 0.0, None, "RMSE 0, largest error 0, share beyond 1/255 unavailable"),
        (None, 0.5, 0.25, "largest error of a distance 0.5, 25 % of rays hit something else"),
        (None, 0.5, 0.0, "largest error of a distance 0.5, no ray hits something else"),
        (None, 0.0, None, "largest error of a distance 0, how many hit something else is unavailable"),
    ],
)
def test_errors_in_words(rmse, worst, beyond, words):
    assert record.errors(rmse, worst, beyond) == words


@pytest.mark.parametrize(
    ("rmse", "doubt", "change", "most"),
    [
        (0.0, 0.0, 0.0, None),  # the truth is exact, and so is the picture
        (0.0, 0.005, None, 0.0098),
        (0.009, 0.005, 0.0, 0.0188),
        (0.01, 0.005, 0.0, None),
        (1e-5, 0.0, 1e-4, 1.1e-4),  # of a truth without noise, as deep as that
        (2e-4, 1e-6, 1e-4, None),
        (None, None, None, None),  # of first hits
    ],
)
def test_an_rmse_that_the_truth_cannot_tell_from_0_is_below_another(rmse, doubt, change, most):
    error = {"rmse": rmse, "rmse_standard_error": doubt, "change": change}
    assert record.below(error) == (most and pytest.approx(most))
    if rmse is not None:
        assert record.rmse_of(error) == (f"below {most:.2g}" if most else f"{rmse:.3g}")
        words = record.error_of(
            {**error, "against": "scene", "depth": 8, "max": 0.00597, "bad_pixels": 1.0, "change": 0.0}
        )
        assert "RMSE 0," not in words or not (doubt or change)


def test_the_largest_error_is_of_both_sides_of_the_mask():
    assert record.largest({"max_outside": 0.0, "max_inside": 2.0}) == 2
    assert record.largest({"max_outside": 1.0, "max_inside": None}) == 1
    assert record.largest({"max_outside": None}) is None
