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


def test_the_largest_error_is_of_both_sides_of_the_mask():
    assert record.largest({"max_outside": 0.0, "max_inside": 2.0}) == 2
    assert record.largest({"max_outside": 1.0, "max_inside": None}) == 1
    assert record.largest({"max_outside": None}) is None
