"""Draws row S21: the memory of a pixel by depth, for each way to walk the tree of its rays."""

import matplotlib.pyplot as plt

from reports.run.results import Results
from reports.stability import style as look
from reports.stability.stability import Row

CAPTION = (
    "Marks: bytes that the renderer reports for a pixel in work; dotted: theory. A table has a row for each of the "
    "2^(d + 1) - 1 rays that a pixel can have up to depth d, a stack and recursion at most d + 1, a chain, which "
    "follows one ray after the other, one. A mark is full where the pixel is wrong."
)


def caption(row: Row) -> str:
    """Returns the caption: what the chart shows, and which variants report no memory."""
    silent = [f"{curve.variant} ({curve.precision}, {curve.way.name})" for curve in row.curves
              if curve.answered and not _points(curve)]  # fmt: skip
    return f"{CAPTION} Bytes unavailable, not reported: {', '.join(silent)}." if silent else CAPTION


def drawable(row: Row) -> bool:
    """Is there anything to draw?"""
    return any(map(_points, row.curves))


def _points(curve) -> list[tuple[float, float]]:
    return [(p.level, p.answers["error_median"]) for p in curve.answered if p.answers["error_median"] is not None]


def draw(results: Results, row: Row):
    """Draws the row; some of its cells report bytes."""
    figure, axes = plt.subplots(figsize=(5.4, 3.2), layout="constrained")
    shades, theory = look.colours(row.ways), set()
    for curve in row.curves:
        points = _points(curve)
        if not points:
            continue
        drawn = {"color": shades[curve.way], "ls": look.line(curve.precision), "lw": 0.9}
        marks = look.marker(curve.variant, row.variants)
        axes.plot(*zip(*points, strict=True), **drawn, **marks)
        wrong = [(p.level, p.answers["error_median"]) for p in curve.answered if p.fails and p.answers["error_median"]]
        if wrong:
            full = {**marks, "mfc": drawn["color"], "ls": ""}
            axes.plot(*zip(*wrong, strict=True), color=drawn["color"], **full)
        if curve.expected and (curve.way, curve.precision) not in theory:
            theory.add((curve.way, curve.precision))
            axes.plot(*zip(*curve.expected, strict=True), **{**drawn, "ls": look.THEORY}, zorder=1)
    look.stress_axis(axes, row)
    axes.set_yscale("log", base=10)
    axes.yaxis.set_major_formatter(lambda value, _: look.short(value))
    axes.yaxis.minorticks_off()
    axes.set_ylabel("bytes a pixel")
    look.frame(figure, f"{row.label}: {row.facts['title']}", look.key(row), look.origin(results, row.cells))
    return figure
