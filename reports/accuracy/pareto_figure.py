"""Draws speed against accuracy: error across, time up, a curve along each dial, the Pareto front."""

import textwrap
from html import escape
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.lines import Line2D

from harness.statistics.statistics import RESAMPLES
from harness.system import output
from reports.accuracy import accuracy_columns, pareto, pareto_table
from reports.accuracy.pareto import VISIBLE, Chart
from reports.paper import markdown, quantity, style, thinning
from reports.run import command, method
from reports.run.cell import Cell, Missing
from reports.run.results import Results

TITLE = "Speed against accuracy"
CAPTION = (
    "Error: distance from the truth of the scene, RMSE over all pixels, linear RGB, of the worst process; time: of "
    "a steady frame, the median over processes with its 95 % interval as a bar. All methods of a scene have the same "
    "truth, so pictures with one sample a pixel, hard shadows or few reflections stand beside those with more. Where "
    "an experiment asks for errors from something else, axis and text say from what. Lines: one renderer along one "
    "dial. Stairs: the front, points that no other beats in both; numbered, the fastest first. Opacity: the share of "
    f"{RESAMPLES} resamples of the processes that have a point on the front. Grey: below the truth's accuracy; "
    "smaller errors count as equal, and then the truth's own error is at most a quarter of what is shown. Guides: the "
    "slope of an error that falls with the written power of the number of samples N, if time grows with N. Dotted: an "
    "error below which a biased curve does not fall, however many samples it takes. Efficiency, 1 / (mean squared "
    "error × time), is given where the error is noise only."
)
MOST = 24  # charts
MOST_FAMILIES = 24  # in the legend
MOST_NAMED = 12  # in a sentence
LONGEST = 120  # letters of a name in the legend
MARKERS = "osD^vP*X<>phd8"
FAINT = 0.25  # opacity of a point that is never on the front
WIDTH, PLOT, HEAD, LEFT, RIGHT, LABEL, LINE = 7.2, 4.0, 0.55, 0.65, 0.15, 0.5, 0.162  # inches
GUIDES = (("-1/2", 2.0, 0.95), ("-3/4", 4 / 3, 0.7), ("-1", 1.0, 0.45))  # name, fall of log time, length (inches)


def draw(results: Results, chart: Chart):
    """Draws a chart with points. Point N of `chart.points` has the gid "method-N"."""
    variants = [name for name in results.variants if any(name == point.cell.variant for point in chart.points)]
    of_cell = family_of(chart)
    families = list(dict.fromkeys(of_cell.values()))
    shown = families[:MOST_FAMILIES]
    legends = [
        (names, style.columns(names, WIDTH - 0.1, 3))
        for names in (variants, [textwrap.shorten(name, LONGEST, placeholder=" ..") for name in shown])
    ]
    rows = sum(-(-len(names) // columns) for names, columns in legends)
    fastest, lost = _fastest(results, chart), textwrap.wrap(_lost(chart), 130)[:4]
    foot = LABEL + 0.12 + LINE * (rows + 1 + len(lost) + (len(shown) < len(families)))
    height = HEAD + LINE * len(fastest) + PLOT + foot
    figure = plt.figure(figsize=(WIDTH, height))
    box = LEFT / WIDTH, foot / height, 1 - (LEFT + RIGHT) / WIDTH, PLOT / height
    axes = figure.add_axes(box)
    zero = limits(axes, chart)
    upright = regions(axes, chart)
    markers = {family: MARKERS[number % len(MARKERS)] for number, family in enumerate(families)}
    _curves(axes, results, chart, zero)
    _points(axes, results, chart, zero, {cell: markers[family] for cell, family in of_cell.items()})
    _front(axes, chart, zero)
    if chart.sampled and any(curve.dial in pareto.DRAWS for curve in chart.curves):
        _guides(axes)
    _numbers(axes, chart, zero, upright)
    figure.text(0.01, 1 - 0.08 / height, chart.view.title, va="top", fontweight="bold")
    figure.text(0.01, 1 - 0.26 / height, "\n".join(fastest), va="top", fontsize=style.SMALL)
    handles = [Line2D([], [], color=style.colour(name, results.variants), lw=4) for name in variants]
    marks = [Line2D([], [], ls="", marker=markers[family], color="#555555", ms=5) for family in shown]
    at, size = foot - LABEL, {"loc": "upper left", "columnspacing": 1, "borderaxespad": 0}
    for symbols, (names, columns) in zip((handles, marks), legends, strict=True):
        figure.legend(symbols, names, bbox_to_anchor=(0.02, at / height), ncols=columns, **size)
        at -= LINE * (-(-len(names) // columns)) + 0.06
    left = len(families) - len(shown)
    more = [f"and {left} more method{'s' * (left > 1)}: the CSV file names them"] * (left > 0)
    figure.text(0.03, at / height, "\n".join(more + lost), va="top", fontsize=style.SMALL, linespacing=1.35)
    return figure


def family_of(chart: Chart) -> dict[Cell, str]:
    """Names the method of each cell without the dial of its first curve.

    Leaves out all dials where there would be more names than markers.
    """
    families = {}
    for curve in chart.curves:
        for cell in curve.cells:
            if chart.names.method(cell, curve.dial) == curve.family:
                families.setdefault(cell, curve.family)
    families = {point.cell: families.get(point.cell, chart.names.method(point.cell)) for point in chart.points}
    if len(set(families.values())) > len(MARKERS):
        families = {cell: chart.names.method(cell, *method.DIALS) for cell in families}
    return {cell: family or method.PLAIN for cell, family in families.items()}


def _lost(chart: Chart) -> str:
    names = "; ".join(pareto_table.without_point(chart).values())
    return f"Not drawn, for the reasons below the picture: {names}." if names else ""


def limits(axes, chart: Chart) -> float:
    """Sets the axes; returns the place at the left edge for errors of exactly 0."""
    errors = [error for point in chart.points if (error := chart.drawn(point)) > 0]
    low, high = min([VISIBLE, *errors]), max([VISIBLE, *errors])
    low = min(low, chart.resolution / 1.5) if chart.sampled else low
    pad = (high / low) ** 0.06
    left, zero = low / pad, low / pad**1.5
    ends = [end for p in chart.points for end in (p.time.value, p.time.low, p.time.high) if end is not None]
    space = max((max(ends) / min(ends)) ** 0.1, 1.15)
    none = len(errors) < len(chart.points)
    axes.set(
        xscale="log", yscale="log", xlim=(zero / pad if none else left, high * pad),
        ylim=(min(ends) / space, max(ends) * space), ylabel="steady frame (s)",
        xlabel=chart.axis,
    )  # fmt: skip
    for axis in (axes.xaxis, axes.yaxis):
        style.log_ticks(axis)
    axes.grid()
    if none:
        axes.axvspan(zero / pad, left, color="#F3F3F3", lw=0)
        axes.axvline(left, color="#888888", lw=0.6, ls="--")
        _upright(axes, zero / pad**0.75, "no error that the truth can tell" if chart.sampled else "error exactly 0")
    return zero


def regions(axes, chart: Chart) -> list:
    """Marks regions of the error: below the resolution of the truth, a visible step, float32.

    Returns the texts among the points.
    """
    left, right = axes.get_xlim()
    upright = []
    if chart.resolution > left:
        axes.axvspan(left, chart.resolution, color="#E4E4E4", lw=0, zorder=0)
        of_truth = chart.resolution > pareto.ALIKE
        why = "below the truth's accuracy" if of_truth else "float64 pictures are not told apart"
        upright.append(_upright(axes, chart.resolution, why, ha="right"))
    names = [(VISIBLE, "1/255")]
    axes.axvline(VISIBLE, color="black", lw=0.8)
    parameters = ((point.error, point.cell.parameters) for point in chart.points)
    single = [error for error, of in parameters if of["precision"] == "float32" and not of.get("cutoff")]
    if single and not chart.sampled and max(single) > 0:
        low, high = min(error for error in single if error > 0), max(single)
        axes.axvspan(low / 1.05, high * 1.05, color="#FBE9C8", lw=0, zorder=0)
        names.append((np.sqrt(low * high), "float32"))
    at = [np.log(x / left) / np.log(right / left) for x, _ in names]
    for (_, text), x in zip(names, at, strict=True):
        above = text != "1/255" and abs(x - at[0]) < 0.1  # the two would overlap
        axes.text(x, 1.045 if above else 1.01, text, transform=axes.transAxes, ha="center", va="bottom", fontsize=7)
    return upright


def _upright(axes, x: float, text: str, ha: str = "center"):
    return axes.text(
        x, 0.02, text, transform=axes.get_xaxis_transform(), rotation=90, ha=ha, va="bottom", fontsize=6.5,
        color="#555555", path_effects=style.OUTLINE,
    )  # fmt: skip


def _curves(axes, results: Results, chart: Chart, zero: float) -> None:
    points = {point.cell: point for point in chart.points}
    for curve in chart.curves:
        on_curve = [points[cell] for cell in curve.cells]
        colour = style.colour(curve.variant, results.variants)
        axes.plot(
            [chart.drawn(p) or zero for p in on_curve],
            [p.time.value for p in on_curve],
            color=colour,
            lw=0.8,
            alpha=0.45,
        )
        floor = pareto.bias_floor(chart, curve)
        if floor is not None:
            axes.axvline(floor, color=colour, ls=":", lw=1)


def _points(axes, results: Results, chart: Chart, zero: float, markers: dict) -> None:
    # Faint points first, so that the front is on top.
    for number, point in sorted(enumerate(chart.points), key=lambda pair: pair[1].share):
        x, time = chart.drawn(point) or zero, point.time
        colour = style.colour(point.cell.variant, results.variants)
        look = {"color": colour, "alpha": FAINT + (1 - FAINT) * point.share, "zorder": 3 + point.share}
        if time.low is not None:
            axes.plot([x, x], [time.low, time.high], lw=0.9, **look)
        (drawn,) = axes.plot([x], [time.value], markers[point.cell], ms=5, mew=0, **look)
        drawn.set_gid(f"method-{number}")


def _front(axes, chart: Chart, zero: float) -> None:
    """Draws stairs through the points of the front and on to the edges."""
    front = chart.front[::-1]
    right, top = axes.get_xlim()[1], axes.get_ylim()[1]
    errors = [chart.drawn(point) or zero for point in front]
    across = [errors[0], *errors, right]
    up = [top, *(point.time.value for point in front), front[-1].time.value]
    axes.step(across, up, where="post", color="#444444", lw=0.8, zorder=2.5)


def _guides(axes) -> None:
    """Draws a fan of slopes in the upper right corner, which the front leaves free."""
    figure = axes.figure
    (left, right), (low, high) = np.log(axes.get_xlim()), np.log(axes.get_ylim())
    box = axes.get_window_extent()
    wide, tall = box.width / (right - left), box.height / (high - low)
    start = np.array([box.x1 - 1.15 * figure.dpi, box.y1 - 0.12 * figure.dpi])
    back = axes.transAxes.inverted().transform
    for name, fall, inches in GUIDES:
        step = np.array([wide, -fall * tall])
        end = start + step / np.hypot(*step) * inches * figure.dpi
        (x0, y0), (x1, y1) = back(start), back(end)
        axes.plot([x0, x1], [y0, y1], transform=axes.transAxes, color="#666666", lw=0.7)
        axes.text(
            x1, y1, name.replace("-", "−"), transform=axes.transAxes, ha="center", va="center", fontsize=6.5,
            path_effects=style.OUTLINE, color="#444444",
        )  # fmt: skip
    x, y = back(start)
    axes.text(
        x, y + 0.005, "error ∝ Nˢ", transform=axes.transAxes, ha="center", va="bottom", fontsize=6.5, color="#444444"
    )


def _numbers(axes, chart: Chart, zero: float, upright: list) -> None:
    """Numbers the points of the front, each where it covers least, and rings the fastest below a visible step.

    upright: texts, from bottom to top, that a number must not cover either.
    """
    inch = axes.figure.dpi / 72
    taken = [axes.transData.transform((chart.drawn(p) or zero, p.time.value)) for p in chart.points]
    for text in upright:
        box = text.get_window_extent()
        taken += [np.array([(box.x0 + box.x1) / 2, y]) for y in np.arange(box.y0, box.y1, 4 * inch)]
    for point in chart.front:
        at = axes.transData.transform((chart.drawn(point) or zero, point.time.value))
        places = [
            at + radius * inch * np.array([np.cos(angle), np.sin(angle)])
            for radius in (9, 13, 18, 24)
            for angle in np.radians([225, 180, 270, 45, 0, 90, 135, 315])
        ]
        # A number is wider than high.
        covers = [sum(np.hypot(*((np.array(taken) - place) / (1.6, 1)).T) < 8 * inch) for place in places]
        best = places[int(np.argmin(covers))]
        taken.append(best)
        x, y = axes.transData.inverted().transform(best)
        axes.text(
            x, y, str(point.number), ha="center", va="center", fontsize=7, fontweight="bold", zorder=6,
            path_effects=style.OUTLINE,
        )  # fmt: skip
    visible = [point for point in chart.front if point.error <= VISIBLE]
    if visible:
        first = visible[0]
        axes.plot(
            [chart.drawn(first) or zero], [first.time.value], "o", ms=10, mfc="none", mec="black", mew=0.9, zorder=5
        )


def _fastest(results: Results, chart: Chart) -> list[str]:
    """Returns a sentence on the fastest method with an invisible error, in lines."""
    cheapest = chart.cheapest(results, VISIBLE)
    if isinstance(cheapest, Missing):
        return [f"fastest below 1/255: {cheapest}"]
    first, rivals = cheapest
    doubt = f"; not resolved from {' / '.join(point.name for point in rivals)}" if rivals else ""
    text = f"fastest below 1/255: {first.name}, {quantity.seconds(first.time)} (number {first.number}, ringed){doubt}"
    return textwrap.wrap(text, 130)[:3]


def _titled(path: Path, results: Results, chart: Chart) -> None:
    """Writes each point's name and command into the SVG file; viewers show them at the pointer."""
    text = path.read_text(encoding="utf-8")
    for number, point in enumerate(chart.points):
        place = f"{point.number}: " if point.number else ""
        title = (
            f"{place}{point.name}, error {accuracy_columns.shown_rmse(point.cell)}, {quantity.seconds(point.time)}: "
        )
        title += str(command.of(results, point.cell))
        mark = f'<g id="method-{number}">'
        text = text.replace(mark, f"{mark}\n    <title>{escape(title, quote=False)}</title>", 1)
    output.text(path, text)


def write(results: Results, out: Path) -> str:
    """Writes pareto-NUMBER-VIEW.csv for each view, and .png and .svg where errors differ; returns the section.

    "" without errors.
    """
    charts = pareto.charts(results)
    if not charts:
        return ""
    parts = [f"## {TITLE}"]
    drawn = [chart for chart in charts if chart.trades]
    shown = set(map(id, thinning.few(drawn, MOST)))
    for number, chart in enumerate(charts):
        name = f"pareto-{number}-{markdown.slug(chart.view.label)}"
        pareto_table.write_csv(results, chart, out / f"{name}.csv")
        if chart.points and id(chart) not in shown:
            continue  # or its errors are equal
        parts.append(f"### {markdown.escape(chart.view.title)}")
        if chart.points:
            parts.append(style.figure(out / name, f"{TITLE}: {chart.view.title}", draw, results, chart))
            if (out / f"{name}.svg").exists():
                _titled(out / f"{name}.svg", results, chart)
            parts += pareto_table.front(results, chart)
        else:
            parts.append("unavailable: no method has both a time and an error.")
        parts += [*pareto_table.left_out(chart), f"Every method: [{name}.csv]({name}.csv)"]
    parts.append(thinning.note(len(shown), len(drawn), "charts", "the CSV files have all"))
    parts.append(_equal([chart for chart in charts if chart.points and not chart.trades]))
    return "\n\n".join(filter(None, [*parts, _never(drawn), markdown.escape(CAPTION)]))


def _never(charts: list[Chart]) -> str:
    """Names the variants and methods that are dominated in all charts where errors differ."""
    names = [
        f"{'; '.join(names[:MOST_NAMED])}{f'; and {len(names) - MOST_NAMED} more' * (len(names) > MOST_NAMED)} ({what})"
        for names, what in zip(pareto.never_pays(charts), ("by any method", "by any renderer"), strict=True)
        if names
    ]
    return markdown.escape(f"Not on any front: {'; '.join(names)}.") if names else ""


def _equal(charts: list[Chart]) -> str:
    """Names the views in which only time tells the methods apart."""
    if not charts:
        return ""
    names = [chart.view.label for chart in charts[:MOST_NAMED]]
    more = f"; and {len(charts) - len(names)} more" * (len(charts) > len(names))
    return markdown.escape(
        f"Not drawn, as all methods have the same error, so that times decide: {'; '.join(names)}{more}."
    )
