"""Draws speed against stability: the time of each method relative to the default, and the stress that it survives."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from harness.statistics import steady
from reports.paper import markdown, style, table
from reports.run import command
from reports.run.results import Results
from reports.stability import stability
from reports.stability import style as look
from reports.stability.stability import Curve, Point, Row, Way

TITLE = "Speed against stability"
CAPTION = (
    "Each mark: the time of a frame over that of the default method (at 1) of the same renderer and precision at the "
    "same level: the median over levels, with a bar from quartile to quartile. Across: the stress survived, as in the "
    "overview. Low and to the right is best. Full marks are float64, hollow ones other precisions."
)
COLUMNS, PANEL = 4, (1.8, 1.9)  # inches
MOST = 20  # panels of a figure: a page
KEY = 0.085  # of a panel's height, for a way in its key
CSV_HEADER = (
    "row", "variant", "precision", "way", "naive", "default_way", "levels", "time_ratio", "ratio_low", "ratio_high",
    "survived", "of", "unit", "sure",
)  # fmt: skip


@dataclass(frozen=True)
class Cost:
    """The cost of a curve with timed frames.

    ratios: its time over the default method's, one per level. frames: how many were timed. shortest, longest: median
    frames of a level, s.
    """

    curve: Curve
    against: Way
    ratios: list[float]
    frames: int
    shortest: float
    longest: float

    @property
    def ratio(self) -> float:
        return median(self.ratios)

    @property
    def spread(self) -> tuple[float, float]:
        """The quartiles over levels."""
        low, high = np.percentile(self.ratios, [25, 75])
        return float(low), float(high)


def costs(results: Results, row: Row) -> list[Cost]:
    """Returns the cost of every curve that shares timed levels with the default method; [] with one method."""
    usual = _default(row)
    if usual is None or len(row.ways) < 2:
        return []
    curve_costs = []
    for curve in row.curves:
        base = row.find(curve.variant, curve.precision, usual)
        base_seconds = {point.level: _seconds(results, point) for point in base.answered} if base else {}
        seconds = {point.level: _seconds(results, point) for point in curve.answered}
        both = [level for level, times in seconds.items() if times and base_seconds.get(level)]
        if both:
            times = [median(seconds[level]) for level in both]
            ratios = [time / median(base_seconds[level]) for level, time in zip(both, times, strict=True)]
            count = sum(len(seconds[level]) for level in both)
            curve_costs.append(Cost(curve, usual, ratios, count, min(times), max(times)))
    return curve_costs


def _default(row: Row) -> Way | None:
    """Returns the way with the default value of the row's method."""
    value = command.default(row.facts["method"]) if row.facts["method"] else None
    return next((way for way in row.ways if way.name == value), None)


def _seconds(results: Results, point: Point) -> list[float]:
    """Returns the steady frames of all repetitions, s."""
    frames = []
    for number in point.cell.timed:
        frames += steady.find(results.records[number]["frames_s"] or []).frames
    return frames


def write(results: Results, out: Path) -> str:
    """Writes stability-cost.csv and figures, each of a page; returns the section of the report.

    "" where no frame was timed.
    """
    by_name = {row.name: (row, costs(results, row)) for row in stability.rows(results)}
    by_name = {name: (row, row_costs) for name, (row, row_costs) in by_name.items() if row_costs}
    if not by_name:
        return ""
    table.write_lines(out / "stability-cost.csv", CSV_HEADER, _csv(by_name))
    rows = list(by_name.values())
    pages = math.ceil(len(rows) / MOST)
    parts = [rows[len(rows) * page // pages : len(rows) * (page + 1) // pages] for page in range(pages)]
    names = [f"stability-cost{f'-{page}' if page else ''}" for page in range(pages)]
    variants = look.variants(results, [row for row, _ in rows])
    figures = [style.figure(out / name, TITLE, draw, results, part, variants)
               for name, part in zip(names, parts, strict=True)]  # fmt: skip
    link = "Every curve: [stability-cost.csv](stability-cost.csv)."
    caption = markdown.escape(f"{CAPTION} {_short(by_name)}")
    return "\n\n".join([f"## {TITLE}", *figures, _table(by_name), link, caption])


def _short(by_name: dict[str, tuple[Row, list[Cost]]]) -> str:
    """Says how short these frames are."""
    every = [cost for _, row_costs in by_name.values() for cost in row_costs]
    low, high = min(cost.shortest for cost in every), max(cost.longest for cost in every)
    counts = sorted(cost.frames / len(cost.ratios) for cost in every)
    number = " to ".join(dict.fromkeys(f"{count:g}" for count in (counts[0], counts[-1])))
    return (
        "These frames, of the rows' own rays and small pictures, are few and short, so this is no benchmark: "
        f"{number} steady frames per cell, of {look.short(low)} s to {look.short(high)} s."
    )


def _table(by_name: dict[str, tuple[Row, list[Cost]]]) -> str:
    """Returns the table with a line for each row, way and precision."""
    lines = []
    for row, row_costs in by_name.values():
        for precision in row.precisions:
            for way in row.ways:
                some = [cost for cost in row_costs if (cost.curve.precision, cost.curve.way) == (precision, way)]
                if some and way != some[0].against:
                    times = ", ".join(f"{cost.curve.variant} {_times(cost)}" for cost in some)
                    gains = ", ".join(f"{cost.curve.variant} {row.survival(cost.curve).mark}" for cost in some)
                    lines.append([row.label, precision, f"{way.name} / {some[0].against.name}", times, gains])
    header = ["row", "precision", "methods", "time of a frame, median over levels [quartiles]", "survived"]
    return markdown.table(header, lines)


def _times(cost: Cost) -> str:
    low, high = cost.spread
    return f"{cost.ratio:.3g} [{low:.3g}, {high:.3g}]"


def _csv(by_name: dict[str, tuple[Row, list[Cost]]]) -> Iterator[tuple]:
    for row, row_costs in by_name.values():
        for cost in row_costs:
            curve, survival = cost.curve, row.survival(cost.curve)
            head = row.name, curve.variant, curve.precision, curve.way.name, curve.way.naive, cost.against.name
            numbers = len(cost.ratios), cost.ratio, *cost.spread
            unit = "decades" if survival.decades else "levels"
            yield *head, *numbers, survival.value or 0.0, survival.of, unit, survival.sure


def draw(results: Results, rows: list[tuple[Row, list[Cost]]], variants: list[str]):
    """Draws a panel for each row; variants: of all figures, in each of which one has the same mark."""
    columns = min(COLUMNS, len(rows))
    lines = math.ceil(len(rows) / columns)
    wide, high = max(4.6, PANEL[0] * columns), PANEL[1] * lines
    figure, panels = plt.subplots(lines, columns, figsize=(wide, high), squeeze=False, layout="constrained")
    for axes, (row, row_costs) in zip(panels.flat, rows, strict=False):
        _panel(axes, row, row_costs, variants)
    for axes in panels.flat[len(rows) :]:
        axes.set_visible(False)
    here = look.variants(results, [row for row, _ in rows])
    handles = [Line2D([], [], ls="", color="black", **look.marker(variant, variants)) for variant in here]
    title = f"{TITLE}: time of a frame over the default method's"
    note = look.origin(results, [cell for row, _ in rows for cell in row.cells])
    look.frame(figure, title, (handles, here), note)
    return figure


def _panel(axes, row: Row, row_costs: list[Cost], variants: list[str]) -> None:
    shades = look.colours(row.ways)
    for cost in row_costs:
        shade = shades[cost.curve.way]
        x, marks = row.survival(cost.curve).value or 0.0, look.marker(cost.curve.variant, variants)
        fill = shade if cost.curve.precision == "float64" else "white"
        axes.plot([x, x], cost.spread, color=shade, lw=0.6, alpha=0.6)
        axes.plot(x, cost.ratio, color=shade, **{**marks, "mfc": fill}, zorder=3, alpha=0.9)
    axes.axhline(1, color=look.GREY, lw=0.6)
    axes.set_yscale("log", base=2)
    ends = [end for cost in row_costs for end in cost.spread]
    ways = [way for way in row.ways if any(cost.curve.way == way for cost in row_costs)]
    low, high = min(0.5, 0.8 * min(ends)), max(1.5, 1.15 * max(ends))
    room = min(0.6, KEY * len(ways))  # share of the panel above all marks
    axes.set_ylim(low, high * (high / low) ** (room / (1 - room)))
    axes.yaxis.set_major_formatter(lambda value, _: look.short(value))
    axes.yaxis.minorticks_off()
    axes.tick_params(labelsize=look.SMALL, which="both")
    of = max(row.survival(cost.curve).of for cost in row_costs)
    axes.set_xlim(-0.08 * of, 1.08 * of)
    axes.xaxis.set_major_locator(MaxNLocator(4))
    axes.xaxis.set_major_formatter(lambda value, _: look.short(value))
    decades = row.survival(row_costs[0].curve).decades
    axes.set_xlabel(f"{'decades' if decades else 'levels'} survived, of {of:.3g}", fontsize=look.SMALL)
    axes.set_title(row.label, loc="left", fontsize=look.SMALL)
    axes.grid()
    handles = [Line2D([], [], ls="", marker="s", ms=3, color=shades[way], mew=0) for way in ways]
    axes.legend(handles, [way.name for way in ways], fontsize=look.SMALL, loc="upper left", handletextpad=0.1,
                borderpad=0.2, labelspacing=0.2)  # fmt: skip
