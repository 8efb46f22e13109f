"""Formats numbers for people: as many digits as the interval justifies, and the reason where a number is missing."""

from harness.statistics import statistics
from harness.statistics.digits import interval, percentage, plain
from harness.statistics.statistics import Estimate
from reports.run.missing import Missing

NO_INTERVAL = "(no interval, n = {})"  # too few processes
SECONDS = ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns"))
RATES = ((1e9, "G/s"), (1e6, "M/s"), (1e3, "k/s"), (1.0, "/s"))
BYTES = ((1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB"), (1.0, "B"))


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


def seconds(value: Estimate | Missing | float | str) -> str:
    """Returns a time in s in the unit that suits it: "299 ns", "67.1 [66.5, 67.9] ms"; a text unchanged."""
    return _in_unit(value, SECONDS)


def size(value: Estimate | Missing | float | str) -> str:
    """Returns a number of bytes in the unit that suits it: "37.6 MB"; a text unchanged."""
    return _in_unit(value, BYTES)


def rate(value: Estimate | Missing | float | str) -> str:
    """Returns a number per second in the unit that suits it: "3.6 [3.2, 3.9] M/s"; a text unchanged."""
    return _in_unit(value, RATES)


def times(value: Estimate | Missing | float | str) -> str:
    """Returns a ratio: "43 ×", "2.06 [1.98, 2.11] ×"; a text unchanged."""
    return _with_unit(value, 1.0, "×")


def percent(share: float) -> str:
    """Returns a share to two digits: "0.31 %"; "none" for 0, "all" for 1."""
    return {0: "none", 1: "all"}.get(share) or percentage(share)


def unit(value: float, units: tuple = SECONDS) -> tuple[float, str]:
    """Returns the size and the name of the unit in which `value` has one to three digits before the point."""
    if value == 0:
        return next(entry for entry in units if entry[0] == 1)
    shown = abs(float(f"{value:.3g}"))
    return next((entry for entry in units if shown >= entry[0]), units[-1])


def exact(value: Missing | float, scale: float = 1.0) -> str:
    """Returns an error times `scale` as text; "exactly 0" for 0."""
    return "exactly 0" if value == 0 else text(value, scale)


def ratio(value: Estimate | str, floor: float | None = None) -> str:
    """Returns `value [low, high]`, with "not resolved" where its distance from 1 may be noise; a text unchanged."""
    if isinstance(value, str):
        return value
    verdict = statistics.verdict(value, floor)
    return text(value) + (f" {verdict}" if verdict == statistics.NOT_RESOLVED and value.low is not None else "")


def _in_unit(value: Estimate | Missing | float | str, units: tuple) -> str:
    if isinstance(value, (str, Missing)):
        return str(value)
    return _with_unit(value, *unit(value.value if isinstance(value, Estimate) else value, units))


def _with_unit(value: Estimate | Missing | float | str, size: float, name: str) -> str:
    if isinstance(value, (str, Missing)):
        return str(value)
    if not isinstance(value, Estimate):
        return f"{plain(value / size)} {name}"
    if value.low is None:
        return f"{plain(value.value / size)} {name} {NO_INTERVAL.format(value.processes)}"
    if value.low == value.high:
        return f"{plain(value.value / size)} {name}, all equal"
    return f"{interval(value.value / size, value.low / size, value.high / size)} {name}"
