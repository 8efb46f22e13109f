"""Draws figure 2.7: time against the total number of threads, a line per block size; and a heat map of both."""

from collections.abc import Callable
from pathlib import Path

import matplotlib.pyplot as plt

from harness.statistics import statistics
from reports.paper import heat_map, markdown, style
from reports.run import gpu, launch, ranking
from reports.run.launch import Group
from reports.run.results import Cell, Results

TITLE = "Total number of threads (the study's figure 2.7)"
HEADING = "Time against the total number of threads (figure 2.7 of the study)"
MAPPED = "Time by block and total number of threads"
CAPTION = (
    "A line per block size, its threads across × down. Large: the median over processes with its 95 % interval, where "
    "there are enough processes; small: each process, the median of its steady frames. Threads are those launched, in "
    "whole blocks; where there are fewer threads than pixels, each renders several. Dotted: one thread per pixel. Only "
    f"ranked cells are drawn, or those of a simulator if that is all there is. Map: {heat_map.CAPTION} Framed: the "
    "lowest median, if its ratio to the next lowest is resolved. Grey: run, but not ranked."
)
MARKERS = "osD^vP*X<>ph"


def of_scene(results: Results, scene: str) -> list[Group]:
    """Returns groups in which the total number of threads was swept."""
    groups = launch.groups(gpu.cells(results, scene), launch.SHAPE)
    return [group for group in groups if len({cell.parameters.get("total_threads") for cell in group.cells}) > 1]


def draw(results: Results, group: Group):
    """Draws a group with at least one cell to draw."""
    column, clock = launch.clock(group.drawn)
    lines = {block: sorted(line.items()) for block, line in _lines(results, group.drawn).items()}
    lines = {block: line for block, line in lines.items() if len(line) > 1} or lines
    figure, axes = plt.subplots(figsize=(7.2, 4.4), layout="constrained")
    colours = [*style.COLOURS.values(), *style.SPARE]
    for n, (width, height) in enumerate(sorted(lines, key=lambda block: (block[0] * block[1], block))):
        look = colours[n % len(colours)], MARKERS[n % len(MARKERS)]
        _line(axes, lines[width, height], column, f"{width} × {height}", *look)
    axes.axvline(group.cells[0].pixels, ls=":", lw=0.8, color="#444444")
    axes.set(xscale="log", yscale="log", xlabel="total number of threads", ylabel=f"{clock} (s)")
    for axis in (axes.xaxis, axes.yaxis):
        style.log_ticks(axis)
    axes.grid(color="#CCCCCC")
    axes.set_title(f"{HEADING}\n{group.label}", loc="left")
    figure.legend(title="block", loc="outside right upper")
    style.across(axes, gpu.mark(results, group.drawn))
    return figure


def _lines(results: Results, cells: list[Cell]) -> dict[tuple[int, int], dict[int, Cell]]:
    """Returns cells by block and by the number of threads launched."""
    by_block: dict[tuple[int, int], dict[int, Cell]] = {}
    for cell in cells:
        by_block.setdefault(gpu.block(results, cell), {}).setdefault(gpu.threads(results, cell), cell)
    return by_block


def _line(axes, line: list[tuple[int, Cell]], column: str, label: str, colour: str, marker: str) -> None:
    medians = []
    for threads, cell in line:
        values = cell.values(column)
        median = statistics.median(values)
        medians.append(median.value)
        axes.plot([threads] * len(values), values, ".", color=colour, ms=2.5, alpha=0.6)
        if median.low is not None:
            axes.plot([threads] * 2, [median.low, median.high], color=colour, lw=1.5)
    axes.plot([threads for threads, _ in line], medians, f"{marker}-", color=colour, lw=1, ms=4, label=label)


def draws(results: Results, group: Group) -> dict[str, Callable]:
    """Returns what draws a group, by the stem of its file: with two blocks or more also a map."""
    return {"threads": draw} | ({"threads-map": draw_map} if len(_lines(results, group.drawn)) > 1 else {})


def draw_map(results: Results, group: Group):
    """Draws a map of block and total number of threads of a group with at least one cell to draw."""
    lines = _lines(results, group.cells)
    totals = sorted({threads for line in lines.values() for threads in line})
    blocks = sorted(lines, key=lambda block: (block[0] * block[1], block))
    column, clock = launch.clock(group.drawn)
    medians = {cell: statistics.median(cell.values(column)) for cell in group.drawn}
    at = {cell: (threads, block) for block, line in lines.items() for threads, cell in line.items()}
    said, framed = best(
        results, Group(group.label, list(at)), column, lambda cell: "{1[0]} × {1[1]}, {0} threads".format(*at[cell])
    )
    shown = heat_map.Map(
        {total: str(total) for total in totals}, {block: "{} × {}".format(*block) for block in blocks},
        {place: medians.get(cell) for cell, place in at.items()}, "total number of threads", "block (threads)", clock,
        at.get(framed),
    )  # fmt: skip
    return heat_map.draw(shown, f"{MAPPED}\n{group.label}{said}", gpu.mark(results, group.drawn))


def best(results: Results, group: Group, column: str, name: Callable[[Cell], str]) -> tuple[str, Cell | None]:
    """Says which ranked cell has the lowest median, and returns it if its ratio to the next lowest is resolved."""
    first, *others = sorted(group.ranked, key=lambda cell: statistics.median(cell.values(column)).value) or [None]
    if first is None or not others:
        return "", None
    if ranking.resolved(results, ranking.ratio(others[0], first, column)):
        return f"; fastest: {name(first)}", first
    return f"; lowest median: {name(first)}, not resolved from {name(others[0])}", None


def write(results: Results, out: Path) -> str:
    """Writes threads-NUMBER-GROUP.png and .svg for each sweep, and threads-map; returns the section, "" without one."""
    return section(results, out, TITLE, of_scene, draws, CAPTION)


def section(results: Results, out: Path, title: str, of_scene, draws, caption: str) -> str:
    """Returns a section with the figures `draws(results, group)` of each group of `of_scene(results, scene)`."""
    groups = [group for scene in results.scenes for group in of_scene(results, scene)]
    if not groups:
        return ""
    parts = [f"## {title}"]
    for number, group in enumerate(groups):
        parts.append(f"### {markdown.escape(group.label)}")
        if not group.drawn:
            why = " / ".join(dict.fromkeys(cell.unranked for cell in group.cells))
            parts.append(markdown.escape(f"unavailable: nothing is ranked: {why}"))
            continue
        for stem, draw in draws(results, group).items():
            path = out / f"{stem}-{number}-{markdown.slug(group.label)}"
            parts.append(style.figure(path, f"{title}: {group.label}", draw, results, group))
    return "\n\n".join([*parts, markdown.escape(caption)])
