"""Draws what a run varies: time, error, peak memory and rays against each number, a line for each renderer."""

import itertools
import math
import textwrap
from collections.abc import Iterator
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.lines import Line2D
from matplotlib.transforms import Bbox

from reports.paper import heat_map, markdown, quantity, style, table, thinning
from reports.run import gpu, launch
from reports.run.results import Missing, Results, grouped
from reports.run.words import all_against
from reports.scaling import crossing, sweep
from reports.scaling.crossing import Crossing, Scale
from reports.scaling.sweep import ERROR, MEMORY, QUANTITIES, RAYS, TIME, Line, Panel, Quantity

TITLE = "Sweeps: what grows with what"
CAPTION = (
    "A panel for each number that the run varies; its title has the others. A line for each renderer or method, "
    "medians over processes, ranked cells alone; bands: 95 % intervals, where there are enough processes. Error: the "
    "worst process's. Rays: primary, reflected, transmitted and shadow rays. Where lines lie on each other, the "
    "wider one is behind. Ringed and numbered: where one line crosses another, interpolated on the chart's axes; only "
    "where intervals on both sides order the two differently, by more than the noise floor. Light: slope 1, twice as "
    "much takes twice as long; dotted: slope 2."
)
OF_LAUNCHES = (
    "Shapes of blocks and total numbers of threads of a GPU are in the sections on the study's figures 2.7 and 2.8."
)
MOST = 12  # panels of a figure
MOST_LINES = 16  # of a panel
MOST_CROSSINGS = 24
RING = 8  # points across the ring of a crossing
AROUND = (8, 8), (-8, -8), (-8, 8), (8, -8), (11, 0), (-11, 0), (0, 10), (0, -10)
BESIDE = [(reach * x, reach * y) for reach in (1, 1.6, 2.2, 2.8) for x, y in AROUND]  # points from a ring to its number
DASHES = "-", "--", ":", "-."
MARKERS = "osD^vP*X<>ph"
WIDTH, HIGH = 7.4, 2.5  # inches of a figure, and of a row of panels
NARROW = 4.4  # inches of a figure with one panel
HIGHEST = 12.0  # inches: a page
LETTER = 0.058  # inches of a letter
LEVEL, STEEP = 0.3, 1.4  # slopes of a line above which a guide of slope 1, and of 2, is drawn
GUIDES = {1: {"color": "#CCCCCC", "lw": 0.7, "ls": "-"}, 2: {"color": "#AAAAAA", "lw": 0.8, "ls": ":"}}
SAME = 1e-6  # of a quantity: it does not vary
UNITS = {
    TIME: quantity.SECONDS,
    ERROR: ((1.0, ""),),
    MEMORY: quantity.BYTES,
    RAYS: ((1e6, "millions"), (1e3, "thousands"), (1.0, "")),
}
SHOW = {TIME: quantity.seconds, MEMORY: quantity.size}
CSV_HEADER = (
    "quantity", "unit", "axis", "panel", "line", "x", "value", "low", "high", "processes", "note",
)  # fmt: skip
CROSSINGS_HEADER = "quantity", "axis", "panel", "number", "line", "other", "x", "y", "between_low", "between_high"


def ranked(panels: list[Panel]) -> list[Panel]:
    """Returns panels, first the largest of each axis, then the second of each, ..."""
    ranks = {}
    for group in grouped(panels, lambda panel: panel.axis.name).values():
        largest_first = sorted(group, key=lambda panel: -sum(len(line.points(TIME)) for line in panel.lines))
        ranks |= {panel: rank for rank, panel in enumerate(largest_first)}
    return sorted(panels, key=ranks.get)


def shown(panels: list[Panel]) -> list[Panel]:
    """Returns at most MOST panels in their order, the largest ones of each axis."""
    kept = set(ranked(panels)[:MOST])
    return [panel for panel in panels if panel in kept]


def lines(panel: Panel, what: Quantity) -> list[Line]:
    """Returns at most MOST_LINES lines with values of a quantity, those of one point only where there are no others."""
    counts = [(line, len(line.points(what))) for line in panel.lines]
    least = 2 if any(count > 1 for _, count in counts) else 1
    return thinning.few([line for line, count in counts if count >= least], MOST_LINES)


def looks(results: Results, panels: list[Panel]) -> dict[str, dict]:
    """Returns for each label of a line the colour of its variant, and a marker and dashes of its own among that's."""
    cycles: dict[str, Iterator] = {}
    styles: dict[str, dict] = {}
    for line in (line for panel in panels for line in panel.lines):
        if line.label not in styles:
            at = next(cycles.setdefault(line.variant, itertools.count()))
            styles[line.label] = {
                "color": style.colour(line.variant, results.variants), "marker": MARKERS[at % len(MARKERS)],
                "ls": DASHES[at % len(DASHES)],
            }  # fmt: skip
    return styles


Numbered = dict[Panel, list[tuple[int, Crossing]]]


def crossings(results: Results, panels: list[Panel], what: Quantity) -> Numbered:
    """Returns the crossings of the lines of each panel, numbered from 1."""
    scale = crossing.upright(crossing.values(panels, what))
    floor = results.floor.value if what is TIME else None
    number = itertools.count(1)
    by_panel = {panel: crossing.crossings(panel, lines(panel, what), what, scale, floor) for panel in panels}
    return {panel: [(next(number), meeting) for meeting in meetings] for panel, meetings in by_panel.items()}


def draw(results: Results, panels: list[Panel], what: Quantity, crossings: Numbered):
    """Draws panels, of which at least one has a value."""
    panels = [panel for panel in panels if lines(panel, what)]
    columns = min(len(panels), 2 if len(panels) < 5 else 3)
    rows = -(-len(panels) // columns)
    of, labels = looks(results, panels), list(dict.fromkeys(line.label for p in panels for line in lines(p, what)))
    wide = WIDTH if columns > 1 else NARROW
    beside = max(1, min(4, int(wide / (0.5 + LETTER * max(map(len, labels))))))
    below = 0.3 + 0.16 * -(-(len(labels) + 2) // beside)
    high = min(HIGH * rows + below, HIGHEST)
    figure, every = plt.subplots(rows, columns, figsize=(wide, high), sharey=True, squeeze=False, layout="constrained")
    values = crossing.values(panels, what)
    upright, (unit, name) = crossing.upright(values), unit_of(values, what)
    drawn = list(zip(every.flat, panels, strict=False))
    for number, (axes, panel) in enumerate(drawn):
        _panel(axes, panel, what, Scale(upright.name, upright.least / unit), unit, 0.75 * wide / columns, of)
        axes.set_title(textwrap.fill(panel.label, int(17 * wide / columns)), loc="left", fontsize=style.SMALL)
        if number % columns == 0:
            axes.set_ylabel(f"{what.title} ({name})" if name else what.title)
        style.across(axes, panel.mark)
    if upright.name == "linear" and min(values) >= 0:
        every[0, 0].set_ylim(bottom=0)
    slopes = {slope for axes, panel in drawn for slope in _guides(axes, panel, what)}
    for axes in every.flat[len(panels) :]:
        axes.remove()
    handles = [Line2D([], [], lw=1.3, ms=3.5, label=label, **of[label]) for label in labels]
    handles += [Line2D([], [], label=f"slope {slope}", **GUIDES[slope]) for slope in sorted(slopes)]
    figure.legend(handles=handles, loc="outside lower center", ncols=beside)
    against = all_against(cell.against for panel in panels for line in panel.lines for _, cell in line.cells)
    if what is ERROR and against:
        style.entitle(figure, f"errors: {against}")
    if any(crossings.get(panel) for panel in panels):
        figure.draw_without_rendering()  # lays the panels out: numbers need to know where their rings are
        for axes, panel in drawn:
            meetings = crossings.get(panel, ())[:MOST_CROSSINGS]
            _mark(axes, [(number, meeting.x, meeting.y / unit) for number, meeting in meetings])
    return figure


def unit_of(values: list[float], what: Quantity) -> tuple[float, str]:
    """Returns size and name of the unit that suits the middle of the values of a quantity."""
    some = [value for value in values if value > 0]
    return quantity.unit(math.sqrt(min(some) * max(some)), UNITS[what]) if some else (1.0, "")


def _panel(axes, panel: Panel, what: Quantity, upright: Scale, unit: float, wide: float, of: dict) -> None:
    drawn, scale = lines(panel, what), crossing.across(panel.values)
    for set_scale, axis_scale in ((axes.set_xscale, scale), (axes.set_yscale, upright)):
        set_scale(axis_scale.name, **axis_scale.options)
    alike = what in (ERROR, RAYS)  # right pictures have the same, whoever makes them
    for number, line in enumerate(drawn):
        points = line.points(what)
        x, y = [x for x, _ in points], [value.value / unit for _, value in points]
        wider = 4 * (len(drawn) - 1 - number) / len(drawn) if alike else 0
        axes.plot(x, y, lw=1.3 + wider, ms=3.5, zorder=2 + number / 100, **of[line.label])
        ends = [
            [np.nan if end is None else end / unit for end in pair]
            for pair in ((value.low, value.high) for _, value in points)
        ]
        look = {"color": of[line.label]["color"], "alpha": 0.2}
        if len(points) > 1:
            axes.fill_between(x, *zip(*ends, strict=True), lw=0, zorder=1.5, **look)
        else:
            axes.plot(x * 2, ends[0], lw=4, **look)
    _ticks(axes, panel, scale, wide)
    if upright.name != "linear":
        style.log_ticks(axes.yaxis)
    axes.grid(color="#EEEEEE")


def _ticks(axes, panel: Panel, scale: Scale, wide: float) -> None:
    """Labels those values of an axis for which there is room, of a linear one only if they are few. wide: inches."""
    axes.set_xlabel(panel.axis.name)
    values, kept = panel.values, []
    if scale.name == "linear" and len(values) > 3:
        return
    names = [tick(panel, value) for value in values]
    at = scale.transform.transform(np.array(values, dtype=float))
    at = wide * (at - at[0]) / (at[-1] - at[0])
    for n, name in enumerate(names):
        if not kept or at[n] - at[kept[-1]] > LETTER * (2 + (len(name) + len(names[kept[-1]])) / 2):
            kept.append(n)
    axes.set_xticks([values[n] for n in kept], [names[n] for n in kept])
    axes.xaxis.minorticks_off()


def tick(panel: Panel, value: float) -> str:
    """Returns a value of an axis as its label, pixels of square pictures by their side: "64²"."""
    return f"{sweep.digits(math.sqrt(value))}²" if panel.squares else sweep.digits(value)


def _mark(axes, rings: list[tuple[int, float, float]]) -> None:
    """Draws rings (number, x, y), each with its number beside it, where that covers the fewest rings and numbers."""
    places = [axes.transData.transform((x, y)) for _, x, y in rings]
    points = axes.figure.dpi / 72
    taken = [Bbox.from_extents(*(place - RING / 2 * points), *(place + RING / 2 * points)) for place in places]
    for number, x, y in rings:
        axes.plot(x, y, "o", ms=RING, mfc="none", mec="black", mew=0.9, zorder=5)
        name = axes.annotate(
            str(number), (x, y), (0, 0), textcoords="offset points", fontsize=7, fontweight="bold", zorder=6,
            path_effects=style.OUTLINE, ha="center", va="center",
        )  # fmt: skip
        candidates = []
        for offset in BESIDE:
            name.xyann = offset
            box = name.get_window_extent()
            outside = not (axes.bbox.contains(*box.p0) and axes.bbox.contains(*box.p1))
            candidates.append((box.count_overlaps(taken) + outside, len(candidates), offset, box))
        _, _, name.xyann, box = min(candidates, key=lambda candidate: candidate[:2])
        taken.append(box)


def _guides(axes, panel: Panel, what: Quantity) -> list[int]:
    """Draws light lines of slope 1, and of 2 where a line is steep, over a chart with two logarithmic axes."""
    if what is ERROR or (axes.get_xscale(), axes.get_yscale()) != ("log", "log"):
        return []
    ends = [(points[0], points[-1]) for line in lines(panel, what) if len(points := line.points(what)) > 1]
    steepest = max((math.log(b[1].value / a[1].value) / math.log(b[0] / a[0]) for a, b in ends), default=0.0)
    slopes = [slope for slope, least in ((1, LEVEL), (2, STEEP)) if steepest > least]
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    for slope in slopes:
        first, last = math.log10(low / right**slope), math.log10(high / left**slope)
        for power in range(math.ceil(first), math.ceil(last), slope):
            axes.plot([left, right], [10.0**power * x**slope for x in (left, right)], zorder=1, **GUIDES[slope])
    axes.set(xlim=(left, right), ylim=(low, high))
    return slopes


def write(results: Results, out: Path) -> str:
    """Writes sweeps-QUANTITY.png, .svg and .pdf, sweeps.csv and sweeps-crossings.csv; returns the section.

    "" if the run varies no number.
    """
    every = sweep.panels(results)
    if not every:
        return ""
    panels, numbered = shown(every), {}
    parts = [f"## {TITLE}"]
    for what in QUANTITIES:
        numbered[what] = crossings(results, panels, what)
        parts += _part(results, panels, what, numbered[what], out)
    if len(panels) < len(every):
        parts.append(
            f"Shown are {len(panels)} of {len(every)} panels, the largest of each number; the CSV file has all."
        )
    if any(key in cell.swept for cell in results.cells for key in launch.SHAPE):
        parts.append(OF_LAUNCHES)
    parts += _maps(results, out) + markdown.listed("Without a point:", _left_out(every))
    table.write_lines(out / "sweeps.csv", CSV_HEADER, _csv(every))
    table.write_lines(out / "sweeps-crossings.csv", CROSSINGS_HEADER, _crossings_csv(numbered))
    files = ", ".join(f"[{name}]({name})" for name in ("sweeps.csv", "sweeps-crossings.csv"))
    return "\n\n".join([*parts, f"Every point and crossing: {files}.", markdown.escape(CAPTION)])


def _part(results: Results, panels: list[Panel], what: Quantity, numbered: Numbered, out: Path) -> list[str]:
    """Returns the figure of a quantity and its crossings in words; a sentence if it does not vary."""
    values = crossing.values(panels, what)
    if not values:
        why = [what.of(cell) for panel in panels for line in panel.lines for _, cell in line.cells]
        return [markdown.escape(f"The {what.title} is {why[0]}.")]
    if max(values) - min(values) <= SAME * abs(max(values)):
        return [f"The {what.title} is {SHOW.get(what, sweep.digits)(values[0])} everywhere."]
    parts = [style.figure(out / f"sweeps-{what.name}", f"{TITLE}: {what.title}", draw, results, panels, what, numbered)]
    every = [(panel, number, meeting) for panel, meetings in numbered.items() for number, meeting in meetings]
    said = [f"({number}) {words(panel, what, meeting)}" for panel, number, meeting in every[:MOST_CROSSINGS]]
    if every:
        parts.append(markdown.bullets([markdown.escape(text) for text in said]))
        parts.append(thinning.note(len(said), len(every), "crossings", "the CSV file has all"))
    elif what is TIME and any(len(panel.lines) > 1 for panel in panels):
        parts.append("No line crosses another where it is resolved.")
    return list(filter(None, parts))


def words(panel: Panel, what: Quantity, meeting: Crossing) -> str:
    """Says where a line crosses another: "numba overtakes cpp at about 300 × 300 pixels, between .. and .."."""
    near = float(f"{math.sqrt(meeting.x):.2g}") ** 2 if panel.squares else float(f"{meeting.x:.2g}")
    place, *ends = (panel.words(value) for value in (near, *meeting.between))
    ends[0] = ends[0].removesuffix(f" {panel.axis.unit}")
    where = f" ({panel.label})" if panel.label else ""
    return (
        f"{meeting.line.label} {what.crosses} {meeting.other.label} at about {place}, between {ends[0]} and {ends[1]}"
        f"{where}."
    )


def _left_out(panels: list[Panel]) -> list[str]:
    """Returns an item for each line and reason why cells of it have no time."""
    lacking: dict[tuple[str, str], set] = {}
    for line in (line for panel in panels for line in panel.lines):
        for _, cell in line.cells:
            if isinstance(why := TIME.of(cell), Missing):
                lacking.setdefault((line.label, str(why)), set()).add(cell)
    return [f"{label} ({len(cells)} cell{'s' * (len(cells) > 1)}): {why}" for (label, why), cells in lacking.items()]


def _maps(results: Results, out: Path) -> list[str]:
    """Returns heat maps of the time by two numbers, of a run of one renderer and method."""
    parts = []
    for number, (first, other, label, cells) in enumerate(sweep.crossed(results)):
        times = {at: TIME.of(cell) for at, cell in cells.items()}
        estimates = {at: None if isinstance(time, Missing) else time for at, time in times.items()}
        if any(estimates.values()):
            columns, rows = (
                {value: sweep.digits(value) for value in sorted(set(ends))} for ends in zip(*cells, strict=True)
            )
            shown = heat_map.Map(columns, rows, estimates, first.name, other.name, TIME.title)
            title = f"Time by {first.name} and {other.name}"
            drawn = shown, f"{title}\n{label}", gpu.mark(results, list(cells.values()))
            parts.append(style.figure(out / f"sweeps-map-{number}", f"{title}: {label}", heat_map.draw, *drawn))
    return [*parts, heat_map.CAPTION] if parts else []


def _csv(panels: list[Panel]) -> Iterator[tuple]:
    for what, panel in itertools.product(QUANTITIES, panels):
        for line in panel.lines:
            for x, cell in line.cells:
                value = what.of(cell)
                measured = not isinstance(value, Missing)
                numbers = (value.value, value.low, value.high, value.processes) if measured else (None, None, None, 0)
                note = value.note if measured else str(value)
                yield what.name, what.unit, panel.axis.name, panel.label, line.label, x, *numbers, note


def _crossings_csv(numbered: dict[Quantity, Numbered]) -> Iterator[tuple]:
    for what, of in numbered.items():
        for panel, meetings in of.items():
            for number, meeting in meetings:
                names = panel.axis.name, panel.label, number, meeting.line.label, meeting.other.label
                yield what.name, *names, meeting.x, meeting.y, *meeting.between
