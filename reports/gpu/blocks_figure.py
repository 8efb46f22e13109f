"""Draws figure 2.8: time by block size, with one thread per pixel."""

from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.colors import LogNorm
from matplotlib.patches import Rectangle

from harness.statistics import statistics
from reports.gpu import launch_figure
from reports.paper import quantity, style
from reports.run import gpu, launch, ranking
from reports.run.launch import Group
from reports.run.results import Cell, Results

TITLE = "Block sizes (the study's figure 2.8)"
HEADING = "Time by block size, one thread for each pixel (figure 2.8 of the study)"
CAPTION = (
    "Median over processes of the time, below it its 95 % interval, where there are enough processes; darker is "
    "faster, on a logarithmic scale. Framed: the lowest median, if its ratio to the next lowest is resolved (table of "
    "times). Grey: run, but not ranked. Blank: not run; a block has at most 1024 threads."
)
SIDE = 0.62  # least side of a square, inches
UNITS = ("s", 1.0), ("ms", 1e3), ("µs", 1e6)


def of_scene(results: Results, scene: str) -> list[Group]:
    """Returns groups in which the block was swept, a cell per block: of several the one that asked for 0 threads."""
    full = [cell for cell in gpu.cells(results, scene) if gpu.threads(results, cell) >= cell.pixels]
    found = []
    for group in launch.groups(full, launch.SHAPE):
        blocks: dict[tuple[int, int], Cell] = {}
        for cell in sorted(group.cells, key=lambda cell: cell.parameters.get("total_threads") != 0):
            blocks.setdefault(gpu.block(results, cell), cell)
        if len(blocks) > 1:
            found.append(Group(group.label, list(blocks.values())))
    return found


def best(results: Results, cells: list[Cell], column: str) -> tuple[Cell, Cell | None, bool]:
    """Returns the cell with the lowest median, the next, and whether their ratio is resolved."""
    first, *others = sorted(cells, key=lambda cell: statistics.median(cell.values(column)).value)
    if not others:
        return first, None, False
    return first, others[0], ranking.resolved(results, ranking.ratio(others[0], first, column))


def draw(results: Results, group: Group):
    """Draws a group with at least one ranked cell."""
    column, clock = launch.clock(group.ranked)
    block = {id(cell): gpu.block(results, cell) for cell in group.cells}
    widths, heights = (sorted({size[axis] for size in block.values()}) for axis in (0, 1))
    medians = {id(cell): statistics.median(cell.values(column)) for cell in group.ranked}
    low, high = (function(median.value for median in medians.values()) for function in (min, max))
    unit, scale = next((pair for pair in UNITS if high * pair[1] >= 1), UNITS[-1])
    norm = LogNorm(low * scale, max(high, low * 1.01) * scale)
    side = min(1.4, max(SIDE, 4.2 / len(widths)))  # a few squares are larger, as wide as the title
    size = max(5.6, side * len(widths) + 1.4), side * len(heights) + 1.0
    figure, axes = plt.subplots(figsize=size, layout="constrained")
    shades = plt.get_cmap("cividis")
    for cell in group.cells:
        x, y = (places.index(side) for places, side in zip((widths, heights), block[id(cell)], strict=True))
        median = medians.get(id(cell))
        colour = "#E4E4E4" if median is None else shades(norm(median.value * scale))
        axes.add_patch(Rectangle((x - 0.5, y - 0.5), 1, 1, facecolor=colour, edgecolor="white", lw=1))
        text = "not\nranked" if median is None else _number(median, scale)
        dark = median is not None and norm(median.value * scale) < 0.5
        axes.text(x, y, text, ha="center", va="center", fontsize=6.5, color="white" if dark else "black")
    first, second, resolved = best(results, group.ranked, column)
    name = "{} × {}".format(*block[id(first)])
    said = f"fastest: {name}"
    if resolved:
        x, y = widths.index(block[id(first)][0]), heights.index(block[id(first)][1])
        axes.add_patch(Rectangle((x - 0.47, y - 0.47), 0.94, 0.94, fill=False, edgecolor="#D55E00", lw=2.2, zorder=3))
    elif second is not None:
        said = "lowest median: {}, not resolved from {} × {}".format(name, *block[id(second)])
    axes.set(xlim=(-0.5, len(widths) - 0.5), ylim=(-0.5, len(heights) - 0.5), aspect="equal")
    axes.set_xticks(range(len(widths)), widths)
    axes.set_yticks(range(len(heights)), heights)
    axes.set(xlabel="block width (threads)", ylabel="block height (threads)")
    axes.spines[:].set_visible(False)
    axes.tick_params(length=0)
    figure.suptitle(f"{HEADING}\n{group.label}; {said}", x=0.01, ha="left", fontsize=8)
    bar = figure.colorbar(plt.cm.ScalarMappable(norm, shades), ax=axes, shrink=0.8)
    bar.set_label(f"{clock} ({unit})")
    style.log_ticks(bar.ax.yaxis)
    return figure


def _number(median, scale: float) -> str:
    if median.low is None:
        return quantity.plain(median.value * scale)
    return quantity.text(median, scale).replace(" [", "\n[").replace(", all", "\nall")


def write(results: Results, out: Path) -> str:
    """Writes blocks-NUMBER-GROUP.png and .svg for each sweep; returns the section, "" if there is none."""
    return launch_figure.section(results, out, TITLE, "blocks", of_scene, draw, CAPTION)
