"""Ends a run when its ratios are known well enough (`until` of [measure]), by a rule whose intervals still hold.

To look after every round and to stop at the first narrow interval would stop too often by luck. So there are few looks,
LOOK_AGAIN times as many rounds apart, and two in a row must find all intervals narrow. In 10,000 simulated runs of
lognormal and of shifted noise the intervals at the end then cover the truth with 94 to 96 % (test_enough.py); with one
look in place of two, they cover it with 93.7 %.
"""

import math
from collections.abc import Callable, Iterable
from pathlib import Path

from harness.plan.plan import Cell, Plan
from harness.statistics import statistics, steady
from harness.statistics.statistics import Estimate

FIRST_LOOK, LOOK_AGAIN = 20, 1.25  # rounds; times as many
BASE = "cpp"  # the variant that ratios are to; where it does not run, the first that does


def looks(most: int) -> list[int]:
    """Numbers of rounds after which it is looked, up to `most`."""
    counts, rounds = [], FIRST_LOOK
    while rounds <= most:
        counts.append(rounds)
        rounds = math.ceil(rounds * LOOK_AGAIN)
    return counts


def rounds(until: float | None, plan: Plan, records: Iterable[dict]) -> int | None:
    """The number of rounds after which every ratio's interval is within `until` of it; None if none is.

    until: relative half-width; None: the run goes on to its end. records: rows; those of rounds that are not whole are
    not looked at. Cells with fewer processes than the others do not count.
    """
    if until is None:
        return None
    times, done = _times(records)
    whole = max(cell.processes for cell in plan.cells)
    times = {cell.key: times[cell.key] for cell in plan.cells if cell.processes == whole and cell.key in times}
    least = min(done.get(cell.key, 0) for cell in plan.cells if cell.processes == whole)
    return end(least, until, lambda count: _estimates(plan, times, count))


def end(most: int, until: float, estimates: Callable[[int], Iterable[Estimate]]) -> int | None:
    """The rule: the number of rounds, of `most`, at which it ends; None if it does not.

    estimates: what is known after so many rounds.
    """
    before = False
    for count in looks(most):
        intervals = list(estimates(count))
        now = bool(intervals) and all(_is_narrow(estimate, until) for estimate in intervals)
        if now and before:
            return count
        before = now
    return None


def _times(records: Iterable[dict]) -> tuple[dict[str, dict[int, float]], dict[str, int]]:
    """By key of a cell: times of a steady frame by round, s, and the number of rounds that it has done."""
    times: dict[str, dict[int, float]] = {}
    done: dict[str, int] = {}
    for record in records:
        if record["pass"] != "timed":
            continue
        key, frames = record["cell"], record["frames_s"] or []
        done[key] = done.get(key, 0) + 1
        seconds = steady.find(frames).seconds
        if record["status"] == "ok" and not record["unranked"] and seconds is not None:
            times.setdefault(key, {})[record["repetition"]] = seconds
    return times, done


def _estimates(plan: Plan, times: dict[str, dict[int, float]], count: int) -> Iterable[Estimate]:
    """The ratios that a report gives: of each cell to the base of its place, and to its other version."""
    other = dict(plan.against)
    for cells in _places(plan, times).values():
        variants = {cell.entry.name: cell for cell in reversed(cells)}
        base = variants.get(BASE, cells[0])
        pairs = [(cell, base) for cell in cells if cell is not base]
        pairs += [(cell, variants[name]) for cell in cells if (name := other.get(cell.entry.name)) in variants]
        for above, below in pairs:
            above_times, below_times = times[above.key], times[below.key]
            both = sorted(number for number in above_times.keys() & below_times.keys() if number < count)
            yield statistics.ratio([above_times[n] for n in both], [below_times[n] for n in both], paired=True)
        if not pairs:
            yield statistics.median([time for number, time in times[base.key].items() if number < count])


def _places(plan: Plan, times: dict[str, dict[int, float]]) -> dict[tuple, list[Cell]]:
    """The cells with times, by scene and swept values but threads, as a report compares them."""
    places: dict[tuple, list[Cell]] = {}
    for cell in plan.cells:
        if cell.key in times:
            point = {key: value for key, value in cell.point.items() if key != "threads"}
            places.setdefault((Path(cell.scene), repr(point)), []).append(cell)
    return places


def _is_narrow(estimate: Estimate, until: float) -> bool:
    return estimate.low is not None and math.sqrt(estimate.high / estimate.low) <= 1 + until
