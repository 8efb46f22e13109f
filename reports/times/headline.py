"""Finds what a reader of a run wants to know first: who was raced, who won, by how much, what is not resolved."""

import json
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from harness.statistics import statistics
from harness.statistics.statistics import Estimate
from reports.accuracy import pareto
from reports.accuracy.pareto import BUDGETS, VISIBLE, Chart
from reports.run import launch, method, naming, ranking, reduced
from reports.run.cell import Cell, Missing
from reports.run.method import Names
from reports.run.results import Results, grouped
from reports.stability import stability
from reports.times import sentence

if TYPE_CHECKING:
    from reports.times.startup_figure import Start

EACH_ITS_OWN = (*launch.UNSEEN, "threads", "frames", "least_frame")  # parameters in which variants of one method differ
STEADY, FIRST, START = "steady frame", "first frame", "to the first frame"  # what the times of bars are of
APART = 2  # times the smallest error: methods whose errors differ by less do not trade speed for accuracy
FEW = 3  # places, of which a mean says something


@dataclass(frozen=True, eq=False)
class Bar:
    """A contestant: a variant with one method, at one place or over several.

    cell: one of its cells, for its error and agreement. words: the parts of its method's name that not all have.
    rounds: its times by round, s. time: their median. ratio: its time over that of the fastest that the first sentence
    compares; None for that one. resolved: is that ratio? compared: that sentence compares it, as one of those that use
    the same method.
    """

    cell: Cell
    words: tuple[str, ...]
    rounds: dict[int, float]
    time: Estimate
    ratio: Estimate | None = None
    resolved: bool = False
    compared: bool = True

    @property
    def name(self) -> str:
        """Its name beside others: "cpp, lanes, float32"."""
        return ", ".join([self.cell.label, *self.words])

    @property
    def spoken(self) -> str:
        """Its name in a sentence: "cpp (lanes, float32)"."""
        return f"{self.cell.label} ({', '.join(self.words)})" if self.words else self.cell.label


@dataclass(frozen=True)
class Headline:
    """The result of a run at a glance.

    sentences: plain text; the first says who won. bars: of one task, the fastest first; [] where nothing has a time.
    where: their place in words. clock: what their times are of. shared: parts of the names of methods that all bars
    have. lacking: (variant, reason) of variants without a bar. within: its question is who is the fastest within an
    error.
    """

    sentences: list[str]
    bars: list[Bar]
    where: str
    clock: str
    shared: list[str]
    lacking: list[tuple[str, str]]
    within: bool = False

    @property
    def sentence(self) -> str:
        return " ".join(self.sentences)


def of(results: Results) -> Headline:
    """Returns the headline of a run."""
    if results.facts.get("stability"):
        return _stress(results)
    ranked = [cell for cell in results.cells if not cell.unranked]
    if ranked:
        return _race(results, _task(ranked), ranked)
    return _starts(results) or _first_frames(results) or _nothing(results)


def _race(results: Results, cells: list[Cell], ranked: list[Cell]) -> Headline:
    """Returns the headline of a task, the cells of which are all ranked."""
    budget = _budget(results, cells)
    if budget is not None:
        return budget
    names, comparable = Names(cells, silent=("threads",)), _of_one_method(cells)  # labels have the threads
    words, shared = naming.varying(names, cells)
    bars = _with_ratios(results, [_bar(cell, words, cell in comparable) for cell in cells])
    own, alike = naming.varying(names, comparable)
    compared = _with_ratios(results, _fastest_by_variant([_bar(cell, own) for cell in comparable]))
    sentences = [sentence.of_bars(compared, results.floor.value)]
    if more := [word for word in alike if word not in shared]:
        sentences = [f"With {', '.join(more)}: {sentences[0]}"]
    sentences += [_fastest_of_all(results, bars, compared), _others_at_their_best(bars), *_more_threads(results, bars)]
    sentences.append(_over_places(compared, ranked, results.floor.value))
    where = naming.place(cells[0], results.of(cells[0].scene))
    return Headline([text for text in sentences if text], bars, where, STEADY, shared, _lacking(results, bars))


def _bar(cell: Cell, words: dict[Cell, tuple[str, ...]], compared: bool = True) -> Bar:
    return Bar(cell, words[cell], cell.rounds("steady_s"), cell.steady, compared=compared)


def _task(cells: list[Cell]) -> list[Cell]:
    """Returns the cells of the task with the most variants, of these with the most methods, of these the slowest.

    Of whole scenes, if there are any.
    """
    cells = [cell for cell in cells if not reduced.without(cell)] or cells
    tasks = grouped(cells, lambda cell: (cell.scene, launch.counts(cell), launch.rest(cell, naming.METHOD))).values()

    def worth(task: list[Cell]) -> tuple:
        return len({cell.variant for cell in task}), len(task), min(cell.steady.value for cell in task)

    return max(tasks, key=worth)


def _of_one_method(cells: list[Cell]) -> list[Cell]:
    """Returns the cells with the method that the most variants have, of several the one with the shortest name.

    All cells of a single variant, whose methods are compared.
    """
    if len({cell.variant for cell in cells}) == 1:
        return cells
    free = [name for name in naming.METHOD if name not in EACH_ITS_OWN]
    groups = grouped(cells, lambda cell: json.dumps([str(cell.parameters.get(name)) for name in free])).values()
    names = Names(cells)

    def worth(group: list[Cell]) -> tuple:
        return len({cell.variant for cell in group}), -min(len(names.words(cell)) for cell in group)

    return max(groups, key=worth)


def _with_ratios(results: Results, bars: list[Bar]) -> list[Bar]:
    """Returns bars, the fastest first, each with its ratio to the first that is compared."""
    ordered = sorted(bars, key=lambda bar: bar.time.value)
    base = next((bar for bar in ordered if bar.compared), ordered[0])
    ratios = [None if bar is base else ranking.ratio_of_rounds(bar.rounds, base.rounds) for bar in ordered]
    return [
        replace(bar, ratio=ratio, resolved=ratio is not None and ranking.resolved(results, ratio))
        for bar, ratio in zip(ordered, ratios, strict=True)
    ]


def _fastest_by_variant(bars: list[Bar]) -> list[Bar]:
    """Returns the fastest bar of each variant; all bars of a single variant."""
    groups = grouped(bars, lambda bar: bar.cell.variant).values()
    return bars if len(groups) == 1 else [min(group, key=lambda bar: bar.time.value) for group in groups]


def _fastest_of_all(results: Results, bars: list[Bar], compared: list[Bar]) -> str:
    """Says who is the fastest where other methods are faster than those that the sentence compares."""
    best = bars[0]
    if best.compared:
        return ""
    other = next((bar for bar in compared if bar.cell.variant == best.cell.variant), compared[0])
    ratio = ranking.ratio_of_rounds(other.rounds, best.rounds)
    if not ranking.resolved(results, ratio):
        return ""
    same = next(bar for bar in bars if bar.cell is other.cell)  # with all parts of its name
    others = [bar for bar in bars[1:] if bar is not same]
    alike = [bar for bar in others if not ranking.resolved(results, ranking.ratio_of_rounds(bar.rounds, best.rounds))]
    return sentence.of_best(best, ratio, same, alike)


def _others_at_their_best(bars: list[Bar]) -> str:
    """Says how far behind others are with their fastest methods, where the first sentence compares slower ones of them.

    "" if the fastest of all has a method that it does not compare: then that is said.
    """
    faster = [bar for bar in _fastest_by_variant(bars) if not bar.compared]
    return sentence.of_others(faster) if faster and bars[0].compared else ""


def _more_threads(results: Results, bars: list[Bar]) -> list[str]:
    """Says for each variant what the most threads gain over the fewest, of those that the first sentence compares."""
    sentences = []
    for group in grouped([bar for bar in bars if bar.compared], lambda bar: bar.cell.variant).values():
        few, most = (end(group, key=lambda bar: bar.cell.parameters.get("threads", 1)) for end in (min, max))
        if "threads" in most.cell.swept and most.cell.parameters["threads"] > few.cell.parameters["threads"]:
            ratio = ranking.ratio_of_rounds(few.rounds, most.rounds)
            sentences.append(sentence.of_threads(most.cell, few.cell, ratio, ranking.resolved(results, ratio)))
    return sentences


def _over_places(compared: list[Bar], ranked: list[Cell], floor: float | None) -> str:
    """Says the geometric means over places of the ratios to the fastest; "" if fewer than FEW have all of them."""
    names = [name for name in naming.METHOD if name not in ("frames", "least_frame")]

    def key(cell: Cell) -> tuple:
        return cell.variant, json.dumps([str(cell.parameters.get(name)) for name in names])

    bars = {key(bar.cell): bar for bar in compared}
    tasks = grouped(
        (cell for cell in ranked if key(cell) in bars),
        lambda cell: (cell.scene, launch.counts(cell), launch.rest(cell, naming.METHOD)),
    )
    whole = [{key(cell): cell for cell in cells} for cells in tasks.values() if len(cells) == len(compared)]
    if len(compared) < 2 or len(whole) < FEW:
        return ""
    first, *others = bars
    pairs = {other: [(place[other], place[first]) for place in whole] for other in others}
    means = [(bars[other].spoken, ranking.mean_ratio(pairs[other])) for other in others]
    return sentence.of_means(bars[first].spoken, means, len(whole), floor)


def _lacking(results: Results, bars: list[Bar]) -> list[tuple[str, str]]:
    """Returns the variants without a bar, each with the reason."""
    there = {bar.cell.variant for bar in bars}
    reasons = {}
    for cell in results.cells:
        if cell.variant not in there and not cell.as_meant:
            reasons.setdefault(cell.variant, cell.unranked or "took part in other pictures")
    return list(reasons.items())


# --- Methods that trade speed for accuracy ---


def _budget(results: Results, cells: list[Cell]) -> Headline | None:
    """Returns the fastest of each variant within the smallest error of 1/255, 1/32 and 1/10 that a method keeps.

    None if no dial varies in the task, or if the errors do not differ.
    """
    turned = Names(cells).turned & set(method.DIALS)
    errors = [cell.error() for cell in cells]
    if not turned or any(isinstance(error, Missing) for error in errors):
        return None
    charts = [chart for chart in pareto.charts(results) if chart.points]
    own_chart = next((chart for chart in charts if any(point.cell is cells[0] for point in chart.points)), None)
    if own_chart is None or max(errors) <= APART * max(min(errors), own_chart.resolution):
        return None
    budgets = [budget for budget in sorted(BUDGETS) if budget >= VISIBLE]
    budget = next((limit for limit in budgets if not isinstance(own_chart.cheapest(results, limit), Missing)), None)
    if budget is None:
        return None
    able = [point for point in own_chart.points if point.error <= budget]
    groups = grouped(able, lambda point: point.cell.variant).values()
    best = [min(group, key=lambda point: point.time.value).cell for group in groups]
    words, shared = naming.varying(own_chart.names, best)
    bars = _with_ratios(results, [_bar(cell, words) for cell in best])
    others = [(chart.view.title, _cheapest(results, chart, budget)) for chart in charts if chart is not own_chart]
    sentences = sentence.of_budget(budget, bars, shared, results.floor.value, others)
    lacking = [
        (name, why if why != "" else sentence.too_far(budget, _nearest(own_chart, name)))
        for name, why in _lacking_of(results, bars)
    ]
    return Headline(sentences, bars, own_chart.view.title, STEADY, shared, lacking, within=True)


def _cheapest(results: Results, chart: Chart, budget: float) -> tuple[str, float] | None:
    """Returns name and time of the fastest point within an error; None if there is none."""
    cheapest = chart.cheapest(results, budget)
    return None if isinstance(cheapest, Missing) else (cheapest[0].name, cheapest[0].time.value)


def _nearest(chart: Chart, variant: str) -> float | None:
    return min((point.error for point in chart.points if point.cell.variant == variant), default=None)


def _lacking_of(results: Results, bars: list[Bar]) -> list[tuple[str, str]]:
    """Returns the variants without a bar: the reason why one is not ranked, "" for one that is."""
    ranked = {cell.variant for cell in results.cells if not cell.unranked}
    return [(name, "" if name in ranked else why) for name, why in _lacking(results, bars)]


# --- Runs without a steady frame ---


def _starts(results: Results) -> Headline | None:
    """Returns the time from the start of a process to the end of its first frame; None without a cold pass."""
    from reports.times import startup_figure  # which draws: the terminal needs no matplotlib for other runs

    by_place = startup_figure.starts_by_place(results)
    place = next((place for place, starts in by_place.items() if starts), None)
    if place is None:
        return None
    cells = {cell.variant: cell for cell in results.at(place)}
    entries = [
        _start(cells[start.variant], start) for start in by_place[place] if start.state == "warm" or start.compiles
    ]
    bars = _with_ratios(results, entries)
    warm = [replace(bar, words=()) for bar in entries if bar.compared]
    cold = [bar for bar in bars if not bar.compared]
    sentences = sentence.of_starts(_with_ratios(results, warm) if warm else [], cold, results.floor.value)
    return Headline(
        sentences, bars, naming.place(bars[0].cell, results.of(place[0])), START, [], _lacking(results, bars)
    )


def _start(cell: Cell, start: "Start") -> Bar:
    """Returns the bar of processes with one state of the cache; the cold one of a program contains its build."""
    rounds = {number: seconds + (start.build or 0.0) for number, seconds in start.rounds.items()}
    state = f"{start.state}, with its build" if start.build else start.state
    return Bar(cell, (state,), rounds, statistics.median([*rounds.values()]), compared=start.state == "warm")


def _first_frames(results: Results) -> Headline | None:
    """Returns the sum of the first frames of all places by variant; None if there are none."""
    cells = [cell for cell in results.cells if cell.status == "ok" and not cell.apart and cell.values("first_s")]
    by_variant = grouped(cells, lambda cell: cell.variant)
    if not by_variant:
        return None
    places = [
        place for place in results.places if all(any(c.place == place for c in group) for group in by_variant.values())
    ]
    if not places:
        return None
    entries = []
    for group in by_variant.values():
        rounds = [cell.rounds("first_s") for cell in group if cell.place in places]
        both = sorted(set.intersection(*map(set, rounds)))
        if both:
            sums = {number: sum(times[number] for times in rounds) for number in both}
            entries.append(Bar(group[0], (), sums, statistics.median([*sums.values()])))
    if not entries:
        return None
    bars = _with_ratios(results, entries)
    first_place = naming.place(bars[0].cell, results.of(bars[0].cell.scene))
    where = first_place if len(places) == 1 else f"all {len(places)} pictures"
    text = sentence.of_first_frames(bars, len(places), results.floor.value)
    return Headline([text], bars, where, FIRST, [], _lacking(results, bars))


def _nothing(results: Results) -> Headline:
    lacking = _lacking(results, [])
    reasons = list(dict.fromkeys(why for _, why in lacking))
    text = f"Nothing is ranked: {reasons[0]}." if len(reasons) == 1 else "Nothing is ranked."
    return Headline([text], [], "", STEADY, [], lacking)


def _stress(results: Results) -> Headline:
    """Returns the sentence on a run under stress: how many rows break naive methods, and how many robust ones."""
    rows = stability.rows(results)
    counts = {}
    for naive in (True, False):
        answered = [row for row in rows if any(curve.answered and curve.way.naive == naive for curve in row.curves)]
        broken = [row for row in answered if any(curve.broken and curve.way.naive == naive for curve in row.curves)]
        counts[naive] = len(broken), len(answered)
    return Headline([sentence.of_stress(len(rows), counts[True], counts[False])], [], "", "", [], [])
