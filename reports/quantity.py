"""How a number is written for people: as many digits as its interval warrants, and a reason where there is none."""

import math

from harness.statistics import Estimate
from reports.results import Missing

NO_INTERVAL = "(no interval, n = {})"  # n processes are too few


def text(value: Estimate | Missing | float | str, scale: float = 1.0) -> str:
    """A value times `scale`: mean ± half-width of its 95 % interval, or why it has no interval, or why it is absent."""
    if isinstance(value, str):
        return value
    if isinstance(value, Missing):
        return str(value)
    if not isinstance(value, Estimate):
        return f"{value * scale:.3g}"
    if value.low is None:
        return f"{plain(value.value * scale)} {NO_INTERVAL.format(value.processes)}"
    return plus_minus(value.value * scale, (value.high - value.low) / 2 * scale)


def plain(value: float) -> str:
    """Three significant digits, without an exponent from 0.001 up to a million."""
    if value == 0 or not 1e-3 <= abs(value) < 1e6:
        return f"{value:.3g}"
    return _fixed(value, 2 - math.floor(math.log10(abs(value))))


def plus_minus(value: float, half: float) -> str:
    """`value ± half`, both to the same digit: (2.13 ± 0.05)e-6, 149 ± 2, 0.0365 ± 0.0005."""
    if not half > 0:
        return f"{plain(value)} ± 0, all equal"
    size = math.floor(math.log10(max(abs(value), half)))
    shift = 0 if -3 <= size < 6 else size
    value, half = value / 10**shift, half / 10**shift
    places = _places(half)
    pair = f"{_fixed(value, places)} ± {_fixed(half, places)}"
    return f"({pair})e{shift}" if shift else pair


def ratio(value: Estimate) -> str:
    """`value [low, high]`, with "not resolved" if the interval holds 1."""
    if value.low is None:
        return f"{plain(value.value)} {NO_INTERVAL.format(value.processes)}"
    places = 1 + _places((value.high - value.low) / 2) if value.high > value.low else 3
    low, middle, high = (_fixed(number, places) for number in (value.low, value.value, value.high))
    return f"{middle} [{low}, {high}]{'' if resolved(value) else ' not resolved'}"


def resolved(value: Estimate) -> bool:
    """Is the ratio surely not 1? Without an interval nothing is sure."""
    return value.low is not None and not value.low <= 1 <= value.high


def _places(half: float) -> int:
    """Decimals that show one digit of `half`, two if the first is a 1; negative left of the point."""
    size = math.floor(math.log10(half))
    return -size + (half / 10**size < 1.95)


def _fixed(value: float, places: int) -> str:
    return f"{round(value, places):.{max(0, places)}f}"
