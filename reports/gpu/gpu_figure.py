"""Draws figure 4.3: use of the GPU over time, its power below, and the phases that the renderer marked."""

import textwrap
from pathlib import Path

import matplotlib.pyplot as plt
import pandas as pd

from reports.paper import markdown, style, timeline
from reports.run import gpu, naming, stored, study
from reports.run.results import Cell, Missing, Results

TITLE = "GPU use"
CAPTION = (
    "NVML's utilisation is the share of a short past period, 1/6 s to 1 s depending on the device, in which a kernel "
    "ran; it does not say how much of the device that kernel used, and it lags behind the phases. Power is the whole "
    "device's. Shown is the first good process of the repeated-load pass, which lasts long enough for these slow "
    "sensors, else of the timed ones."
)
CURVES = ("gpu_percent", "GPU use (%)"), ("gpu_power_w", "power (W)")
WIDTH, CELL, EMPTY, HEAD, FOOT = 7.2, 2.5, 1.0, 0.35, 0.6  # inches


def curve(results: Results, record: dict, column: str) -> pd.DataFrame | Missing:
    """Returns columns t (s) and `column` of the series of a record, rows with a value only; or why there are none."""
    if (record.get("device") or {}).get("simulated"):
        return Missing("the CUDA simulator uses no GPU")
    if not record["series"]:
        return Missing("no series was stored")
    table = stored.series(results.folder / record["series"])
    if column in table:
        table = table[["t", column]].astype(float).dropna()
        if len(table):
            return table
    audit = (record["measurer"] or {}).get("gpu")
    reason = audit.get(column) if isinstance(audit, dict) else audit
    return Missing("the series has no such value" if reason in (None, "available") else reason)


def draw(results: Results, cells: list[Cell]):
    """Draws the cells of a place."""
    recordings = [_found(results, cell) for cell in cells]
    heights = [EMPTY if all(isinstance(series, Missing) for series in curves) else CELL for _, curves in recordings]
    height = HEAD + sum(heights) + FOOT
    figure = plt.figure(figsize=(WIDTH, height))
    seen, top = {}, height - HEAD
    for cell, (record, curves), high in zip(cells, recordings, heights, strict=True):
        box = {"left": 0.09, "right": 0.98, "top": top / height, "bottom": (top - high + 0.5) / height}
        top -= high
        if high == EMPTY:
            panels = [figure.add_gridspec(1, 1, **box).subplots()]
            reasons = dict.fromkeys(f"{label}: {series}" for series, (_, label) in zip(curves, CURVES, strict=True))
            _say(panels[0], "\n".join(textwrap.fill(reason, 110) for reason in reasons))
        else:
            panels = figure.add_gridspec(2, 1, **box, hspace=0.18).subplots(sharex=True)
            for panel, series, (column, label) in zip(panels, curves, CURVES, strict=True):
                seen |= dict.fromkeys(_panel(results, cell, record, panel, series, column))
                panel.set_ylabel(label)
        panels[0].set_title(cell.label, loc="left", fontweight="bold", pad=3)
        if record is not None:
            which = "repeated-load pass" if cell.loaded else "timed process"
            panels[0].set_title(f"{which}, {record['wall_s']:.3g} s", loc="right", fontsize=7, pad=3)
    figure.text(
        0.535, (FOOT + 0.06) / height, "time since the process started (s)", ha="center", va="bottom", fontsize=8
    )
    timeline.legend(figure, seen)
    return figure


def _found(results: Results, cell: Cell) -> tuple[dict | None, list[pd.DataFrame | Missing]]:
    """Returns the record to draw, None if there is none, and for each of CURVES its curve or why it is missing."""
    rows = gpu.observed_rows(cell)
    good = rows[rows["status"] == "ok"]
    if len(good):
        record = results.records[good.index[0]]
        return record, [curve(results, record, column) for column, _ in CURVES]
    why = cell.verdict if rows.empty else f"{rows.iloc[0]['status']}: {rows.iloc[0]['reason']}"
    return None, [Missing(why)] * len(CURVES)


def _panel(results: Results, cell: Cell, record: dict, axes, series: pd.DataFrame | Missing, column: str) -> list[str]:
    """Draws one curve of a cell; returns the names of its phases."""
    if isinstance(series, Missing):
        _say(axes, textwrap.fill(str(series), 110))
        return []
    names = timeline.shade(axes, record, named=column == CURVES[0][0])
    colour = style.colour(cell.variant, results.variants)
    axes.plot(series["t"], series[column], drawstyle="steps-pre", color=colour, lw=1.3)
    if len(series) < 2:
        axes.plot(series["t"], series[column], "o", color=colour, ms=4)
    top = 130 if column == "gpu_percent" else 1.25 * max(1.0, series[column].max())
    axes.set(xlim=(0, record["wall_s"]), ylim=(0, top))
    axes.tick_params(labelbottom=column == CURVES[-1][0])
    return names


def _say(axes, text: str) -> None:
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", fontsize=7)
    axes.tick_params(length=0, labelbottom=False, labelleft=False)
    axes.spines[:].set_color("#BBBBBB")


def write(results: Results, out: Path) -> str:
    """Writes gpu-NUMBER-SCENE.png and .svg for each scene; returns the section, "" without a GPU."""
    title = study.heading(results.cells, TITLE, "figure 4.3")
    used = [cell for scene in gpu.scenes(results) for cell in gpu.cells(results, scene)]
    if used and not any(_found(results, cell)[0] for cell in used):
        return markdown.unavailable(title, used[0].verdict.removeprefix("unavailable: "))
    parts = []
    for number, scene in enumerate(gpu.scenes(results)):
        cells = gpu.cells(results, scene)
        place = timeline.largest_place(cells)
        cells = [cell for cell in cells if cell.place == place]
        path, label = out / f"gpu-{number}-{markdown.slug(Path(scene).stem)}", naming.called(results, place)
        parts += [f"### {markdown.escape(label)}", style.figure(path, f"GPU use: {label}", draw, results, cells)]
    return "\n\n".join([f"## {title}", *parts, markdown.escape(CAPTION)]) if parts else ""
