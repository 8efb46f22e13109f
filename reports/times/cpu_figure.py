"""Draws figure 4.2: CPU use over time, a panel for each variant, with the phases that the renderer marked."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from reports.paper import markdown, style, thinning, timeline
from reports.run import naming, stored, study
from reports.run.results import Cell, Missing, Results

CAPTION = (
    "CPU time between two samples of the measurer, divided by the time between them; 100 % is one core, the "
    "scale on the right is of all logical cores, as in the study. The CPU time of children that have ended "
    "is counted in ticks of 10 ms. Dashed: the mean over the whole process, from "
    "wait4, which does not depend on the samples. Shown is the first good process, which finds caches "
    "cold. Each panel has its own time scale; samples nearer than 1/150 of it are merged. White between phases: "
    "no phase was marked."
)

WIDTH, PANEL, HEAD, FOOT = 7.2, 1.25, 0.1, 0.75  # inches
FINEST = 150  # steps of a curve
MOST = 8  # panels


def rates(series: Path, apart: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Returns (T + 1,) times, s, of a series (measurer.py) and (T,) CPU use between them, % of a core. T may be 0.

    apart: samples nearer to each other than this, s, are merged.
    """
    table = stored.series(series, usecols=["t", "cpu_s"], dtype=float).dropna()
    t, cpu = table["t"].to_numpy(), table["cpu_s"].to_numpy()
    kept = []
    for n in range(len(t)):
        if not kept or t[n] - t[kept[-1]] >= apart:
            kept.append(n)
    kept = np.array(kept, dtype=int)
    return t[kept], 100 * np.diff(cpu[kept]) / np.diff(t[kept])


def _lacking(results: Results, cell: Cell) -> Missing | None:
    """Returns why a cell has no series, None if it has one."""
    record = results.records[cell.counting[0]] if cell.counting else None
    if record is not None and record["series"] and record["cpu"]:
        return None
    return Missing(cell.verdict if cell.status != "ok" else "no series was stored")


def draw(results: Results, cells: list[Cell]):
    """Draws cells with a series."""
    height = HEAD + len(cells) * PANEL + FOOT
    figure, panels = plt.subplots(len(cells), 1, figsize=(WIDTH, height), squeeze=False)
    figure.subplots_adjust(left=0.09, right=0.91, top=1 - (HEAD + 0.22) / height, bottom=FOOT / height, hspace=0.85)
    seen = {}
    cores = results.facts["environment"]["cores"]["logical"]
    for cell, axes in zip(cells, panels[:, 0], strict=True):
        seen |= dict.fromkeys(_panel(results, cell, axes, cores))
    panels[-1, 0].set_xlabel("time since the process started (s)")
    figure.supylabel("CPU use (% of one core)", fontsize=8, x=0.005)
    figure.text(0.995, 0.5, "CPU use (% of all cores)", rotation=270, ha="right", va="center", fontsize=8)
    timeline.legend(figure, seen)
    return figure


def _panel(results: Results, cell: Cell, axes, cores: int | None) -> list[str]:
    """Draws one variant; returns the names of its phases."""
    record = results.records[cell.counting[0]]
    axes.set_title(cell.label, loc="left", fontweight="bold", pad=3)
    wall, cpu = record["wall_s"], record["cpu"]["user_s"] + record["cpu"]["system_s"]
    t, percent = rates(results.folder / record["series"], wall / FINEST)
    names = timeline.shade(axes, record)
    mean = 100 * cpu / wall
    axes.axhline(mean, ls="--", lw=0.8, color="#444444")
    if len(percent):
        axes.stairs(percent, t, baseline=None, color=style.colour(cell.variant, results.variants), lw=1.3)
    else:
        axes.text(0.5, 0.2, "too short for two samples: only the mean is known", transform=axes.transAxes, ha="center",
                  fontsize=7)  # fmt: skip
    top = 1.3 * max(100.0, mean, *percent)
    axes.set(xlim=(0, wall), ylim=(0, top))
    axes.set_title(f"{wall:.3g} s, CPU time {cpu:.3g} s, mean {mean:.0f} %", loc="right", fontsize=7, pad=3)
    if cores:
        axes.secondary_yaxis("right", functions=(lambda y: y / cores, lambda y: y * cores))
    return names


def write(results: Results, out: Path) -> str:
    """Writes cpu-NUMBER-SCENE.png and .svg for each scene; returns the section of the report."""
    parts = [f"## {study.heading(results.cells, 'CPU use', 'figure 4.2')}"]
    for number, scene in enumerate(results.scenes):
        place = timeline.largest_place(results.of(scene))
        path, label = out / f"cpu-{number}-{markdown.slug(Path(scene).stem)}", naming.called(results, place)
        lacking = {cell: why for cell in results.at(place) if (why := _lacking(results, cell))}
        there = [cell for cell in results.at(place) if cell not in lacking]
        parts.append(f"### {markdown.escape(label)}")
        if there:
            shown = thinning.few(there, MOST)
            parts.append(style.figure(path, f"CPU use: {label}", draw, results, shown))
            parts.append(thinning.note(len(shown), len(there), "renderers", "the series of all are in the run"))
        parts += markdown.listed("Not drawn:", [f"{cell.label}: {why}" for cell, why in lacking.items()])
    return "\n\n".join(filter(None, [*parts, markdown.escape(CAPTION)]))
