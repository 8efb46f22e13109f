"""Writes the result of a run in plain words: who is the fastest, by how much, and what is not resolved."""

from __future__ import annotations

from typing import TYPE_CHECKING

from harness.statistics import statistics
from harness.statistics.digits import earned
from harness.statistics.statistics import Estimate
from reports.accuracy import accuracy_columns
from reports.paper import quantity
from reports.run.cell import Cell, Missing

if TYPE_CHECKING:
    from reports.times.headline import Bar

EQUAL = 0.05  # two times are called equal if their interval and the noise floor lie within this of 1
PER_CENT = 1.095  # ratios below are said in per cent
MOST = 6  # others that a sentence names
NAMED = {1 / 255: "1/255", 1 / 32: "1/32"}  # errors


def of_bars(bars: list[Bar], floor: float | None, what: str = "a frame") -> str:
    """Returns sentences on bars, the fastest first: which of them are the fastest, and by how much the others are not.

    floor: the noise floor of the run, None if it has none. what: what their times are of.
    """
    first, others = bars[0], sorted(bars[1:], key=lambda bar: bar.ratio.value)
    time = f"{quantity.seconds(first.time.value)} {what}"
    if not others:
        return f"Only {first.spoken} is ranked: {time}."
    sure = [bar for bar in others if bar.ratio.low is not None]
    rivals = [bar for bar in sure if not bar.resolved]
    if not sure:
        return f"{first.spoken} has the lowest median, {time}; {_more(others)}. {_too_few(bars)}"
    if not rivals:
        return f"{first.spoken} is the fastest, {time}; {_more(others)}."
    best = listed([first.spoken, *(bar.spoken for bar in rivals)])
    rest = _more([bar for bar in others if bar not in rivals])
    return ". ".join(filter(None, [f"{best} {_alike([first, *rivals], floor, what)}", rest])) + "."


def _too_few(bars: list[Bar]) -> str:
    count = min(bar.time.processes for bar in bars)
    each = "One process each resolves" if count == 1 else f"{count} processes each resolve"
    return f"{each} no difference: {statistics.LEAST} are needed."


def _alike(bars: list[Bar], floor: float | None, what: str) -> str:
    """Says that bars are as fast as the first of them: equal where the data show it, else that they tie."""
    ends = [end for bar in bars[1:] for end in (bar.ratio.low, bar.ratio.high)]
    within = max(floor or 0.0, *map(statistics.difference, ends))
    time = quantity.seconds(bars[0].time.value)
    if within <= EQUAL:
        return f"are equally fast{f' (within {_share(within)})' * bool(within)}, {time} {what}"
    return f"tie at {_span([bar.time.value for bar in bars])} {what}; the difference could be up to {_share(within)}"


def _span(times: list[float]) -> str:
    """Returns the least and the largest of times as text: "25.4 to 26.4 ms"."""
    least, most = (quantity.seconds(end(times)) for end in (min, max))
    if least == most:
        return least
    same = least.rpartition(" ")[2] == most.rpartition(" ")[2]
    return f"{least.rpartition(' ')[0] if same else least} to {most}"


def _share(difference: float) -> str:
    """Returns a relative difference as text: "14 %", from 100 % on as a factor."""
    return f"a factor of {quantity.plain(1 + difference, 2)}" if difference >= 1 else quantity.percent(difference)


def _more(bars: list[Bar]) -> str:
    """Says how much longer bars take than the first; "" for none."""
    phrases = [
        f"{bar.spoken}{' takes' * (not n)} {_longer(bar.ratio, first=not n)}" for n, bar in enumerate(bars[:MOST])
    ]
    return listed(phrases + [f"{len(bars) - MOST} more are slower"] * (len(bars) > MOST))


def _longer(ratio: Estimate, first: bool) -> str:
    if ratio.value < PER_CENT:
        return f"{quantity.plain(100 * max(0.0, ratio.value - 1), 2)} % longer"
    return f"{earned(ratio)} times{' as long' * first}"


def of_best(best: Bar, ratio: Estimate, other: Bar, alike: list[Bar]) -> str:
    """Says which of all methods is the fastest. ratio: the time of `other`, which does not use it, over its time.

    alike: bars whose difference from the best is not resolved.
    """
    faster = f"{earned(ratio)} times as fast as {other.spoken}"
    rmse = "" if isinstance(best.cell.error(), Missing) else f", RMSE {accuracy_columns.brief(best.cell)[0]}"
    names = listed([best.spoken, *(bar.spoken for bar in alike)])
    which = f"are {names}, which tie" if alike else f"is {names}"
    return f"The fastest of all {which}: {quantity.seconds(best.time.value)}, {faster}{rmse}."


def of_others(bars: list[Bar]) -> str:
    """Says how much longer variants take than the fastest with their own fastest methods."""
    return f"With {'its' if len(bars) == 1 else 'their'} fastest method{'s' * (len(bars) > 1)}, {_more(bars)}."


def of_threads(most: Cell, few: Cell, ratio: Estimate, resolved: bool) -> str:
    """Says what more threads gain. ratio: the time of the cell with few over that of the one with most."""
    many, fewest = most.parameters["threads"], few.parameters["threads"]
    gain = f"{earned(ratio)} times as fast as with {fewest}" + " (not resolved)" * (not resolved)
    return f"With {many} threads {most.variant} is {gain}."


def of_means(first: str, means: list[tuple[str, Estimate]], places: int, floor: float | None) -> str:
    """Says the geometric means over places of ratios to `first`, each with a name."""
    phrases = [
        f"{name} {earned(mean)} times"
        + f" ({statistics.NOT_RESOLVED})" * (statistics.verdict(mean, floor) == statistics.NOT_RESOLVED)
        for name, mean in means
    ]
    return f"Over {places} configurations, geometric means: {listed(phrases)} the time of {first}."


def of_budget(
    budget: float,
    bars: list[Bar],
    shared: list[str],
    floor: float | None,
    others: list[tuple[str, tuple[str, float] | None]],
) -> list[str]:
    """Says the fastest methods within an error.

    shared: parts of the names of their methods that all have. others: other views, each with the name and time of its
    fastest method, or None.
    """
    within = ", with ".join(filter(None, [f"Within {error(budget)} of the truth (RMSE)", ", ".join(shared)]))
    alone = f"only {bars[0].spoken}, {quantity.seconds(bars[0].time.value)} a frame."
    sentences = [f"{within}: {of_bars(bars, floor) if len(bars) > 1 else alone}"]
    elsewhere = [f"{label}: {best[0]} ({quantity.seconds(best[1])})" for label, best in others if best]
    none = [label for label, best in others if not best]
    if elsewhere:
        sentences.append(f"The fastest elsewhere: {'; '.join(elsewhere)}.")
    if none:
        sentences.append(f"No method is so near to the truth in {listed(none)}.")
    return sentences


def too_far(budget: float, nearest: float | None) -> str:
    """Says why a variant has no method within an error. nearest: its smallest error."""
    so_far = "" if nearest is None else f": its nearest has {quantity.plain(nearest, 2)}"
    return f"no method of it is within {error(budget)}{so_far}"


def error(budget: float) -> str:
    """Returns an error as text: "1/255"."""
    return NAMED.get(budget, f"{budget:g}")


def of_starts(warm: list[Bar], cold: list[Bar], floor: float | None) -> list[str]:
    """Says the times from the start of a process to its first frame, with compiled code of an earlier one and without.

    Both are sorted, the fastest first.
    """
    sentences = [f"To the first frame, warm: {of_bars(warm, floor, 'from the start of the process')}"] if warm else []
    slow = ", ".join(f"{bar.cell.variant} {quantity.seconds(bar.time.value)}" for bar in cold)
    if cold:
        sentences.append(f"From an empty compile cache, the build of a program included: {slow}.")
    return sentences


def of_first_frames(bars: list[Bar], places: int, floor: float | None) -> str:
    """Says the sums over places of the times of first frames, which have no steady ones beside them."""
    what = "for the first frame" if places == 1 else f"for the first frames of all {places} pictures"
    if len(bars) == 1:
        return f"{bars[0].spoken} takes {quantity.seconds(bars[0].time.value)} {what}; nothing has steady ones."
    return of_bars(bars, floor, what)


def of_stress(rows: int, naive: tuple[int, int], robust: tuple[int, int]) -> str:
    """Says in how many rows methods break. naive, robust: rows with a failure, and rows with an answer."""
    phrases = [
        f"{kind} {broken} of {there}"
        for kind, (broken, there) in (("naive methods give wrong answers in", naive), ("robust methods in", robust))
        if there
    ]
    return f"Of {rows} kind{'s' * (rows != 1)} of failure, {listed(phrases)}." if phrases else "No cell has an answer."


def listed(items: list[str]) -> str:
    """Returns "a, b and c"."""
    return " and ".join(filter(None, [", ".join(items[:-1]), *items[-1:]]))
