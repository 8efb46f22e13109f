"""Prepares the interactive series of processes: processor, memory and GPU over their lives, with their phases."""

import numpy as np

from reports.chart.embedded import Embedded
from reports.paper import style, timeline
from reports.run import naming, stored
from reports.run.results import Cell, Results
from reports.times import cpu_figure

FINEST = 150  # steps of a curve
MOST = 12  # scenes
HIGH = 130  # pixels per process
LEVELS = {
    "resident memory (MB)": ("rss_bytes", 1e-6),
    "address space (MB)": ("vms_bytes", 1e-6),
    "GPU use (%)": ("gpu_percent", 1),
    "GPU memory (MB)": ("gpu_process_memory_bytes", 1e-6),
    "GPU power (W)": ("gpu_power_w", 1),
}


def data(results: Results, _: Embedded) -> dict:
    """Returns `places` with the processes that have a series, colours of phases and a height; {} without series."""
    places = []
    for scene in results.scenes[:MOST]:
        place = timeline.largest_place(results.of(scene))
        processes = [process for cell in results.at(place) if (process := _process(results, cell))]
        if processes:
            places.append({"label": naming.called(results, place), "processes": processes})
    if not places:
        return {}
    every = [process for place in places for process in place["processes"]]
    names = {name for process in every for name, _, _ in process["phases"]}
    ordered = dict.fromkeys(name for name in (*style.PHASES, *sorted(names)) if name in names)
    phases = {name: style.PHASES.get(name, style.OTHER_PHASE) for name in ordered}
    kinds = {kind for process in every for kind in process["curves"]}
    shown = [kind for kind in ("CPU use (% of one core)", *LEVELS) if kind in kinds]
    return {"places": places, "phases": phases, "kinds": shown, "step": HIGH}


def _process(results: Results, cell: Cell) -> dict | None:
    """Returns the first good repetition of a cell, which finds its caches cold; None without a series."""
    record = results.records[cell.counting[0]] if cell.counting else None
    if record is None or not record["series"]:
        return None
    path, wall = results.folder / record["series"], record["wall_s"]
    t, percent = cpu_figure.rates(path, wall / FINEST)
    curves = {"CPU use (% of one core)": _curve((t[1:] + t[:-1]) / 2, percent)} if len(percent) else {}
    table = stored.series(path)
    for kind, (column, scale) in LEVELS.items():
        samples = table[["t", column]].dropna() if column in table else table[:0]
        if len(samples):
            kept = np.unique(np.linspace(0, len(samples) - 1, min(len(samples), FINEST)).round().astype(int))
            some = samples.iloc[kept]
            curves[kind] = _curve(some["t"].to_numpy(float), some[column].to_numpy(float) * scale)
    return {"label": cell.label, "wall": wall, "phases": record["phases"], "curves": curves}


def _curve(t: np.ndarray, y: np.ndarray) -> list[list[float]]:
    return [[float(f"{value:.4g}") for value in values] for values in (t, y)]
