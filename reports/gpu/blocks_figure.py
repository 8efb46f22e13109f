"""Draws figure 2.8: time by block size, with one thread per pixel."""

from pathlib import Path

from harness.statistics import statistics
from reports.gpu import launch_figure
from reports.paper import heat_map
from reports.run import gpu, launch
from reports.run.launch import Group
from reports.run.results import Cell, Results

TITLE = "Block sizes (the study's figure 2.8)"
HEADING = "Time by block size, one thread for each pixel (figure 2.8 of the study)"
CAPTION = (
    f"{heat_map.CAPTION} Framed: the lowest median, if its ratio to the next lowest is resolved (table of "
    "times). Grey: run, but not ranked. Blank: not run; a block has at most 1024 threads."
)


def of_scene(results: Results, scene: str) -> list[Group]:
    """Returns groups in which the block was swept, a cell per block: of several the one that asked for 0 threads."""
    full = [cell for cell in gpu.cells(results, scene) if gpu.threads(results, cell) >= cell.pixels]
    groups = []
    for group in launch.groups(full, launch.SHAPE):
        blocks: dict[tuple[int, int], Cell] = {}
        for cell in sorted(group.cells, key=lambda cell: cell.parameters.get("total_threads") != 0):
            blocks.setdefault(gpu.block(results, cell), cell)
        if len(blocks) > 1:
            groups.append(Group(group.label, list(blocks.values())))
    return groups


def draw(results: Results, group: Group):
    """Draws a group with at least one cell to draw."""
    column, clock = launch.clock(group.drawn)
    block = {cell: gpu.block(results, cell) for cell in group.cells}
    medians = {cell: statistics.median(cell.values(column)) for cell in group.drawn}
    widths, heights = ({side: str(side) for side in sorted({size[axis] for size in block.values()})} for axis in (0, 1))
    said, framed = launch_figure.best(results, group, column, lambda cell: "{} × {}".format(*block[cell]))
    shown = heat_map.Map(
        widths, heights, {size: medians.get(cell) for cell, size in block.items()}, "block width (threads)",
        "block height (threads)", clock, block.get(framed),
    )  # fmt: skip
    return heat_map.draw(shown, f"{HEADING}\n{group.label}{said}", gpu.mark(results, group.drawn))


def write(results: Results, out: Path) -> str:
    """Writes blocks-NUMBER-GROUP.png and .svg for each sweep; returns the section, "" if there is none."""
    return launch_figure.section(results, out, TITLE, of_scene, lambda *_: {"blocks": draw}, CAPTION)
