"""Draws error against samples, a panel for each view, with the fitted slope and theory's."""

import textwrap
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from reports.accuracy import convergence
from reports.accuracy.convergence import CLOSE, NEAR, OCTAVES, Line
from reports.accuracy.resampling import RESAMPLES, SIDE
from reports.paper import markdown, quantity, style, table
from reports.run.cell import Missing
from reports.run.results import Results
from reports.run.view import View
from reports.run.words import all_against

TITLE = "Convergence: error against samples"
CAPTION = (
    "Error: distance from the truth, RMSE over all pixels, linear RGB, the share of the truth's noise taken off. N: "
    "samples of a pixel, n × n, times its feelers and glossy rays where these were swept. Slope: least squares of log2 "
    "error on log2 N with equal weights; pictures that differ only in their seed make one point with their mean "
    f"squared error. [low, high]: 95 % interval from {RESAMPLES} resamples of blocks of up to {SIDE} × {SIDE} pixels, "
    f"the same in all pictures of a line. It needs {OCTAVES} octaves of N. Grey band: below {NEAR} times what the "
    "truth is known to; points in it, and exact ones, are hollow and not fitted. Held against the truth of the scene, "
    "the error of a picture with one sample a pixel, hard shadows or few reflections stops falling; where it is held "
    "against something else, such as each picture's own limit, the title says so. Dotted: theory's slope through the "
    "middle of the line. Guides: -1/2, -3/4 and -1. Theory depends on the kind of edge or shading, so the experiment "
    f"names it for each scene; a slope agrees with theory within {CLOSE}. Variants with errors equal to six digits "
    "share a line."
)
POINTS = "view", "variant", "sampler", "draws", "error_rmse", "uncertainty", "fitted"
SLOPES = "view", "variant", "sampler", "slope", "low", "high", "theory", "difference", "octaves", "note"
COLOURS = {
    **{"uniform": "#D55E00", "jittered": "#0072B2", "sobol": "#56B4E9"},
    **{"feelers": "#009E73", "glossy_rays": "#B5A300"},
}
OTHER = "#CC79A7"
MARKERS = "osD^vP*X"
GUIDES = (-0.5, "-1/2"), (-0.75, "-3/4"), (-1.0, "-1")
PANEL = 3.6, 3.7  # inches
MOST = 6  # panels of a figure


def write(results: Results, out: Path) -> str:
    """Writes convergence-NUMBER.png and .svg, convergence.csv, convergence-slopes.csv; returns the section."""
    views = convergence.lines_by_view(results)
    if not views:
        return ""
    parts = [f"## {TITLE}"]
    drawn = [(view, lines) for view, lines in views if any(line.points for line in lines)]
    for number, first in enumerate(range(0, len(drawn), MOST)):
        parts.append(style.figure(out / f"convergence-{number}", TITLE, draw, drawn[first : first + MOST]))
    parts += [_table(views), *_left_out(views)]
    table.write_lines(out / "convergence.csv", POINTS, _points(views))
    table.write_lines(out / "convergence-slopes.csv", SLOPES, _slopes(views))
    points, slopes = (f"[{name}]({name})" for name in ("convergence.csv", "convergence-slopes.csv"))
    parts.append(f"Every point: {points}. Every slope: {slopes}.")
    return "\n\n".join([*parts, markdown.escape(CAPTION)])


def draw(views: list[tuple[View, list[Line]]]):
    """Draws views, each with a line that has points."""
    columns = min(2, len(views))
    rows = -(-len(views) // columns)
    size = PANEL[0] * columns, PANEL[1] * rows
    figure, panels = plt.subplots(rows, columns, figsize=size, squeeze=False, layout="constrained")
    for axes, (view, lines) in zip(panels.flat, views, strict=False):
        _panel(axes, view, [line for line in lines if line.points])
    for axes in panels.flat[len(views) :]:
        axes.set_visible(False)
    return figure


def _panel(axes, view: View, lines: list[Line]) -> None:
    points = [point for line in lines for point in line.points]
    some = [point.error for point in points if point.error > 0]
    low, high = min(some, default=1e-9), max(some, default=1.0)
    axes.set(xscale="log", yscale="log", xlabel="samples of a pixel, N", ylabel="error: RMSE (linear RGB)")
    axes.set_ylim(low / 2.5, high * 1.8)
    axes.set_title("\n".join(textwrap.wrap(_label(view), 48)), loc="left")
    floor = NEAR * max(point.uncertainty for point in points)
    if floor > 0:
        axes.axhspan(axes.get_ylim()[0], max(floor, axes.get_ylim()[0]), color="#E4E4E4", lw=0, zorder=0)
    first, last = (function(point.draws for point in points) for function in (min, max))
    ends = np.array([first, last])
    for slope, name in GUIDES:
        axes.plot(ends, high * 1.4 * (ends / first) ** slope, color="#BBBBBB", lw=0.7, zorder=1)
        at = (low / 2.5 * 1.6 / (high * 1.4)) ** (1 / slope) * first  # where the guide leaves the panel
        x = min(at, last)
        axes.text(x, high * 1.4 * (x / first) ** slope, name, fontsize=6, color="#888888", ha="right", va="center",
                  bbox={"fc": "white", "lw": 0, "pad": 0.6}, zorder=2)  # fmt: skip
    markers: dict[str, int] = {}
    for line in lines:
        marker = markers[line.sampler] = markers.get(line.sampler, -1) + 1
        _line(axes, line, COLOURS.get(line.sampler, OTHER), MARKERS[marker % len(MARKERS)])
    style.log_ticks(axes.yaxis)
    draws = sorted({point.draws for point in points})
    axes.set_xticks(draws[:: -(-len(draws) // 8)], [str(n) for n in draws[:: -(-len(draws) // 8)]])
    axes.xaxis.minorticks_off()
    axes.legend(loc="upper left", bbox_to_anchor=(-0.12, -0.16), fontsize=6, handlelength=1.5)


def _label(view: View) -> str:
    """Returns the name of a view, with what its errors are held against where that is not the truth of the scene."""
    against = all_against(cell.against for cell in view.cells)
    return f"{view.title} (error {against})" if against else view.title


def _line(axes, line: Line, colour: str, marker: str) -> None:
    draws, errors = (np.array([getattr(point, name) for point in line.points]) for name in ("draws", "error"))
    fits = np.array([point.fits for point in line.points])
    label = textwrap.fill(f"{line.label} ({', '.join(line.variants)}): {_said(line)}", 58)
    axes.plot(draws, errors, color=colour, lw=1, zorder=3)
    axes.plot(draws[fits], errors[fits], marker, color=colour, ms=4, mew=0, zorder=4)
    axes.plot(draws[~fits], errors[~fits], marker, color=colour, ms=4, mfc="white", mew=0.8, zorder=4)
    axes.plot([], [], f"{marker}-", color=colour, ms=4, lw=1, label=label)
    if line.theory is not None and fits.any():
        middle = [np.exp(np.log(values[fits]).mean()) for values in (draws, errors)]
        ends = draws[fits][[0, -1]]
        axes.plot(ends, middle[1] * (ends / middle[0]) ** line.theory, ":", color=colour, lw=1.4, zorder=2)


def _said(line: Line) -> str:
    slope = "no slope" if isinstance(line.slope, Missing) else f"slope {quantity.text(line.slope)}"
    return slope if line.theory is None else f"{slope}, theory {line.theory:g}"


def _table(views: list[tuple[View, list[Line]]]) -> str:
    rows = []
    for view, lines in views:
        for line in lines:
            theory = "unavailable: the experiment names none" if line.theory is None else f"{line.theory:g}"
            off = "unavailable" if line.off is None else f"{line.off:+.3f}"
            near = "unavailable" if line.off is None else "yes" if abs(line.off) <= CLOSE else "no"
            octaves = f"{line.octaves:.3g}" if line.fitted else "none"
            pixels = str(line.points[0].squares.size) if line.points else "unavailable"
            names = ", ".join(line.variants)
            slope = quantity.text(line.slope)
            rows.append([_label(view), names, line.label, slope, theory, off, near, octaves, pixels])
    header = ["view", "renderers", "sampler", "slope", "theory", "difference", f"within {CLOSE}", "octaves", "pixels"]
    return markdown.table(header, rows)


def _left_out(views: list[tuple[View, list[Line]]]) -> list[str]:
    counts: Counter[str] = Counter()
    for _, lines in views:
        for line in lines:
            for reason, count in line.lacking.items():
                counts[f"{', '.join(line.variants)}: {reason}"] += count
    return markdown.listed("Left out:", [f"{count} of {text}" for text, count in counts.items()])


def _points(views: list[tuple[View, list[Line]]]) -> list[tuple]:
    return [
        (view.label, variant, line.label, point.draws, point.error, point.uncertainty, point.fits)
        for view, lines in views
        for line in lines
        for variant in line.variants
        for point in line.points
    ]


def _slopes(views: list[tuple[View, list[Line]]]) -> Iterator[tuple]:
    for view, lines in views:
        for line in lines:
            has_slope = not isinstance(line.slope, Missing)
            numbers = (line.slope.value, line.slope.low, line.slope.high) if has_slope else (None,) * 3
            note = line.slope.note if has_slope else str(line.slope)
            for variant in line.variants:
                yield view.label, variant, line.label, *numbers, line.theory, line.off, line.octaves, note
