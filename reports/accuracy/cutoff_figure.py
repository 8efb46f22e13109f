"""Reports what a contribution cut-off changes, beside its proven bound, and saves: rays, time (CUT-1 to CUT-3)."""

import textwrap
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from harness.statistics.statistics import Estimate
from reports.paper import markdown, quantity, style, table
from reports.run import method, ranking, stored, view
from reports.run.cell import Cell, Missing
from reports.run.results import Results, grouped
from reports.run.stored import STEP
from reports.run.view import View

TITLE = "Cut-off: what it changes, beside its proven bound, and what it saves"
UNIT = {"float32": 2.0**-24}  # u of NUM-2; else that of float64
SLACK = 64  # u: possible rounding of sums of some hundred terms
METHODS = "precision", "epsilon", *method.STEPS
CSV_HEADER = (
    "view", "variant", "method", "cutoff", "largest_change", "largest_bound", "mean_bound", "largest_ratio",
    "pixels_beyond_bound", "beyond_step", "rays_kept", "time_kept", "time_low", "time_high", "note",
)  # fmt: skip
KINDS = "primary", "reflected", "transmitted", "shadow"
CAPTION = (
    "Change: largest absolute difference in any channel of linear RGB from the picture of the same renderer without a "
    "cut-off, all else equal; it is no error, which is held against the truth of the scene. Bound of a pixel: the "
    "weight that was cut there times the largest radiance of a ray (CUT-3); the renderer computes it with the picture "
    f"and needs no other one. Change ÷ bound is the largest over pixels, after {SLACK} u of the pixel's brightest "
    "channel (at least 1) are subtracted from the change for rounding: above 1 in a single pixel, the bound does not "
    "hold. Rays: of all kinds, in % of those without a cut-off. Time: of a steady frame, likewise, with its 95 % "
    "interval where there are enough processes. Variants with equal changes and rays share their marks except those of "
    "time."
)


@dataclass(frozen=True)
class Point:
    """A picture with a cut-off compared with the one without.

    change: largest over pixels, linear RGB. bounds: (largest, mean) over pixels. ratio: largest change ÷ bound. beyond:
    number of pixels that change by more than the bound. bad: share of pixels that change by more than 1/255. rays,
    time: the share that remains, 0 to 1.
    """

    cutoff: float
    change: float
    bounds: tuple[float, float]
    ratio: float
    beyond: int
    bad: float
    rays: float | Missing
    time: Estimate | Missing


@dataclass(frozen=True)
class Sweep:
    """Points of a variant by rising cut-off.

    method: its differences from others of its view. lacking: the number of cells without a point, by reason.
    """

    variant: str
    method: str
    points: list[Point]
    lacking: dict[str, int]

    @property
    def label(self) -> str:
        return ", ".join(filter(None, [self.variant, self.method]))


def sweeps_by_view(results: Results) -> list[tuple[View, list[Sweep]]]:
    """Returns every view in which the cut-off was swept."""
    views = []
    for seen in view.views(results.cells, ("cutoff", *METHODS)):
        differing = [key for key in view.differing(seen.cells, METHODS) if key != "epsilon"]
        groups = grouped(seen.cells, lambda cell, keys=differing: (cell.variant, method.values(cell, keys)))
        sweeps = [_sweep(results, *names, cells) for names, cells in groups.items()]
        sweeps = [sweep for sweep in sweeps if sweep.points or sweep.lacking]
        if sweeps:
            views.append((seen, sweeps))
    return views


def _sweep(results: Results, variant: str, method: str, cells: list[Cell]) -> Sweep:
    whole = next((cell for cell in cells if not cell.parameters.get("cutoff")), None)
    cut = sorted((cell for cell in cells if cell.parameters.get("cutoff")), key=lambda cell: cell.parameters["cutoff"])
    outcomes = [_point(results, cell, whole) for cell in cut]
    points = [point for point in outcomes if isinstance(point, Point)]
    return Sweep(variant, method, points, Counter(str(outcome) for outcome in outcomes if isinstance(outcome, Missing)))


def _point(results: Results, cell: Cell, whole: Cell | None) -> Point | Missing:
    if whole is None:
        return Missing("the run has no cell without a cut-off to compare with")
    record = results.record(cell)
    bound_record = (record or {}).get("bound")
    if bound_record is None:
        return Missing(cell.verdict if cell.status != "ok" else "its scene reflects nothing that could be cut")
    arrays = (
        stored.picture(results, cell),
        stored.picture(results, whole),
        stored.array(results, bound_record["dropped_file"]),
    )
    for array in arrays:
        if isinstance(array, Missing):
            return array
    cut, right, dropped = arrays
    bound = bound_record["radiance"] * dropped
    change = np.abs(cut - right).max(axis=-1)
    unit = UNIT.get(cell.parameters["precision"], 2.0**-53)
    surely = np.maximum(change - SLACK * unit * np.maximum(right.max(axis=-1), 1), 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = np.where(surely > 0, surely / bound, 0.0)  # infinite where nothing was cut, but the pixel differs
    return Point(
        cell.parameters["cutoff"],
        float(change.max()),
        (float(bound.max()), float(bound.mean())),
        float(ratios.max()),
        int(np.count_nonzero(ratios > 1)),
        float(np.mean(change > STEP)),
        _rays(record, results.record(whole)),
        _time(cell, whole),
    )


def _rays(record: dict, whole: dict) -> float | Missing:
    if not record["rays"] or not whole["rays"]:
        return Missing("the rays are not reported")
    kept, all_of_them = (sum(row["rays"][kind] for kind in KINDS) for row in (record, whole))
    return kept / all_of_them


def _time(cell: Cell, whole: Cell) -> Estimate | Missing:
    for side in (cell, whole):
        if side.unranked:
            return Missing(f"not ranked: {side.unranked}")
    return ranking.ratio(cell, whole)


def write(results: Results, out: Path) -> str:
    """Writes cutoff-NUMBER-VIEW.png and .svg, cutoff.csv; returns the section, "" if no cut-off was swept."""
    views = sweeps_by_view(results)
    if not views:
        return ""
    parts = [f"## {TITLE}", _judgement(views)]
    for number, (seen, sweeps) in enumerate(views):
        parts.append(f"### {markdown.escape(seen.title)}")
        drawn = [sweep for sweep in sweeps if sweep.points]
        if drawn:
            path, alt = out / f"cutoff-{number}-{markdown.slug(seen.label)}", f"{TITLE}: {seen.title}"
            parts += [style.figure(path, alt, draw, seen, drawn, results.variants), _table(drawn)]
        left = [f"{count} of {sweep.label}: {why}" for sweep in sweeps for why, count in sweep.lacking.items()]
        parts += markdown.listed("Left out:", left)
    table.write_lines(out / "cutoff.csv", CSV_HEADER, _csv(views))
    return "\n\n".join([*parts, "Every point: [cutoff.csv](cutoff.csv).", markdown.escape(CAPTION)])


def _judgement(views: list[tuple[View, list[Sweep]]]) -> str:
    """Says whether the bound holds everywhere."""
    points = [(seen, sweep, point) for seen, sweeps in views for sweep in sweeps for point in sweep.points]
    if not points:
        return "Whether the bound holds: unavailable: no picture with a cut-off could be compared."
    broken = [
        f"{seen.label}: {sweep.label}, cut-off {_power(point.cutoff)}: {point.beyond} pixels, a change of up to "
        f"{point.ratio:.3g} times the bound"
        for seen, sweep, point in points
        if point.beyond
    ]
    if broken:
        said = f"**THE BOUND DOES NOT HOLD in {len(broken)} of {len(points)} pictures.** It, or the cut-off, is wrong:"
        return "\n\n".join(markdown.listed(said, broken))
    worst = max(point.ratio for _, _, point in points)
    return (
        f"The bound holds in every pixel of all {len(points)} pictures with a cut-off; what it changes is at "
        f"most {quantity.percentage(worst)} of it."
    )


def _power(cutoff: float) -> str:
    exponent = np.log2(cutoff)
    return f"2^{exponent:.0f}" if exponent == round(exponent) else f"{cutoff:g}"


def _table(sweeps: list[Sweep]) -> str:
    rows = []
    for sweep in sweeps:
        for point in sweep.points:
            rays = quantity.text(point.rays) if isinstance(point.rays, Missing) else f"{100 * point.rays:.3g}"
            largest, mean = (quantity.plain(value) for value in point.bounds)
            rows.append([
                sweep.label, _power(point.cutoff), quantity.plain(point.change), largest, mean, f"{point.ratio:.3g}",
                f"{100 * point.bad:.3g}", rays, quantity.text(point.time, 100),
            ])  # fmt: skip
    header = [
        "renderer", "cut-off", "largest change", "largest bound", "mean bound", "change ÷ bound", "beyond 1/255 (%)",
        "rays kept (%)", "time kept (%)",
    ]  # fmt: skip
    return markdown.table(header, rows)


def _csv(views: list[tuple[View, list[Sweep]]]) -> Iterator[tuple]:
    for seen, sweeps in views:
        for sweep in sweeps:
            for point in sweep.points:
                rays = None if isinstance(point.rays, Missing) else point.rays
                time = point.time
                has_time = not isinstance(time, Missing)
                times = (time.value, time.low, time.high, time.note) if has_time else (None, None, None, str(time))
                name = seen.label, sweep.variant, sweep.method or "as the view"
                changes = point.change, *point.bounds, point.ratio, point.beyond, point.bad
                yield *name, point.cutoff, *changes, rays, *times


def draw(seen: View, sweeps: list[Sweep], variants: list[str]):
    """Draws sweeps, each with a point."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(7.2, 3.9), layout="constrained")
    alike = grouped(sweeps, lambda sweep: tuple(map(_rounded, sweep.points)))
    markers = iter("osD^vP*X" * len(sweeps))
    for group in alike.values():
        first, marker = group[0], next(markers)
        colour = style.colour(first.variant, variants) if len(group) == 1 else "#444444"
        cutoffs = [point.cutoff for point in first.points]
        name = textwrap.fill(", ".join(sweep.label for sweep in group), 60)
        left.plot(cutoffs, _shown([p.bounds[0] for p in first.points]), "--", color=colour, lw=1)
        left.plot(cutoffs, _shown([p.bounds[1] for p in first.points]), ":", color=colour, lw=1)
        left.plot(cutoffs, _shown([p.change for p in first.points]), f"{marker}-", color=colour, ms=4, lw=1)
        some = [point for point in first.points if not isinstance(point.rays, Missing)]
        right.plot([p.cutoff for p in some], [100 * p.rays for p in some], f"{marker}-", color=colour, ms=4, lw=1,
                   label=f"rays, {name}")  # fmt: skip
    methods = list(dict.fromkeys(sweep.method for sweep in sweeps))
    for number, sweep in enumerate(sweeps):
        colour, marker = style.colour(sweep.variant, variants), "x*1234"[methods.index(sweep.method) % 6]
        _times(right, sweep, colour, marker, 2 ** (0.12 * (number - (len(sweeps) - 1) / 2)))
    style.visible_step(left)
    for style_, name in (("-", "largest change"), ("--", "largest bound"), (":", "mean bound")):
        left.plot([], [], style_, color="#444444", lw=1, label=name)
    left.set(yscale="log", ylabel="linear RGB")
    style.log_ticks(left.yaxis)
    right.axhline(100, color="#888888", lw=0.8)
    right.set(ylabel="kept, % of what it is without a cut-off")
    right.set_ylim(bottom=0)
    cutoffs = sorted({point.cutoff for sweep in sweeps for point in sweep.points})
    for axes in (left, right):
        axes.set_xscale("log", base=2)
        axes.set_xticks(cutoffs[:: -(-len(cutoffs) // 6)], [_power(c) for c in cutoffs[:: -(-len(cutoffs) // 6)]])
        axes.minorticks_off()
        axes.set_xlabel("cut-off")
        axes.grid()
    style.log_ticks(left.yaxis)
    left.legend(fontsize=6)
    figure.legend(*right.get_legend_handles_labels(), loc="outside lower left", ncols=2, fontsize=6)
    style.entitle(figure, seen.title)
    return figure


def _rounded(point: Point) -> tuple[str, ...]:
    """Returns the drawn values of a point without its time, rounded to visible digits."""
    rays = "" if isinstance(point.rays, Missing) else f"{point.rays:.4e}"
    return f"{point.cutoff}", rays, *(f"{value:.4e}" for value in (point.change, *point.bounds))


def _shown(values: list[float]) -> np.ndarray:
    """Returns values for a logarithmic axis, NaN instead of 0."""
    return np.where(np.array(values) > 0, values, np.nan)


def _times(axes, sweep: Sweep, colour: str, marker: str, aside: float) -> None:
    points = [point for point in sweep.points if not isinstance(point.time, Missing)]
    if not points:
        return
    at = [point.cutoff * aside for point in points]
    times = [100 * point.time.value for point in points]
    axes.plot(at, times, marker, color=colour, ms=5, label=f"time, {sweep.label}")
    for x, point in zip(at, points, strict=True):
        if point.time.low is not None:
            axes.plot([x, x], [100 * point.time.low, 100 * point.time.high], color=colour, lw=0.8)
