"""Draws row S24: whether the picture is the same, byte for byte, for any number of threads."""

import matplotlib.pyplot as plt

from harness.statistics.digits import percentage
from reports.run.results import Results
from reports.stability import style as look
from reports.stability.stability import Curve, Row

CAPTION = (
    "A full disc: every answer is right. A cross: the share of wrong answers. Empty: there is no answer, for the "
    "reason below."
)
RIGHT, WRONG = "#0072B2", "#D55E00"


def caption(row: Row) -> str:
    """Returns the caption of the chart."""
    return CAPTION


def drawable(row: Row) -> bool:
    """Is there anything to draw?"""
    return any(curve.answered for curve in row.curves)


def _name(row: Row, curve: Curve) -> str:
    way = f", {curve.way.name}" if len(row.ways) > 1 else ""
    return f"{curve.variant}, {curve.precision}{way}"


def draw(results: Results, row: Row):
    """Draws the row: a line for each curve, a column for each level."""
    levels = row.levels
    wide = max(4.6, 2.2 + 0.6 * len(levels))
    figure, axes = plt.subplots(figsize=(wide, 0.6 + 0.2 * len(row.curves)), layout="constrained")
    for place, curve in enumerate(row.curves):
        for point in curve.answered:
            x = levels.index(point.level)
            if point.fails:
                axes.plot(x, place, "x", color=WRONG, ms=6, mew=1.5)
                axes.text(x + 0.14, place, f"{percentage(point.share)}", va="center", fontsize=look.SMALL, color=WRONG)
            else:
                axes.plot(x, place, "o", color=RIGHT, ms=6, mew=0)
    axes.set_yticks(range(len(row.curves)), [_name(row, curve) for curve in row.curves], fontsize=look.SMALL)
    axes.set_xticks(range(len(levels)), [look.short(level) for level in levels])
    axes.set(xlim=(-0.5, len(levels) - 0.2), ylim=(len(row.curves) - 0.5, -0.5), xlabel=row.facts["stress"])
    axes.grid()
    look.frame(figure, f"{row.label}: {row.facts['title']}", ([], []), look.origin(results, row.cells))
    return figure
