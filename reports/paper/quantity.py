"""Formats numbers for people: as many digits as the interval justifies, and the reason where a number is missing."""

import math

from harness.statistics import statistics
from harness.statistics.statistics import Estimate
from reports.run.cell import Missing

NO_INTERVAL = "(no interval, n = {})"  # too few processes


def text(value: Estimate | Missing | float | str, scale: float = 1.0) -> str:
    """Returns a value times `scale` as `value [low, high]`, or the reason why it has no interval or is unavailable."""
    if isinstance(value, str):
        return value
    if isinstance(value, Missing):
        return str(value)
    if not isinstance(value, Estimate):
        return f"{value * scale:.3g}"
    if value.low is None:
        return f"{plain(value.value * scale)} {NO_INTERVAL.format(value.processes)}"
    return interval(value.value * scale, value.low * scale, value.high * scale)


def exact(value: Missing | float, scale: float = 1.0) -> str:
    """Returns an error times `scale` as text; "exactly 0" for 0."""
    return "exactly 0" if value == 0 else text(value, scale)


def plain(value: float) -> str:
    """Returns three significant digits, without an exponent from 0.001 up to a million."""
    if value == 0 or not 1e-3 <= abs(value) < 1e6:
        return f"{value:.3g}"
    return _fixed(value, 2 - math.floor(math.log10(abs(value))))


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


def ratio(value: Estimate | str, floor: float | None = None) -> str:
    """Returns `value [low, high]`, with "not resolved" where its distance from 1 may be noise; a text unchanged."""
    if isinstance(value, str):
        return value
    found = statistics.verdict(value, floor)
    return text(value) + (f" {found}" if found == statistics.NOT_RESOLVED and value.low is not None else "")


def _places(half: float) -> int:
    """Returns the decimals that show one digit of `half`, two if the first is a 1; negative left of the point."""
    size = math.floor(math.log10(half))
    return -size + (half / 10**size < 1.95)


def _fixed(value: float, places: int) -> str:
    return f"{round(value, places):.{max(0, places)}f}"
