"""Speed against accuracy: the methods of a view as points of error and time, and their Pareto front."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from harness.statistics.statistics import RESAMPLES, Estimate
from reports.run import method, ranking
from reports.run.cell import Cell, Missing
from reports.run.method import Curve, Names
from reports.run.results import Results
from reports.run.view import View

VISIBLE = 1 / 255  # a step of an 8-bit picture
BUDGETS = (1e-1, 1 / 32, VISIBLE, 1e-3, 1e-4, 1e-6, 1e-9)
ALIKE = 1e-9  # float64 pictures of two renderers may differ by so much (the judge's tolerance): none is the nearer
MOST_RIVALS = 4  # that are named
DRAWS = {"samples": 2, "feelers": 1, "glossy_rays": 1}  # dials whose value to this power counts random draws
FLAT = 1 / 4  # a slope of error against draws that is no convergence: theory has 1/2 at least


@dataclass(frozen=True, eq=False)
class Point:
    """A cell with an error and a time. error: RMSE over all pixels against the truth, linear RGB, of the worst picture.

    time: of a steady frame, s. share: of the resamples of processes, in which it is on the front. number: its place on
    the front of the medians, the fastest first; None beside it. unbiased: is its error noise alone?
    """

    cell: Cell
    name: str
    error: float
    time: Estimate
    share: float
    number: int | None
    unbiased: bool

    @property
    def efficiency(self) -> float | Missing:
        """1 / (mean square error x time), 1/s."""
        if not self.unbiased:
            return Missing("biased: more of the same does not average the error away")
        return Missing("no error was seen") if self.error == 0 else 1 / (self.error**2 * self.time.value)


@dataclass(frozen=True, eq=False)
class Chart:
    """A view with its points, in the order of the run, and what of it has no point, with the reason.

    resolution: the truth is no better known, so errors below it are not told apart, RMSE. sampled: is the truth a mean
    of random pictures, which has a standard error? It is the resolution then.
    """

    view: View
    names: Names
    points: list[Point]
    lacking: list[tuple[Cell, str]]
    curves: list[Curve]
    resolution: float
    sampled: bool

    @property
    def front(self) -> list[Point]:
        return sorted((point for point in self.points if point.number), key=lambda point: point.number)

    def cheapest(self, results: Results, budget: float) -> tuple[Point, list[Point]] | Missing:
        """The fastest point with an error of `budget` at most, and those next to it that are not resolved from it."""
        if budget < self.resolution:
            return Missing(f"the truth is known to {self.resolution:.2g} only")
        able = sorted((p for p in self.points if p.error <= budget), key=lambda point: point.time.value)
        if not able:
            return Missing("no method is so near to the truth")
        first, rivals = able[0], []
        for other in able[1:]:
            if len(rivals) == MOST_RIVALS or ranking.resolved(results, ranking.ratio(other.cell, first.cell)):
                break
            rivals.append(other)
        return first, rivals


def front(times: np.ndarray, errors: np.ndarray) -> np.ndarray:
    """Which points nobody beats: bool of shape (resamples, points).

    times: s, (resamples, points). errors: (points,). A point is beaten by one that is nowhere worse and somewhere
    better; of points that are equal in both, each stays.
    """
    order = np.argsort(errors, kind="stable")
    ranked = np.asarray(times, dtype=float)[:, order]
    starts = np.flatnonzero(np.diff(errors[order], prepend=-np.inf) > 0)
    group = np.repeat(np.arange(len(starts)), np.diff(starts, append=len(order)))
    best = np.minimum.reduceat(ranked, starts, axis=1)  # of the points of one error
    before = np.minimum.accumulate(best, axis=1)
    before = np.column_stack([np.full(len(ranked), np.inf), before[:, :-1]])  # of the points of a smaller error
    found = np.empty(ranked.shape, dtype=bool)
    found[:, order] = (ranked == best[:, group]) & (ranked < before[:, group])
    return found


def alike(errors: np.ndarray) -> np.ndarray:
    """Errors, (points,), of which those that differ by no more than float64 renderers may are made equal."""
    order = np.argsort(errors)
    ranked = errors[order]
    first = np.flatnonzero(np.diff(ranked, prepend=-np.inf) > ALIKE)
    found = np.empty_like(ranked)
    found[order] = np.repeat(ranked[first], np.diff(first, append=len(ranked)))
    return found


def shares(times: list[list[float]], errors: np.ndarray, seed: int = 1) -> np.ndarray:
    """For each point, the share of the resamples of processes in which it is on the front, (points,).

    times: s, of the processes of each point. What is on the front is decided by the median over its processes; the
    error is the same in all of them.
    """
    fastest, slowest = (np.array([end(values) for values in times]) for end in (min, max))
    beaten = (errors[:, None] <= errors) & (slowest[:, None] < fastest)  # row by column, however they are drawn
    possible = np.flatnonzero(~beaten.any(axis=0))
    rng = np.random.default_rng(seed)
    medians = np.empty((RESAMPLES, len(times)))
    counts = np.array([len(times[point]) for point in possible])
    for count in np.unique(counts):
        mine = possible[counts == count]
        values = np.sort([times[point] for point in mine], axis=1)
        # Ranks are drawn in place of values, which makes the medians quick.
        drawn = rng.integers(count, size=(RESAMPLES, len(mine), count), dtype=np.uint16)
        drawn.sort(axis=-1)
        ends = (values[np.arange(len(mine)), drawn[..., rank]] for rank in ((count - 1) // 2, count // 2))
        medians[:, mine] = sum(ends) / 2
    found = np.zeros(len(times))
    found[possible] = front(medians[:, possible], errors[possible]).mean(axis=0)
    return found


@lru_cache(maxsize=1)  # a report asks for it in several places
def charts(results: Results) -> list[Chart]:
    """Every view in which two methods at least were tried, of a run that knows errors; [] if it does not."""
    if not any(record.get("error") for record in results.records):
        return []
    views = [seen for seen in method.views(results) if len({repr(_compared(cell)) for cell in seen.cells}) > 1]
    return [_chart(results, seen) for seen in views]


def _compared(cell: Cell) -> dict:
    return {key: value for key, value in method.of(cell).items() if key != "threads"}


def _chart(results: Results, seen: View) -> Chart:
    names, errors, lacking = Names(seen.cells, method.truth_depth(results)), {}, []
    for cell in seen.cells:
        error = known_error(cell)
        if cell.unranked or isinstance(error, Missing):
            lacking.append((cell, cell.unranked or str(error)))
        else:
            errors[cell] = error
    known = [max(cell.known("standard_error", cell.timed).values(), default=0.0) for cell in errors]
    sampled = max(known, default=0.0) > 0
    resolution = max([ALIKE, *known])
    points = _points(results, seen, names, errors, resolution) if errors else []
    apart = [cell for scene in {cell.scene for cell in seen.cells} for cell in results.of(scene) if cell.apart]
    places = {cell.place for cell in seen.cells}
    lacking += [(cell, cell.apart) for cell in apart if cell.place in places and not cell.exhibit]
    curves = method.curves(list(errors), names)
    return Chart(seen, names, points, lacking, curves, resolution, sampled)


def known_error(cell: Cell) -> float | Missing:
    """The largest RMSE against the truth over its repetitions, or why there is none."""
    found = cell.known("error_rmse", cell.timed)
    if found:
        return float(max(found.values()))
    reasons = cell.known("no_error", cell.timed).values()
    return Missing(next(iter(reasons), "its error against the truth is not told"))


def _points(results: Results, seen: View, names: Names, errors: dict, resolution: float) -> list[Point]:
    told = alike(np.maximum(list(errors.values()), resolution))
    share = shares([cell.values("steady_s") for cell in errors], told)
    medians = np.array([cell.steady.value for cell in errors])
    on_front = front(medians[None], told)[0]
    order = [row for row in np.argsort(medians, kind="stable") if on_front[row]]
    numbers = {row: number for number, row in enumerate(order, 1)}
    return [
        Point(
            cell, names.full(cell), error, cell.steady, float(share[row]), numbers.get(row),
            method.unbiased(results, cell),
        )
        for row, (cell, error) in enumerate(errors.items())
    ]  # fmt: skip


def bias_floor(chart: Chart, curve: Curve) -> float | None:
    """The smallest error of a biased curve that more draws no longer bring down; None if it still falls, or is noise.

    Flat is a curve whose last step falls by less than draws^-1/4, far from what the truth is known to.
    """
    points = {point.cell: point for point in chart.points}
    mine = [points[cell] for cell in curve.cells]
    if curve.dial not in DRAWS or len(mine) < 3 or any(point.unbiased for point in mine):
        return None
    (before, last), least = mine[-2:], min(point.error for point in mine)
    if least < 3 * chart.resolution:
        return None
    more, fewer = (max(point.cell.parameters[curve.dial], 1) for point in (last, before))
    steps = DRAWS[curve.dial] * np.log(more / fewer)
    return least if steps > 0 and np.log(before.error / last.error) < FLAT * steps else None


def never_pays(charts: list[Chart]) -> tuple[list[str], list[str]]:
    """Variants, whatever their method, and methods, whoever renders, that are on no front in any resample."""
    variants: dict[str, float] = {}
    methods: dict[str, float] = {}
    for chart in charts:
        for point in chart.points:
            by_method = chart.names.method(point.cell) or method.PLAIN
            for best, name in ((variants, point.cell.variant), (methods, by_method)):
                best[name] = max(best.get(name, 0.0), point.share)
    return tuple([name for name, share in best.items() if share == 0] for best in (variants, methods))
