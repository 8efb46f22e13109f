"""The pictures of README and docs, from the reference results: python docs/pictures.py [FOLDER].

comparison.png and gallery.png are pictures that were stored; the others are figures of reports. The pictures of
failures (docs/stability/*.png) are of the report of the same run, which is stored without its pictures.
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageOps

from harness.store import packed
from reports.accuracy import front_figure, pareto
from reports.gpu import gpu_figure
from reports.paper import style
from reports.run import results, stored
from reports.run.results import Results
from reports.scaling import sweep, sweep_figure
from reports.stability import figure, memory, overview, stability, window
from reports.times import times_figure

ROOT = Path(__file__).parents[1]
RUNS = ROOT / "results" / "reference"
SHOWN = [f"figure {number}," for number in ("2.11b", "3.2", "3.3", "3.4a", "3.5b", "3.4b", "3.6a", "3.6b")]
FRONT = "mirrors"  # the case of accuracy.toml that is shown
FAILING = {"huge-sphere": figure, "drift": figure, "slabs": figure, "table": memory}  # rows of stability.toml
COLUMNS, TILE, GAP = 4, (240, 172), 4  # pixels: width, height


def write(folder: Path) -> None:
    """All of them, into the folder."""
    with packed.opened(RUNS / "cascade-lake-2x" / "comparison.tar.xz") as run:
        loaded = results.load(run)
        cell = next(cell for cell in loaded.cells if cell.variant == "cpp" and cell.pixels > 1)
        Image.fromarray(_seen(loaded, cell)).save(folder / "comparison.png", optimize=True)
    with packed.opened(RUNS / "epyc-2x" / "comparison.tar.xz") as run:  # without pictures, of more processes
        loaded = results.load(run)
        _draw(folder / "times", times_figure.draw, loaded, loaded.cells[0].scene)
    with packed.opened(RUNS / "emerald-rapids-2x" / "gallery.tar.xz") as run:
        loaded = results.load(run)
        cells = [next(cell for cell in loaded.cells if cell.swept["case"].startswith(name)) for name in SHOWN]
        montage([_seen(loaded, cell) for cell in cells]).save(folder / "gallery.png", optimize=True)
    with packed.opened(RUNS / "epyc-2x" / "accuracy.tar.xz") as run:
        loaded = results.load(run)
        chart = next(chart for chart in pareto.charts(loaded) if chart.points[0].cell.swept["case"] == FRONT)
        _draw(folder / "accuracy", front_figure.draw, loaded, chart)
    with packed.opened(RUNS / "epyc-2x" / "sweeps.tar.xz") as run:
        loaded = results.load(run)
        panels = sweep_figure.shown(sweep.panels(loaded))
        crossed = sweep_figure.crossings(loaded, panels, sweep.TIME)
        _draw(folder / "sweeps", sweep_figure.draw, loaded, panels, sweep.TIME, crossed)
    with packed.opened(RUNS / "h200-16x" / "gpu.tar.xz") as run:
        loaded = results.load(run)
        wanted = {"precision": "float64", "floating_point": "strict"}
        cells = [cell for cell in loaded.cells if cell.gpu and wanted.items() <= cell.swept.items()]
        _draw(folder / "gpu", gpu_figure.draw, loaded, cells)
    with packed.opened(RUNS / "cascade-lake-2x" / "stability.tar.xz") as run:
        loaded = results.load(run)
        rows = {row.name: row for row in stability.rows(loaded)}
        out = folder / "stability"
        out.mkdir(exist_ok=True)
        for naive in overview.KINDS:
            _draw(out / f"overview{'-naive' * naive}", overview.draw, loaded, list(rows.values()), naive)
        _draw(out / "window", window.draw, loaded, window.drawable(window.windows(list(rows.values()))))
        for name, module in FAILING.items():
            _draw(out / name, module.draw, loaded, rows[name])


def _draw(path: Path, draw, *data) -> None:
    """Writes a figure of a report as `path`.svg and `path`.json."""
    style.figure(path, "", draw, *data)
    for suffix in (".png", ".pdf"):
        path.with_suffix(suffix).unlink()


def _seen(loaded: Results, cell) -> np.ndarray:
    return stored.displayed(stored.picture(loaded, cell), cell)


def montage(pictures: list[np.ndarray]) -> Image.Image:
    """Pictures side by side, each cut to fill a tile."""
    (wide, high), rows = TILE, -(-len(pictures) // COLUMNS)
    sheet = Image.new("RGB", (COLUMNS * (wide + GAP) - GAP, rows * (high + GAP) - GAP), "white")
    for number, pixels in enumerate(pictures):
        row, column = divmod(number, COLUMNS)
        tile = ImageOps.fit(Image.fromarray(pixels), TILE, Image.Resampling.LANCZOS)
        sheet.paste(tile, (column * (wide + GAP), row * (high + GAP)))
    return sheet


if __name__ == "__main__":
    write(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs")
