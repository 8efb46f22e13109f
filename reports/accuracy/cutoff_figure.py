"""What a contribution cut-off costs and saves: error beside its proven bound, rays and time (CUT-1 to CUT-3)."""

import textwrap
from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from harness.statistics.statistics import Estimate
from reports.paper import markdown, quantity, style
from reports.run import method, ranking, stored, view
from reports.run.cell import Cell, Missing
from reports.run.results import Results
from reports.run.view import View

TITLE = "Cut-off: error against its proven bound, and what it saves"
STEP = 1 / 255
UNIT = {"float32": 2.0**-24}  # u of NUM-2; else that of float64
SLACK = 64  # u: what sums of some hundred terms may be off by
METHODS = "precision", "epsilon", "floating_point", *method.STEPS
KINDS = "primary", "reflected", "transmitted", "shadow"
CAPTION = (
    "Error: largest absolute difference in any channel of linear RGB from the picture of the same variant without a "
    "cut-off, all else equal. Bound of a pixel: the weight that was cut there times the most that a ray can bring "
    "(CUT-3); it is worked out with the picture and needs no other one. Error ÷ bound is the largest over pixels, with "
    f"{SLACK} u of the pixel's brightest channel (of 1 at least) taken off the error first, for rounding: above 1 in a "
    "single pixel the bound does not hold. Rays: of all kinds, in % of those without a cut-off. Time: of a steady "
    "frame, likewise, with its 95 % interval where there are enough processes. Variants with equal errors and rays "
    "are drawn as one in all but time."
)


@dataclass(frozen=True)
class Point:
    """A picture with a cut-off against the one without. error, bounds: (largest, mean) over pixels, linear RGB.

    ratio: largest error ÷ bound. beyond: pixels whose error is above the bound. bad: share of pixels off by more than
    1/255. rays, time: kept, of 1.
    """

    cutoff: float
    error: float
    bounds: tuple[float, float]
    ratio: float
    beyond: int
    bad: float
    rays: float | Missing
    time: Estimate | Missing


@dataclass(frozen=True)
class Sweep:
    """Points of a variant by rising cut-off. method: what tells it from others of its view. lacking: as in Line."""

    variant: str
    method: str
    points: list[Point]
    lacking: dict[str, int]

    @property
    def label(self) -> str:
        return ", ".join(filter(None, [self.variant, self.method]))


def found(results: Results) -> list[tuple[View, list[Sweep]]]:
    """Every view in which the cut-off was swept."""
    told = []
    for seen in view.views(results.cells, ("cutoff", *METHODS)):
        telling = [key for key in view.differing(seen.cells, METHODS) if key != "epsilon"]
        groups: dict[tuple, list[Cell]] = {}
        for cell in seen.cells:
            method = ", ".join(f"{key} = {cell.parameters[key]}" for key in telling)
            groups.setdefault((cell.variant, method), []).append(cell)
        sweeps = [_sweep(results, *names, cells) for names, cells in groups.items()]
        sweeps = [sweep for sweep in sweeps if sweep.points or sweep.lacking]
        if sweeps:
            told.append((seen, sweeps))
    return told


def _sweep(results: Results, variant: str, method: str, cells: list[Cell]) -> Sweep:
    whole = next((cell for cell in cells if not cell.parameters.get("cutoff")), None)
    points, lacking = [], {}
    for cell in sorted(cells, key=lambda cell: cell.parameters.get("cutoff", 0)):
        if cell is not whole and cell.parameters.get("cutoff"):
            point = _point(results, cell, whole)
            if isinstance(point, Missing):
                lacking[str(point)] = lacking.get(str(point), 0) + 1
            else:
                points.append(point)
    return Sweep(variant, method, points, lacking)


def _point(results: Results, cell: Cell, whole: Cell | None) -> Point | Missing:
    if whole is None:
        return Missing("the run has no cell without a cut-off at its place")
    record = results.record(cell)
    told = (record or {}).get("bound")
    if told is None:
        return Missing(cell.verdict if cell.status != "ok" else "nothing was cut: its scene reflects nothing")
    arrays = stored.picture(results, cell), stored.picture(results, whole), stored.array(results, told["dropped_file"])
    for one in arrays:
        if isinstance(one, Missing):
            return one
    cut, right, dropped = arrays
    bound = told["radiance"] * dropped
    error = np.abs(cut - right).max(axis=-1)
    unit = UNIT.get(cell.parameters["precision"], 2.0**-53)
    surely = np.maximum(error - SLACK * unit * np.maximum(right.max(axis=-1), 1), 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = np.where(surely > 0, surely / bound, 0.0)  # infinite where nothing was cut and yet it differs
    return Point(
        cell.parameters["cutoff"],
        float(error.max()),
        (float(bound.max()), float(bound.mean())),
        float(ratios.max()),
        int(np.count_nonzero(ratios > 1)),
        float(np.mean(error > STEP)),
        _rays(record, results.record(whole)),
        _time(cell, whole),
    )


def _rays(record: dict, whole: dict) -> float | Missing:
    if not record["rays"] or not whole["rays"]:
        return Missing("the rays are not told")
    kept, all_of_them = (sum(told["rays"][kind] for kind in KINDS) for told in (record, whole))
    return kept / all_of_them


def _time(cell: Cell, whole: Cell) -> Estimate | Missing:
    for one in (cell, whole):
        if one.unranked:
            return Missing(f"not ranked: {one.unranked}")
    return ranking.ratio(cell, whole)


def write(results: Results, out: Path) -> str:
    """cutoff-NUMBER-VIEW.png and .svg, cutoff.csv, and the section of the report; "" if no cut-off was swept."""
    told = found(results)
    if not told:
        return ""
    parts = [f"## {TITLE}", _judgement(told)]
    for number, (seen, sweeps) in enumerate(told):
        parts.append(f"### {markdown.escape(seen.label)}")
        drawn = [sweep for sweep in sweeps if sweep.points]
        if drawn:
            name = f"cutoff-{number}-{markdown.slug(seen.label)}"
            with style.styled():
                style.save(draw(seen, drawn, results.variants), out / name)
            parts += [markdown.figure(name, f"{TITLE}: {seen.label}"), _table(drawn)]
        left = [f"{count} of {sweep.label}: {why}" for sweep in sweeps for why, count in sweep.lacking.items()]
        if left:
            parts += ["Left out:", markdown.bullets([markdown.escape(text) for text in left])]
    _csv(told).to_csv(out / "cutoff.csv", index=False, na_rep="NaN", lineterminator="\n")
    return "\n\n".join([*parts, "Every point: [cutoff.csv](cutoff.csv).", markdown.escape(CAPTION)])


def _judgement(told: list[tuple[View, list[Sweep]]]) -> str:
    """Does the bound hold everywhere? Said first."""
    points = [(seen, sweep, point) for seen, sweeps in told for sweep in sweeps for point in sweep.points]
    if not points:
        return "Whether the bound holds: unavailable: no picture with a cut-off could be compared."
    broken = [
        f"{seen.label}: {sweep.label}, cut-off {_power(point.cutoff)}: {point.beyond} pixels, error up to "
        f"{point.ratio:.3g} times the bound"
        for seen, sweep, point in points
        if point.beyond
    ]
    if broken:
        said = f"**THE BOUND DOES NOT HOLD in {len(broken)} of {len(points)} pictures.** It, or the cut-off, is wrong:"
        return "\n\n".join([said, markdown.bullets([markdown.escape(text) for text in broken])])
    worst = max(point.ratio for _, _, point in points)
    return (
        f"The bound holds in every pixel of all {len(points)} pictures with a cut-off; the error comes to "
        f"{100 * worst:.3g} % of it at most."
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
                sweep.label, _power(point.cutoff), quantity.plain(point.error), largest, mean, f"{point.ratio:.3g}",
                f"{100 * point.bad:.3g}", rays, quantity.text(point.time, 100),
            ])  # fmt: skip
    header = [
        "variant", "cut-off", "largest error", "largest bound", "mean bound", "error ÷ bound", "beyond 1/255 (%)",
        "rays kept (%)", "time kept (%)",
    ]  # fmt: skip
    return markdown.table(header, rows)


def _csv(told: list[tuple[View, list[Sweep]]]) -> pd.DataFrame:
    rows = []
    for seen, sweeps in told:
        for sweep in sweeps:
            for point in sweep.points:
                rays = None if isinstance(point.rays, Missing) else point.rays
                time = point.time
                known = not isinstance(time, Missing)
                times = (time.value, time.low, time.high, time.note) if known else (None, None, None, str(time))
                rows.append((
                    seen.label, sweep.variant, sweep.method or "as the view", point.cutoff, point.error, *point.bounds,
                    point.ratio, point.beyond, point.bad, rays, *times,
                ))  # fmt: skip
    names = [
        "view", "variant", "method", "cutoff", "largest_error", "largest_bound", "mean_bound", "largest_ratio",
        "pixels_beyond_bound", "bad_pixels", "rays_kept", "time_kept", "time_low", "time_high", "note",
    ]  # fmt: skip
    return pd.DataFrame(rows, columns=names)


def draw(seen: View, sweeps: list[Sweep], variants: list[str]):
    """The figure of sweeps, each with a point."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(7.2, 3.9), layout="constrained")
    alike: dict[tuple, list[Sweep]] = {}
    for sweep in sweeps:
        alike.setdefault(tuple(_rounded(point) for point in sweep.points), []).append(sweep)
    markers = iter("osD^vP*X" * len(sweeps))
    for mine in alike.values():
        first, marker = mine[0], next(markers)
        colour = style.colour(first.variant, variants) if len(mine) == 1 else "#444444"
        cutoffs = [point.cutoff for point in first.points]
        name = textwrap.fill(", ".join(sweep.label for sweep in mine), 60)
        left.plot(cutoffs, _shown([p.bounds[0] for p in first.points]), "--", color=colour, lw=1)
        left.plot(cutoffs, _shown([p.bounds[1] for p in first.points]), ":", color=colour, lw=1)
        left.plot(cutoffs, _shown([p.error for p in first.points]), f"{marker}-", color=colour, ms=4, lw=1)
        some = [point for point in first.points if not isinstance(point.rays, Missing)]
        right.plot([p.cutoff for p in some], [100 * p.rays for p in some], f"{marker}-", color=colour, ms=4, lw=1,
                   label=f"rays, {name}")  # fmt: skip
    methods = list(dict.fromkeys(sweep.method for sweep in sweeps))
    for number, sweep in enumerate(sweeps):
        colour, marker = style.colour(sweep.variant, variants), "x*1234"[methods.index(sweep.method) % 6]
        _times(right, sweep, colour, marker, 2 ** (0.12 * (number - (len(sweeps) - 1) / 2)))
    left.axhline(STEP, color="#888888", lw=0.8)
    left.text(1, STEP, "1/255 ", transform=left.get_yaxis_transform(), ha="right", va="bottom", fontsize=6)
    for style_, name in (("-", "largest error"), ("--", "largest bound"), (":", "mean bound")):
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
        axes.grid(lw=0.4, color="#DDDDDD")
        axes.set_axisbelow(True)
    style.log_ticks(left.yaxis)
    left.legend(fontsize=6)
    figure.legend(*right.get_legend_handles_labels(), loc="outside lower left", ncols=2, fontsize=6)
    figure.suptitle("\n".join(textwrap.wrap(seen.label, 110)), x=0.01, ha="left", fontsize=8)
    return figure


def _rounded(point: Point) -> tuple[str, ...]:
    """Returns the drawn values of a point except its time, rounded to visible digits."""
    rays = "" if isinstance(point.rays, Missing) else f"{point.rays:.4e}"
    return f"{point.cutoff}", rays, *(f"{value:.4e}" for value in (point.error, *point.bounds))


def _shown(values: list[float]) -> np.ndarray:
    """Values for a logarithmic axis, which has no 0."""
    return np.where(np.array(values) > 0, values, np.nan)


def _times(axes, sweep: Sweep, colour: str, marker: str, aside: float) -> None:
    known = [point for point in sweep.points if not isinstance(point.time, Missing)]
    if not known:
        return
    at = [point.cutoff * aside for point in known]
    times = [100 * point.time.value for point in known]
    axes.plot(at, times, marker, color=colour, ms=5, label=f"time, {sweep.label}")
    for x, point in zip(at, known, strict=True):
        if point.time.low is not None:
            axes.plot([x, x], [100 * point.time.low, 100 * point.time.high], color=colour, lw=0.8)
