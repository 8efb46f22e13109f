"""Draws the front of each renderer in plain words: how long to wait for how small an error."""

import textwrap
from itertools import pairwise
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from reports.accuracy import pareto
from reports.accuracy.pareto import GAIN, VISIBLE, Chart, Point
from reports.paper import markdown, quantity, style, thinning
from reports.run import method
from reports.run.results import Results

TITLE = "How long for how small an error"
CAPTION = (
    "Faint: every method that was measured. Lines: for each renderer the methods that are worth their time, which none "
    "of its own beats and which reduce the error by a tenth at least. Named are the methods that are worth their time "
    "over all renderers, where there is room. Error: distance from the truth of the scene, RMSE over all pixels, "
    "linear RGB, of the worst process; time: the median over processes. The charts of all methods, with intervals, "
    "follow."
)
MOST = 24  # charts
MOST_NAMED = 7  # points
WIDTH, HEIGHT = 7.2, 4.4  # inches
WRAP = 26  # letters of a name in a line
AXIS = "error: RMSE, linear RGB"
INVISIBLE = "a screen of 8 bits cannot show it"
GAP, REACHES = 7.0, (1, 2.2, 4)  # points between a mark and its name, and times as many where it is crowded
AROUND = [(1, -1), (-1, -1), (1, 0), (-1, 0), (0, -1), (1, 1), (-1, 1), (0, 1)]  # places of a name about its mark
BESIDE = [(1, 0), *(place for place in AROUND if place != (1, 0))]  # the same, for the name of a line


def worth(chart: Chart, points: list[Point]) -> list[Point]:
    """Returns the points that are worth their time, the fastest first: each reduces the error of the one before."""
    kept: list[Point] = []
    for point in sorted(points, key=lambda point: (point.time.value, point.error)):
        if not kept or _error(chart, point) <= GAIN * _error(chart, kept[-1]):
            kept.append(point)
    return kept


def _error(chart: Chart, point: Point) -> float:
    """Returns the error at which a point is drawn: smaller ones than the truth can tell are equal."""
    return max(point.error, chart.resolution)


def draw(results: Results, chart: Chart):
    """Draws a chart with points."""
    figure, axes = plt.subplots(figsize=(WIDTH, HEIGHT), layout="constrained")
    axes.set_title(chart.view.label, loc="left", fontweight="bold")
    places = {id(point): (_error(chart, point), point.time.value) for point in chart.points}
    _scale(axes, np.array(list(places.values())), chart)
    figure.draw_without_rendering()  # places the axes, for what follows
    figure.set_layout_engine("none")
    shade = _shade(axes)
    taken, ends = [], []
    for point in chart.points:
        axes.plot(*places[id(point)], ".", color=style.colour(point.cell.variant, results.variants), ms=4, alpha=0.3)
        taken.append(axes.transData.transform(places[id(point)]))
    for variant in results.variants:
        front = worth(chart, [point for point in chart.points if point.cell.variant == variant])
        if front:
            colour = style.colour(variant, results.variants)
            along = np.array([places[id(point)] for point in front])
            axes.plot(*along.T, "-o", color=colour, lw=1.6, ms=4)
            taken += _along(axes.transData.transform(along))
            ends.append((along[0], variant, {"color": colour, "fontweight": "bold", "fontsize": 8}))
    best = thinning.few(worth(chart, chart.points), MOST_NAMED)
    named = [(places[id(point)], chart.names.method(point.cell) or method.PLAIN) for point in best]
    boxes = [shade]
    for at, variant, bold in sorted(ends, key=lambda end: end[0][1]):
        boxes.append(_name(axes, variant, at, BESIDE, taken, boxes, **bold)[1])
    for at, name in named:
        drawn, box, free = _name(
            axes, textwrap.fill(name, WRAP), at, AROUND, taken, boxes, color="#333333", fontsize=style.SMALL
        )
        if free:
            boxes.append(box)
        else:
            drawn.remove()
    return figure


def _scale(axes, places: np.ndarray, chart: Chart) -> None:
    """Sets the axes, with room for names. places: error and time (s) of each point, (points, 2)."""
    room = []
    for low, high in zip(places.min(axis=0), places.max(axis=0), strict=True):
        pad = max((high / low) ** 0.12, 1.5)
        room.append([low / pad, high * pad])
    room[0][1] *= room[0][1] / places[:, 0].max()  # names of renderers stand at the right
    room[0] = [min(room[0][0], VISIBLE / 2), max(room[0][1], VISIBLE * 2)]
    axes.set(xscale="log", yscale="log", xlim=room[0], ylim=room[1])
    for axis in (axes.xaxis, axes.yaxis):
        style.log_ticks(axis)
    axes.yaxis.set_major_formatter(lambda value, _: _time(value))
    axes.yaxis.set_minor_formatter(lambda value, _: "")
    axes.grid()
    axes.set_xlabel(f"← nearer to the truth        {AXIS}        further off →\n{chart.against}".rstrip())
    axes.set_ylabel("← faster        time of a frame        slower →")


def _shade(axes):
    """Shades errors that an 8-bit screen cannot show; returns the box of the words that say so."""
    axes.axvspan(axes.get_xlim()[0], VISIBLE, color="#EAF3EA", lw=0, zorder=0)
    drawn = axes.text(
        VISIBLE, 0.985, f"{INVISIBLE} ", transform=axes.get_xaxis_transform(), ha="right", va="top",
        fontsize=style.SMALL, color="#447744",
    )  # fmt: skip
    if drawn.get_window_extent().x0 < axes.get_window_extent().x0:
        drawn.set(text=f" ← {INVISIBLE}", ha="left")
    return drawn.get_window_extent()


def _time(seconds: float) -> str:
    """Returns the label of a tick: "10 ms"."""
    size, name = quantity.unit(seconds)
    return f"{seconds / size:g} {name}"


def _along(places: np.ndarray) -> list[np.ndarray]:
    """Returns points every few pixels of a line through `places`, (points, 2)."""
    return [
        start + (end - start) * share
        for start, end in pairwise(places)
        for share in np.linspace(0, 1, 2 + int(np.hypot(*(end - start)) / 12))
    ]


def _name(axes, text: str, at, around: list, taken: list, boxes: list, **look):
    """Writes a name beside a mark, where it covers the fewest marks, lines and other names.

    Returns the text, its box, and whether it is inside the axes and covers no other name.
    """
    frame, candidates = axes.get_window_extent(), []
    for reach in REACHES:
        for across, up in around:
            drawn = axes.annotate(
                text, at, xytext=(across * GAP * reach, up * GAP * reach), textcoords="offset points",
                ha={1: "left", -1: "right", 0: "center"}[across], va={1: "bottom", -1: "top", 0: "center"}[up],
                zorder=6, path_effects=style.OUTLINE, **look,
            )  # fmt: skip
            box = drawn.get_window_extent()
            inside = frame.contains(box.x0, box.y0) and frame.contains(box.x1, box.y1)
            names = sum(box.overlaps(other) for other in boxes)
            candidates.append((not inside, names, sum(box.contains(*place) for place in taken) + reach, drawn, box))
    candidates.sort(key=lambda candidate: candidate[:3])
    for *_, drawn, _ in candidates[1:]:
        drawn.remove()
    outside, names, _, drawn, box = candidates[0]
    return drawn, box, not outside and not names


def write(results: Results, out: Path) -> str:
    """Writes front-NUMBER-VIEW.png and .svg for each view whose errors differ; returns the section, or ""."""
    charts = [chart for chart in pareto.charts(results) if chart.trades]
    if not charts:
        return ""
    parts = [f"## {TITLE}"]
    for number, chart in enumerate(thinning.few(charts, MOST)):
        path = out / f"front-{number}-{markdown.slug(chart.view.label)}"
        parts += [
            f"### {markdown.escape(chart.view.label)}",
            style.figure(path, f"{TITLE}: {chart.view.label}", draw, results, chart),
        ]
    parts.append(thinning.note(min(MOST, len(charts)), len(charts), "charts", "those of every method are below"))
    return "\n\n".join(filter(None, [*parts, markdown.escape(CAPTION)]))
