"""Writes numbers for people: how many digits a number has, and a share in per cent."""

import math

from harness.statistics.statistics import Estimate


def plain(value: float, digits: int = 3) -> str:
    """Returns `digits` significant digits, without an exponent from 0.001 up to a million."""
    value = float(f"{value:.{digits}g}")  # 9.999 has one digit more once it is rounded
    if value == 0 or not 1e-3 <= abs(value) < 1e6:
        return f"{value:.{digits}g}"
    return _fixed(value, digits - 1 - math.floor(math.log10(abs(value))))


def percentage(share: float) -> str:
    """Returns a share in per cent to two digits: "0.31 %", "2.0 %", "110 %"."""
    return f"{plain(100 * share, 2)} %"


def change(ratio: float) -> str:
    """Returns a ratio as a change in per cent: "+4.8 %", "-12 %"."""
    return f"{'+' * (ratio >= 1)}{percentage(ratio - 1)}"


def interval(value: float, low: float, high: float) -> str:
    """Returns `value [low, high]` to one common digit: 2.13 [2.08, 2.20]e-6, 149 [147, 152], 0.0365 [0.0360, 0.0370].

    The last digit is where the nearer end differs from the value, but at most a thousandth of the value.
    """
    if low == high:
        return f"{plain(value)}, all equal"
    size = math.floor(math.log10(max(abs(value), abs(low), abs(high))))
    shift = 0 if -3 <= size < 6 else size
    value, low, high = (number / 10**shift for number in (value, low, high))
    near = min((side for side in (value - low, high - value) if side > 0), default=high - low)
    places = _places(max(near, abs(value) / 1000))
    value, low, high = (_fixed(number, places) for number in (value, low, high))
    return f"{value} [{low}, {high}]" + (f"e{shift}" if shift else "")


def earned(value: Estimate) -> str:
    """Returns a value alone, with the digits that its interval earns: "1.048" of [1.03, 1.06], "67" of [66, 75].

    The last digit is where the farther end differs from the value; there are two at least and four at most. A value
    without an interval has two, and so has one whose processes are all equal, which say nothing of its scatter.
    """
    if value.value == 0 or value.low in (None, value.high):
        return plain(value.value, 2)
    far = max(value.high - value.value, value.value - value.low, abs(value.value) / 1000)
    return plain(value.value, min(4, max(2, 1 + _places(far) + math.floor(math.log10(abs(value.value))))))


def _places(half: float) -> int:
    """Returns the decimals that show one digit of `half`, two if the first is a 1; negative left of the point."""
    size = math.floor(math.log10(half))
    return -size + (half / 10**size < 1.95)


def _fixed(value: float, places: int) -> str:
    return f"{round(value, places):.{max(0, places)}f}"
