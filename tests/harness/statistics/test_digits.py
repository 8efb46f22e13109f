"""Digits of numbers for people, against texts written by hand."""

import pytest

from harness.statistics import digits
from harness.statistics.statistics import Estimate


@pytest.mark.parametrize(
    ("value", "low", "high", "text"),
    [
        (1.048, 1.03, 1.06, "1.048"),  # slower for sure, which "1.0" would hide
        (66.8, 65.8, 75.2, "67"),
        (5.312, 4.8, 5.6, "5.3"),
        (109.1, 100.2, 112.4, "109"),
        (0.19504, 0.1755, 0.1966, "0.20"),
        (7.61, 2.4, 16.4, "7.6"),  # two digits at least
        (2.0, 2.0, 2.0, "2.0"),
        (2.34567, 2.34566, 2.34568, "2.346"),  # four at most
        (1.23456, None, None, "1.2"),
        (0.0, -1.0, 1.0, "0"),
    ],
)
def test_a_value_alone_has_the_digits_that_its_interval_earns(value, low, high, text):
    assert digits.earned(Estimate(value, low, high, 9)) == text


@pytest.mark.parametrize(
    ("share", "text"),
    [
        (0.74, "74 %"),
        (1.1, "110 %"),
        (0.0312, "3.1 %"),
        (0.03, "3.0 %"),
        (1.0, "100 %"),
        (0.4, "40 %"),
        (12.34, "1200 %"),
    ],
)
def test_a_share_has_two_digits_and_no_exponent(share, text):
    assert digits.percentage(share) == text


def test_a_change_has_a_sign():
    assert [digits.change(ratio) for ratio in (1.048, 0.88, 2.1)] == ["+4.8 %", "-12 %", "+110 %"]
