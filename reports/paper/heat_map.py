"""Draws a heat map: a value for each pair of two numbers, darker where it is smaller, on a logarithmic scale."""

from dataclasses import dataclass

import matplotlib.pyplot as plt
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from harness.statistics.statistics import Estimate
from reports.paper import quantity, style, thinning

SIDE = 0.58  # least side of a square, inches
MOST = 11, 16  # columns and rows
ROWS = 4  # of squares, beside which a bar of shades has room for many numbers
ROOMY = 8  # columns up to which an interval fits into a square
NARROW = 5.6  # least width, which a title needs, inches
LETTER = 0.075  # width of a letter beside the squares, inches
LINE = 0.15  # height of a line of the title, inches
CAPTION = (
    f"Median over processes, with up to {ROOMY} columns also its 95 % interval; darker is less, on a logarithmic "
    f"scale. Of more than {MOST[0]} columns or {MOST[1]} rows some, evenly spread."
)


@dataclass(frozen=True)
class Map:
    """What a heat map shows.

    columns, rows: names by key, in order. values: s by (column, row), None where there is a cell without a value.
    framed: the (column, row) of a square that stands out.
    """

    columns: dict
    rows: dict
    values: dict[tuple, Estimate | None]
    across: str
    upright: str
    what: str
    framed: tuple | None = None


def draw(shown: Map, title: str, mark: str = "") -> Figure:
    """Draws a map with at least one value. mark: see style.across."""
    columns, rows = map(thinning.few, (list(shown.columns), list(shown.rows)), MOST)
    values = {at: value for at, value in shown.values.items() if at[0] in columns and at[1] in rows}
    numbers = [value.value for value in shown.values.values() if value is not None]
    low, high = min(numbers), max(numbers)
    size, unit = quantity.unit(high)
    norm = LogNorm(low / size, max(high, low * 1.01) / size)
    beside = LETTER * max(len(shown.rows[row]) for row in rows)
    side = min(1.4, max(SIDE, 4.2 / len(columns)))  # a few squares are larger, as wide as the title
    wide = max(NARROW, side * len(columns) + 1.3 + beside)
    high = side * len(rows) + 0.7 + LINE * (1 + style.wrapped(title, wide).count("\n"))
    figure, axes = plt.subplots(figsize=(wide, high), layout="constrained")
    shades = plt.get_cmap("cividis")
    for (column, row), value in values.items():
        x, y = columns.index(column), rows.index(row)
        shade = None if value is None else norm(value.value / size)
        colour = "#E4E4E4" if value is None else shades(shade)
        axes.add_patch(Rectangle((x - 0.5, y - 0.5), 1, 1, facecolor=colour, edgecolor="white", lw=1))
        text = "not\nranked" if value is None else _number(value, 1 / size, len(columns) <= ROOMY)
        ink = style.FIXED_WHITE if value is not None and shade < 0.5 else style.FIXED_BLACK
        axes.text(x, y, text, ha="center", va="center", fontsize=6.5, color=ink)
    if shown.framed in values:
        x, y = columns.index(shown.framed[0]), rows.index(shown.framed[1])
        axes.add_patch(Rectangle((x - 0.47, y - 0.47), 0.94, 0.94, fill=False, edgecolor="#D55E00", lw=2.2, zorder=3))
    axes.set(xlim=(-0.5, len(columns) - 0.5), ylim=(-0.5, len(rows) - 0.5), aspect="equal")
    axes.set_xticks(range(len(columns)), [shown.columns[column] for column in columns])
    axes.set_yticks(range(len(rows)), [shown.rows[row] for row in rows])
    axes.set(xlabel=shown.across, ylabel=shown.upright)
    axes.spines[:].set_visible(False)
    axes.tick_params(length=0)
    style.entitle(figure, title)
    bar = figure.colorbar(plt.cm.ScalarMappable(norm, shades), ax=axes, shrink=0.8)
    bar.set_label(f"{shown.what} ({unit})")
    style.log_ticks(bar.ax.yaxis, narrow=len(rows) < ROWS)
    style.across(axes, mark)
    return figure


def _number(value: Estimate, scale: float, roomy: bool) -> str:
    if value.low is None or not roomy:
        return quantity.plain(value.value * scale)
    return quantity.text(value, scale).replace(" [", "\n[").replace(", all", "\nall")
