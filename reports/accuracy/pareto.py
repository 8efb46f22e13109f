"""Compares speed and accuracy: methods of a view as points of error and time, and their Pareto front."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from harness.statistics.statistics import RESAMPLES, Estimate
from reports.run import method, ranking
from reports.run.cell import Cell, Missing
from reports.run.method import Curve, Names
from reports.run.results import Results
from reports.run.stored import STEP as VISIBLE
from reports.run.view import View
from reports.run.words import all_against

BUDGETS = (1e-1, 1 / 32, VISIBLE, 1e-3, 1e-4, 1e-6, 1e-9)
ALIKE = 1e-9  # the judge's tolerance of float64 pictures: errors that differ by less count as equal
MOST_RIVALS = 4  # to name
DRAWS = {"samples": 2, "spp": 1, "feelers": 1, "glossy_rays": 1}  # the power of a dial that counts random draws
DOUBT = 4  # times the uncertainty of the truth: its share of a larger error is a quarter at most
GAIN = 0.9  # times an error: a method with more of it has the same error, for what it is worth
FLAT = 1 / 4  # a smaller slope of error against draws is no convergence: theory has at least 1/2


@dataclass(frozen=True, eq=False)
class Point:
    """A cell with an error and a time.

    error: RMSE, linear RGB, of the worst picture. time: of a steady frame, s.
    share: of resamples of the processes that have it on the front. number: its place on the front of the medians, the
    fastest first; None off the front. unbiased: its error is noise only.
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
        """1 / (mean squared error x time), 1/s."""
        if not self.unbiased:
            return Missing("biased: more samples do not average the error away")
        return Missing("its error is 0") if self.error == 0 else 1 / (self.error**2 * self.time.value)


@dataclass(frozen=True, eq=False)
class Chart:
    """A view with its points in the order of the run, and the cells without a point, each with the reason.

    resolution: RMSE below which the truth cannot tell, so that smaller errors count as equal: DOUBT times its
    uncertainty. sampled: the truth is a mean of random pictures. against: what errors are held against, in words, ""
    for the truth of the scene.
    """

    view: View
    names: Names
    points: list[Point]
    lacking: list[tuple[Cell, str]]
    curves: list[Curve]
    resolution: float
    sampled: bool
    against: str

    @property
    def axis(self) -> str:
        """What the axis of errors shows."""
        return ", ".join(filter(None, ["error: RMSE, linear RGB", self.against]))

    @property
    def trades(self) -> bool:
        """Whether some methods have less error than others, so that speed is traded for it; GAIN tells from what on."""
        errors = [max(point.error, self.resolution) for point in self.points]
        return bool(errors) and min(errors) < GAIN * max(errors)

    @property
    def front(self) -> list[Point]:
        return sorted((point for point in self.points if point.number), key=lambda point: point.number)

    def drawn(self, point: Point) -> float:
        """The error at which a point is drawn: 0 if it is below the uncertainty of the truth."""
        return 0.0 if self.resolution > ALIKE and point.error < self.resolution / DOUBT else point.error

    def cheapest(self, results: Results, budget: float) -> tuple[Point, list[Point]] | Missing:
        """Returns the fastest point with an error of at most `budget`, and the next ones not resolved from it."""
        if budget < self.resolution:
            return Missing(f"below the truth's accuracy, {self.resolution:.2g}")
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
    """Returns which points no other beats: bool, (resamples, points).

    times: s, (resamples, points). errors: (points,). A point beats another if it is nowhere worse and somewhere better;
    points equal in both stay.
    """
    order = np.argsort(errors, kind="stable")
    ranked = np.asarray(times, dtype=float)[:, order]
    starts = np.flatnonzero(np.diff(errors[order], prepend=-np.inf) > 0)
    group = np.repeat(np.arange(len(starts)), np.diff(starts, append=len(order)))
    best = np.minimum.reduceat(ranked, starts, axis=1)  # of the points of one error
    before = np.minimum.accumulate(best, axis=1)
    before = np.column_stack([np.full(len(ranked), np.inf), before[:, :-1]])  # of the points of a smaller error
    unbeaten = np.empty(ranked.shape, dtype=bool)
    unbeaten[:, order] = (ranked == best[:, group]) & (ranked < before[:, group])
    return unbeaten


def alike(errors: np.ndarray) -> np.ndarray:
    """Returns errors, (points,), made equal where they differ by no more than float64 renderers may."""
    order = np.argsort(errors)
    ranked = errors[order]
    first = np.flatnonzero(np.diff(ranked, prepend=-np.inf) > ALIKE)
    values = np.empty_like(ranked)
    values[order] = np.repeat(ranked[first], np.diff(first, append=len(ranked)))
    return values


def shares(times: list[list[float]], errors: np.ndarray, seed: int = 1) -> np.ndarray:
    """Returns for each point the share of resamples of the processes in which it is on the front, (points,).

    times: s, of the processes of each point. The median over processes decides; the error is the same in all of them.
    """
    fastest, slowest = (np.array([end(values) for values in times]) for end in (min, max))
    # Of a pair (row, column), the row beats the column in every resample.
    beaten = (errors[:, None] <= errors) & (slowest[:, None] < fastest)
    possible = np.flatnonzero(~beaten.any(axis=0))
    rng = np.random.default_rng(seed)
    medians = np.empty((RESAMPLES, len(times)))
    counts = np.array([len(times[point]) for point in possible])
    for count in np.unique(counts):
        group = possible[counts == count]
        values = np.sort([times[point] for point in group], axis=1)
        # Drawing ranks instead of values makes the medians fast.
        drawn = rng.integers(count, size=(RESAMPLES, len(group), count), dtype=np.uint16)
        drawn.sort(axis=-1)
        ends = (values[np.arange(len(group)), drawn[..., rank]] for rank in ((count - 1) // 2, count // 2))
        medians[:, group] = sum(ends) / 2
    on_front = np.zeros(len(times))
    on_front[possible] = front(medians[:, possible], errors[possible]).mean(axis=0)
    return on_front


@lru_cache(maxsize=1)  # several sections of a report need them
def charts(results: Results) -> list[Chart]:
    """Returns every view with two methods or more; [] if the run has no errors."""
    if not any(record.get("error") for record in results.records):
        return []
    return [_chart(results, seen) for seen in method.views(results) if len(set(map(_compared, seen.cells))) > 1]


def _compared(cell: Cell) -> str:
    return repr({key: value for key, value in method.of(cell).items() if key != "threads"})


def _chart(results: Results, seen: View) -> Chart:
    names, errors, lacking = Names(seen.cells, method.truth(results).depth), {}, []
    for cell in seen.cells:
        error = cell.error()
        if cell.unranked or isinstance(error, Missing):
            lacking.append((cell, cell.unranked or str(error)))
        else:
            errors[cell] = error
    doubts = [DOUBT * max(cell.by_row("uncertainty", cell.timed).values(), default=0.0) for cell in errors]
    sampled = any(method.sampled(results.record(cell)["error"]) for cell in errors)
    resolution = max([ALIKE, *doubts])
    points = _points(results, seen, names, errors, resolution) if errors else []
    apart = [cell for scene in {cell.scene for cell in seen.cells} for cell in results.of(scene) if cell.apart]
    places = {cell.place for cell in seen.cells}
    lacking += [(cell, cell.apart) for cell in apart if cell.place in places and not cell.exhibit]
    curves = method.curves(list(errors), names)
    against = all_against(cell.against for cell in errors)
    return Chart(seen, names, points, lacking, curves, resolution, sampled, against)


def _points(results: Results, seen: View, names: Names, errors: dict, resolution: float) -> list[Point]:
    compared = alike(np.maximum(list(errors.values()), resolution))
    share = shares([cell.values("steady_s") for cell in errors], compared)
    medians = np.array([cell.steady.value for cell in errors])
    on_front = front(medians[None], compared)[0]
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
    """Returns the smallest error of a biased curve that more draws do not reduce; None if it still falls or is noise.

    A curve is flat if its last step falls by less than draws^-1/4, well above the resolution of the truth.
    """
    points = {point.cell: point for point in chart.points}
    on_curve = [points[cell] for cell in curve.cells]
    if curve.dial not in DRAWS or len(on_curve) < 3 or any(point.unbiased for point in on_curve):
        return None
    (before, last), least = on_curve[-2:], min(point.error for point in on_curve)
    if least < 3 * chart.resolution:
        return None
    more, fewer = (max(point.cell.parameters[curve.dial], 1) for point in (last, before))
    steps = DRAWS[curve.dial] * np.log(more / fewer)
    return least if steps > 0 and np.log(before.error / last.error) < FLAT * steps else None


def never_pays(charts: list[Chart]) -> tuple[list[str], list[str]]:
    """Returns variants, with any method, and methods, in any variant, that are on no front in any resample."""
    variants: dict[str, float] = {}
    methods: dict[str, float] = {}
    for chart in charts:
        for point in chart.points:
            by_method = chart.names.method(point.cell) or method.PLAIN
            for best, name in ((variants, point.cell.variant), (methods, by_method)):
                best[name] = max(best.get(name, 0.0), point.share)
    return tuple([name for name, share in best.items() if share == 0] for best in (variants, methods))
