"""Draws figure 2.7: time against the total number of threads, a line per block size."""

from pathlib import Path

import matplotlib.pyplot as plt

from harness.statistics import statistics
from reports.paper import markdown, style
from reports.run import gpu, launch
from reports.run.launch import Group
from reports.run.results import Cell, Results

TITLE = "Total number of threads (the study's figure 2.7)"
HEADING = "Time against the total number of threads (figure 2.7 of the study)"
CAPTION = (
    "A line per block size, its threads across × down. Large: the median over processes with its 95 % interval, where "
    "there are enough processes; small: each process, the median of its steady frames. Threads are those launched, in "
    "whole blocks; where there are fewer threads than pixels, each renders several. Dotted: one thread per pixel. Only "
    "ranked cells are drawn."
)
MARKERS = "osD^vP*X<>ph"


def of_scene(results: Results, scene: str) -> list[Group]:
    """Returns groups in which the total number of threads was swept."""
    found = launch.groups(gpu.cells(results, scene), launch.SHAPE)
    return [group for group in found if len({cell.parameters.get("total_threads") for cell in group.cells}) > 1]


def draw(results: Results, group: Group):
    """Draws a group with at least one ranked cell."""
    column, clock = launch.clock(group.ranked)
    blocks: dict[tuple[int, int], dict[int, Cell]] = {}
    for cell in group.ranked:
        blocks.setdefault(gpu.block(results, cell), {}).setdefault(gpu.threads(results, cell), cell)
    lines = {block: sorted(line.items()) for block, line in blocks.items() if len(line) > 1} or {
        block: list(line.items()) for block, line in blocks.items()
    }
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
    return figure


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


def write(results: Results, out: Path) -> str:
    """Writes threads-NUMBER-GROUP.png and .svg for each sweep; returns the section, "" if there is none."""
    return section(results, out, TITLE, "threads", of_scene, draw, CAPTION)


def section(results: Results, out: Path, title: str, stem: str, of_scene, draw, caption: str) -> str:
    """Returns a section with a figure `draw(results, group)` of each group that `of_scene(results, scene)` returns."""
    found = [group for scene in results.scenes for group in of_scene(results, scene)]
    if not found:
        return ""
    parts = [f"## {title}"]
    for number, group in enumerate(found):
        parts.append(f"### {markdown.escape(group.label)}")
        if not group.ranked:
            why = " / ".join(dict.fromkeys(cell.unranked for cell in group.cells))
            parts.append(markdown.escape(f"unavailable: nothing is ranked: {why}"))
            continue
        path = out / f"{stem}-{number}-{markdown.slug(group.label)}"
        parts.append(style.figure(path, f"{title}: {group.label}", draw, results, group))
    return "\n\n".join([*parts, markdown.escape(caption)])
