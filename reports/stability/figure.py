"""Draws a chart for each row of the catalogue of failures: share of wrong answers and their error, by stress."""

import math
import textwrap
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.lines import Line2D

from reports.paper import markdown, style, table
from reports.run.results import Results
from reports.stability import memory, stability, threads
from reports.stability import style as look
from reports.stability.stability import Curve, Row

TITLE = "Where methods break, row by row"
CAPTION = (
    "Left: the share of wrong answers at each level, with its 95 % interval: Wilson's, or the rule of three where none "
    "or all fail, as if answers failed independently. The dotted grey line is 3 / n, the largest share that 0 failures "
    "of n leave possible. A mark is full where a curve breaks: at the first level with a failure. Upright lines: the "
    "level at which theory lets a method break, where the chart contains it. Right: the error of answers that have "
    "one; the line is the median, the thin one above it the 99th percentile, the dotted one the theory. 0 is at the "
    "lower edge. Curves of a row with the same precision have the same inputs at a level."
)
CSV_HEADER = (
    "row", "code", "variant", "precision", "way", "naive", "level", "count", "failures", "share", "share_low",
    "share_high", "breaks_here", "error_median", "error_p99", "error_max", "expected_error", "expected_break", "status",
    "note",
)  # fmt: skip

OWN = {"S21": memory, "S24": threads}  # rows with a different chart, by code


def write(results: Results, out: Path) -> str:
    """Writes stability-NAME.png and .svg for each row, and stability.csv; returns the section of the report."""
    rows = stability.rows(results)
    parts = [f"## {TITLE}", markdown.escape(CAPTION)]
    for row in rows:
        parts += _section(results, row, out)
    table.write_lines(out / "stability.csv", CSV_HEADER, _csv(rows))
    return "\n\n".join([*parts, "Every point of every row: [stability.csv](stability.csv)."])


def _section(results: Results, row: Row, out: Path) -> list[str]:
    title = f"{row.label}: {row.facts['title']}"
    parts = [f"### {markdown.escape(title)}"]
    own = OWN.get(row.facts["code"])
    if own.drawable(row) if own else any(curve.answered for curve in row.curves):
        path = out / f"stability-{markdown.slug(row.name)}"
        parts.append(style.figure(path, title, own.draw if own else draw, results, row))
    words = f"{caption(row)} {own.caption(row)}" if own else caption(row)
    return [*parts, markdown.escape(words), *missing(row)]


def caption(row: Row) -> str:
    """Returns the caption of a row: what counts as a failure, and its source."""
    counts = sorted({point.answers["count"] for curve in row.curves for point in curve.answered})
    number = " to ".join(dict.fromkeys(map(str, (counts[0], counts[-1])))) if counts else "no"
    parts = [f"Failures: {row.facts['failure']}, of {number} answers per level."]
    if row.facts["error"]:
        parts.append(f"Error: {row.facts['error']}.")
    if row.facts["aligned"]:
        parts.append(f"The aligned twin of {row.facts['aligned']}.")
    if row.facts["source"]:
        parts.append(f"Source: {row.facts['source']}.")
    return " ".join(parts)


def missing(row: Row) -> list[str]:
    """Lists the cells without an answer, by reason; [] if there are none."""
    reasons: dict[str, Counter] = {}
    for curve in row.curves:
        for why, points in curve.missing.items():
            reasons.setdefault(why, Counter())[curve.variant] += len(points)
    cells = {why: ", ".join(f"{variant} in {n}" for variant, n in counts.items()) for why, counts in reasons.items()}
    return markdown.listed("Unavailable:", [f"{who} of {len(row.cells)} cells: {why}" for why, who in cells.items()])


def draw(results: Results, row: Row):
    """Draws a row with some answers."""
    errors = [value for curve in row.curves for point in curve.answered for value in _errors(point)]
    wide = 7.2 if errors else 5.0
    figure, panels = plt.subplots(1, 1 + bool(errors), figsize=(wide, 2.9), squeeze=False, layout="constrained")
    _failures(panels[0, 0], row)
    if errors:
        _error(panels[0, 1], row, errors)
    handles, labels = look.key(row)
    handles.append(Line2D([], [], ls="", marker="o", ms=5, color="black", mew=0))
    labels.append("full: where it breaks")
    if any(curve.expected or curve.limit for curve in row.curves):
        handles.append(Line2D([], [], color="black", lw=0.9, ls=look.THEORY))
        labels.append("theory")
    title = f"{row.label}: {row.facts['title']}"
    look.frame(figure, title, (handles, labels), look.origin(results, row.cells))
    return figure


def _errors(point) -> list[float]:
    return [point.answers[name] for name in ("error_median", "error_p99") if point.answers[name] is not None]


def _lines(row: Row):
    """Yields curves with answers and their look; lower ones are wider, so that equal curves are all visible."""
    shades = look.colours(row.ways)
    for place, way in reversed(list(enumerate(row.ways))):
        below = min(place, 4)
        for curve in row.curves:
            if curve.way == way and curve.answered:
                marks = look.marker(curve.variant, row.variants, 0.9 * below)
                yield curve, {"color": shades[way], "ls": look.line(curve.precision), "lw": 0.9 + 0.5 * below}, marks


def _failures(axes, row: Row) -> None:
    shares = []
    for curve, drawn, marks in _lines(row):
        values = [100 * point.share if point.answered else math.nan for point in curve.points]
        shares += values
        axes.plot([point.level for point in curve.points], values, **drawn, **marks)
        some = [(point.level, *(100 * end for end in point.interval)) for point in curve.answered if point.fails]
        if some:
            axes.vlines(*zip(*some, strict=True), color=drawn["color"], lw=0.7, alpha=0.6)
        if curve.broken:
            full = {**marks, "mfc": drawn["color"], "mew": 0}
            axes.plot(curve.broken.level, 100 * curve.broken.share, color=drawn["color"], zorder=3, **full)
    least = min(point.answers["count"] for curve in row.curves for point in curve.answered)
    bound = 100 * stability.interval(0, least)[1]
    axes.axhline(bound, color=look.GREY, lw=0.7, ls=":")
    look.stress_axis(axes, row)
    look.amount_axis(axes, [*shares, bound], 100)
    axes.set_ylabel("wrong answers (%)")
    _limits(axes, row)


def _limits(axes, row: Row) -> None:
    """Marks where theory lets each way break, in each precision."""
    low, high = sorted(axes.get_xlim())
    limits: dict[tuple, list[str]] = {}
    for curve, drawn, _ in _lines(row):
        if curve.limit is not None and low <= curve.limit <= high and curve is _first(row, curve):
            precisions = limits.setdefault((curve.limit, drawn["color"]), [])
            precisions.append(curve.precision.removeprefix("float"))
    heights = {colour: 1 + 0.05 * place for place, colour in enumerate(dict.fromkeys(colour for _, colour in limits))}
    for (limit, colour), precisions in limits.items():
        axes.axvline(limit, color=colour, lw=0.8, ls=look.THEORY, zorder=1)
        axes.text(limit, heights[colour], ", ".join(sorted(set(precisions))), fontsize=look.SMALL, color=colour,
                  ha="center", va="bottom", transform=axes.get_xaxis_transform())  # fmt: skip


def _first(row: Row, curve: Curve) -> Curve:
    """Returns the first of the curves that differ from this one only in the variant."""
    return next(c for c in row.curves if (c.precision, c.way) == (curve.precision, curve.way) and c.answered)


def _error(axes, row: Row, errors: list[float]) -> None:
    for curve, drawn, marks in _lines(row):
        for name, width in (("error_median", drawn["lw"]), ("error_p99", 0.4)):
            numbers = [point.answers[name] if point.answered else None for point in curve.points]
            values = [math.nan if value is None else value for value in numbers]
            marked = marks if name == "error_median" else {}
            axes.plot([point.level for point in curve.points], values, **{**drawn, "lw": width}, **marked)
        if curve.expected and curve is _first(row, curve):
            axes.plot(*zip(*curve.expected, strict=True), **{**drawn, "ls": look.THEORY, "lw": 0.9}, zorder=1)
    look.stress_axis(axes, row)
    look.amount_axis(axes, errors)
    axes.set_ylabel(textwrap.fill(row.facts["error"] or "error", 34))


def _csv(rows: list[Row]) -> Iterator[tuple]:
    for row in rows:
        for curve in row.curves:
            head = row.name, row.facts["code"], curve.variant, curve.precision, curve.way.name, curve.way.naive
            yield from ((*head, *_fields(curve, point)) for point in curve.points)


def _fields(curve: Curve, point) -> tuple:
    if not point.answered:
        return point.level, *[None] * 11, point.status, str(point.answers)
    answers = point.answers
    errors = (answers[name] for name in ("error_median", "error_p99", "error_max", "expected", "limit"))
    counted = answers["count"], answers["failures"], point.share, *point.interval
    note = "none" if point.status == "ok" else point.cell.reason
    return point.level, *counted, point is curve.broken, *errors, point.status, note
