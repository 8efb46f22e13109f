"""Draws the share of a GPU's peak that a frame's floating-point operations take."""

from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.lines import Line2D

from harness.statistics.statistics import Estimate
from reports.paper import markdown, quantity, style, table
from reports.paper.table import Column
from reports.run import gpu, launch
from reports.run.results import Cell, Missing, Results, point_label
from reports.scaling import operations

TITLE = "Share of the device's peak"
CAPTION = (
    f"{operations.CAPTION} Time: the kernel's. Peak: in the precision used, as the renderer computed it from the "
    "device's properties, a fused multiply-add counted as two; code that fuses none cannot pass half of it. Of points "
    "that differ only in how the kernel is launched the one with the highest rate is drawn."
)
ROW, HEAD = 0.36, 1.1  # inches


def rate(results: Results, cell: Cell) -> Estimate | Missing:
    """Returns the floating-point operations per second of the kernel."""
    return operations.rate(results, cell, "kernel_s")


def peak(results: Results, cell: Cell) -> float | Missing:
    """Returns the device's peak in the cell's precision, floating-point operations per second."""
    bits = {"float32": "fp32", "float64": "fp64"}.get(cell.parameters["precision"])
    if bits is None:
        return Missing(f"no peak is known for {cell.parameters['precision']}")
    flops = gpu.device(results, cell, f"peak_{bits}_flops")
    return flops if isinstance(flops, Missing) else float(flops)


def share(results: Results, cell: Cell) -> Estimate | Missing:
    """Returns the share of the peak, 0 to 1."""
    achieved, most = rate(results, cell), peak(results, cell)
    if isinstance(achieved, Missing):
        return achieved
    if isinstance(most, Missing):
        return most
    low, high = (None if end is None else end / most for end in (achieved.low, achieved.high))
    return Estimate(achieved.value / most, low, high, achieved.processes, achieved.note)


def columns(results: Results) -> list[Column]:
    return [
        Column("precision", "precision", "", lambda cell: cell.parameters["precision"]),
        Column("Gflop of a frame", "flop", "1", lambda cell: operations.flops(results, cell), scale=1e-9),
        Column("Tflop/s", "flops", "1/s", lambda cell: rate(results, cell), scale=1e-12),
        Column("peak (Tflop/s)", "peak_flops", "1/s", lambda cell: peak(results, cell), scale=1e-12),
        Column("share of the peak (%)", "share", "1", lambda cell: share(results, cell), scale=100),
    ]


def draw(results: Results, cells: list[Cell]):
    """Draws cells that have a rate."""
    figure, axes = plt.subplots(figsize=(7.2, ROW * len(cells) + HEAD), layout="constrained")
    for row, cell in enumerate(cells):
        achieved, most, part = rate(results, cell), peak(results, cell), share(results, cell)
        colour = style.colour(cell.variant, results.variants)
        if achieved.low is not None:
            axes.plot([achieved.low / 1e12, achieved.high / 1e12], [row, row], color=colour, lw=1.5)
        axes.plot(achieved.value / 1e12, row, "o", color=colour, ms=5)
        if not isinstance(most, Missing):
            axes.plot(most / 1e12, row, "|", color="black", ms=11, mew=1.5)
        text = "peak unavailable" if isinstance(part, Missing) else f"{quantity.percentage(part.value)} of the peak"
        axes.text(1.01, row, text, transform=axes.get_yaxis_transform(), va="center", fontsize=7)
    axes.set_yticks(range(len(cells)), [_name(results, cell) for cell in cells], fontsize=7)
    axes.set(xscale="log", ylim=(len(cells) - 0.5, -0.5), xlabel="Tflop/s")
    style.log_ticks(axes.xaxis)
    axes.grid(axis="x", color="#CCCCCC")
    marks = Line2D([], [], ls="", marker="o", color="#444444"), Line2D([], [], ls="", marker="|", color="black", ms=11)
    figure.legend(marks, ["here", "peak of the device"], loc="outside upper right", ncols=2)
    return figure


def _name(results: Results, cell: Cell) -> str:
    """Returns two lines: the variant and its launch, and the swept point."""
    words = [cell.variant, cell.parameters["precision"]]
    if block := gpu.block(results, cell):
        words.append("block {} × {}".format(*block))
    swept = {key: value for key, value in cell.swept.items() if key not in launch.SHAPE}
    return ", ".join(words) + (f"\n{point_label(swept)}" if swept else "")


def fastest(results: Results, cells: list[Cell]) -> list[Cell]:
    """Returns, of cells with a rate that differ only in their launch, the one with the highest rate."""
    rates = {id(cell): rate(results, cell) for cell in cells}
    rated = [cell for cell in cells if not isinstance(rates[id(cell)], Missing)]
    return [max(group.cells, key=lambda cell: rates[id(cell)].value) for group in launch.groups(rated, launch.SHAPE)]


def write(results: Results, out: Path) -> str:
    """Writes peak-*.csv, peak-NUMBER-SCENE.png and .svg per scene; returns the section, "" without a GPU."""
    scenes = gpu.scenes(results)
    if not scenes:
        return ""
    cells = {scene: gpu.cells(results, scene) for scene in scenes}
    tables = [(scene, cells[scene], columns(results)) for scene in scenes]
    parts = [table.section(out, "peak", TITLE, tables, CAPTION)]
    for number, scene in enumerate(scenes):
        drawn = fastest(results, cells[scene])
        if drawn:
            path = out / f"peak-{number}-{markdown.slug(Path(scene).stem)}"
            parts.append(style.figure(path, f"{TITLE}: {scene}", draw, results, drawn))
    return "\n\n".join(parts)
