"""Tabulates and compares the kinds of GPU memory that hold the scene."""

from pathlib import Path

from reports.accuracy import accuracy_columns
from reports.gpu import gpu_table
from reports.paper import quantity, table
from reports.paper.table import Column
from reports.run import gpu, launch, ranking
from reports.run.results import Cell, Results

BASE = "global"
CAPTION = (
    'Ratio, interval and "not resolved" as in the table of times; the ratio is to the same launch with the scene in '
    "global memory, below 1 is faster. It compares kernel times where both are known, else frames."
)


def _ratio(cell: Cell, cells: list[Cell]):
    """Returns the time of a cell over that of the one in global memory among `cells`, which differ only in memory."""
    base = next((other for other in cells if other.parameters.get("scene_memory") == BASE), None)
    column, _ = launch.clock([cell, base or cell])
    return ranking.ratio_to_cell(cell, base, "global memory is not ranked here", column)


def of_scene(results: Results, scene: str) -> dict[int, list[Cell]]:
    """Returns for each cell, by its id, the cells that differ from it only in the memory, if there are any."""
    groups = launch.groups(gpu.cells(results, scene), ("scene_memory",))
    return {id(cell): group.cells for group in groups if len(group.cells) > 1 for cell in group.cells}


def columns(results: Results, partners: dict[int, list[Cell]]) -> list[Column]:
    launched = {column.name: column for column in gpu_table.launch_columns(results)}
    times = {column.name: column for column in gpu_table.TIME_COLUMNS}
    floor = results.floor.value
    return [
        launched["scene_memory"],
        launched["block"],
        times["kernel_s"],
        times["steady_s"],
        Column(
            "time ÷ global", "time_over_global", "1", lambda cell: _ratio(cell, partners[id(cell)]),
            lambda value: quantity.ratio(value, floor),
        ),
        *(launched[name] for name in ("registers", "shared_bytes", "constant_bytes", "occupancy")),
        *accuracy_columns.ERRORS,
    ]  # fmt: skip


def write(results: Results, out: Path) -> str:
    """Writes scene-memory-*.csv per scene; returns the section, "" if the memory was not swept."""
    by_scene = [(scene, of_scene(results, scene)) for scene in gpu.scenes(results)]
    tables = [
        (scene, [cell for cell in results.of(scene) if id(cell) in partners], columns(results, partners))
        for scene, partners in by_scene
        if partners
    ]
    return table.section(out, "scene-memory", "Memory that holds the scene", tables, CAPTION) if tables else ""
