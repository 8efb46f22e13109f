"""Reports the cost of unused features in a kernel: kernels as needed, with one feature more, and with all."""

from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt

from harness.statistics.statistics import Estimate
from reports.paper import markdown, quantity, style, table
from reports.paper.table import Column
from reports.run import gpu, launch, ranking
from reports.run.results import Cell, Missing, Results, grouped
from reports.times import startup_table

BASE = "needed"
TITLE = "Needs: the cost of unused features"
CAPTION = (
    "A kernel as the scene needs it, beside kernels with more features, which the scene does not use (general: all "
    'features of the renderer). Ratio, interval and "not resolved" as in the table of times; the ratio is to the same '
    "variant's kernel as needed, and above 1 the unused features cost time. Compile: with an empty cache, or the build "
    "of a program that is compiled beforehand, marked (build). Memory: peak of the process, without the memory of "
    "compiling where code is loaded from a cache. Same picture: do all processes have the bytes of the picture of "
    "the kernel as needed? Grey in the figure: not distinguishable from noise, by the A/A pair of the run."
)
NO_GPU = "it does not run on a GPU (rayrace doctor --cuda compiles its kernels without one)"
WIDTH, ROW, HEAD, KEY = 7.2, 0.2, 0.95, 0.15  # inches


@dataclass(frozen=True)
class Carried:
    """The kernels of one variant that differ only in their features. base: as needed; None if the run lacks it."""

    label: str
    base: Cell | None
    cells: list[Cell]


def kernels(results: Results) -> list[Carried]:
    """Returns the variants whose kernel was varied."""
    groups = [group for group in launch.groups(results.cells, ("kernel",)) if len({*map(carries, group.cells)}) > 1]
    return [
        Carried(group.label, next((cell for cell in group.cells if carries(cell) == BASE), None), group.cells)
        for group in groups
    ]


def carries(cell: Cell) -> str:
    """Returns the features that a kernel has beyond the needed ones: "needed", "shadows", "general"."""
    return cell.parameters.get("kernel", BASE).removeprefix(f"{BASE}+").replace("+", ", ")


def ratio(cell: Cell, base: Cell | None) -> Estimate | Missing | str:
    """Returns the time over that of the kernel as needed."""
    column, _ = launch.clock([cell, base or cell])
    return ranking.ratio_to_cell(cell, base, "the kernel as needed is not ranked here", column)


def peak(cell: Cell) -> Estimate | Missing:
    """Returns the peak memory, byte, of processes that loaded compiled code if there are any, else of all."""
    states = {state.cache: state for state in cell.by_cache()}
    return states.get("warm", cell).median("peak_bytes", "not reported")


def same_picture(results: Results, cell: Cell, base: Cell | None) -> str | Missing:
    """Returns whether all its pictures have the bytes of the picture of the kernel as needed: "yes" or "no"."""
    digests, right = _digests(results, cell), base and _digests(results, base)
    if not digests or not right:
        return Missing(cell.verdict if cell.status != "ok" else "the run has no picture to compare")
    return "yes" if digests | right == right and len(right) == 1 else "no"


def _digests(results: Results, cell: Cell) -> set[str]:
    pictures = [results.records[row]["picture"] for row in cell.timed]
    return {picture["sha256"] for picture in pictures if picture}


def columns(results: Results, partners: dict[int, Cell | None]) -> list[Column]:
    """Returns the columns of the table. partners: the kernel as needed for each cell, by its id."""
    floor = results.floor.value

    def resource(title, name, unit):
        def used(cell):
            value = gpu.method(results, cell, name) if cell.gpu else Missing(NO_GPU)
            return value if isinstance(value, Missing | str) else float(value)

        return Column(title, name, unit, used, lambda value: f"{value:.0f}")

    shown = [
        Column("carries", "carries", "", carries),
        Column(
            "time ÷ needed", "time_over_needed", "1", lambda cell: ratio(cell, partners[id(cell)]),
            lambda value: quantity.ratio(value, floor),
        ),
        Column("compile", "compile_cold", "s", startup_table.cold, startup_table.show_cold),
        Column("peak memory", "peak_bytes", "byte", peak),
        Column("same picture", "same_picture", "", lambda cell: same_picture(results, cell, partners[id(cell)])),
    ]  # fmt: skip
    if any(cell.gpu for cell in results.cells):
        shown += [
            resource("registers", "registers", "1"),
            resource("local memory (byte)", "local_bytes", "byte"),
            resource("constant memory (byte)", "constant_bytes", "byte"),
        ]
    return shown


def write(results: Results, out: Path) -> str:
    """Writes needs-*.csv per scene, needs-*.png and .svg; returns the section, "" if no kernel has unused features."""
    groups = kernels(results)
    if not groups:
        return ""
    partners = {id(cell): group.base for group in groups for cell in group.cells}
    shown = columns(results, partners)
    by_scene = grouped((cell for cell in results.cells if id(cell) in partners), lambda cell: cell.scene)
    tables = [(scene, by_scene[scene], shown) for scene in results.scenes if scene in by_scene]
    parts = [table.section(out, "needs", TITLE, tables, CAPTION, silent=("kernel",))]
    if not any(cell.gpu for cell in results.cells):
        parts.append(markdown.escape(f"Registers, local and constant memory: unavailable: {NO_GPU}."))
    drawn = [group for group in groups if _points(group)]
    if drawn:
        parts.append(style.figure(out / "needs", TITLE, draw, results, drawn))
    return "\n\n".join(parts)


def _points(group: Carried) -> list[tuple[str, Estimate]]:
    ratios = [(carries(cell), ratio(cell, group.base)) for cell in group.cells]
    return [(name, value) for name, value in ratios if isinstance(value, Estimate)]


def draw(results: Results, groups: list[Carried]):
    """Draws three panels with a row for each kernel: time over that of the needed kernel, compile time and memory."""
    rows = list(dict.fromkeys(carries(cell) for group in groups for cell in group.cells))
    beside = style.columns([group.label for group in groups], WIDTH, 3, 6)
    height = HEAD + ROW * len(rows) * max(1, len(groups) / 2) + KEY * -(-len(groups) // beside)
    figure, panels = plt.subplots(1, 3, figsize=(WIDTH, height), sharey=True, layout="constrained")
    for number, group in enumerate(groups):
        shift = 0.6 * ((number + 0.5) / len(groups) - 0.5)
        shade = style.colour(group.cells[0].variant, results.variants)
        for axes, value in zip(panels, (lambda cell, base=group.base: ratio(cell, base), startup_table.cold, peak),
                               strict=True):  # fmt: skip
            _dots(axes, [(rows.index(carries(cell)) + shift, value(cell)) for cell in group.cells], shade, group.label)
    floor = results.floor.value
    panels[0].axvline(1, color="#888888", lw=0.8)
    if floor is not None:
        panels[0].axvspan(1 / (1 + floor), 1 + floor, color="#E6E6E6", lw=0)
    for axes, label in zip(panels, ("time ÷ needed", "compile", "peak memory (MB)"), strict=True):
        axes.set(xlabel=label, xscale="log")
        style.log_ticks(axes.xaxis)
        axes.grid(axis="x")
    panels[0].set_yticks(range(len(rows)), rows)
    panels[0].set_ylim(len(rows) - 0.5, -0.5)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower left", ncols=beside, fontsize=6)
    return figure


def _dots(axes, points: list[tuple[float, object]], shade: str, label: str) -> None:
    values = [(row, value) for row, value in points if isinstance(value, Estimate)]
    scale = 1e-6 if axes.get_subplotspec().colspan.start == 2 else 1
    for row, value in values:
        if value.low is not None:
            axes.plot([value.low * scale, value.high * scale], [row, row], color=shade, lw=1)
    axes.plot(
        [value.value * scale for _, value in values], [row for row, _ in values], "o", color=shade, ms=3.5, label=label
    )
