"""The table of the kinds of GPU memory that hold the scene, compared with each other."""

from pathlib import Path

from reports.gpu import gpu_table
from reports.paper import quantity, table
from reports.paper.table import Column
from reports.run import gpu, launch, ranking
from reports.run.results import Cell, Missing, Results

BASE = "global"
CAPTION = (
    "A ratio, its interval and what is not resolved are as in the table of times; it is to the same launch with the "
    "scene in global memory. Below 1: faster than global memory. It is of kernel times where both are "
    "told, else of frames."
)


def _ratio(cell: Cell, cells: list[Cell]):
    """Time of a cell over that of the one in global memory among `cells`, which differ in the memory alone."""
    other = next((c for c in cells if c.parameters.get("scene_memory") == BASE), None)
    if cell.unranked:
        return Missing(f"not ranked: {cell.unranked}")
    if other is None or other.unranked:
        return Missing("global memory is not ranked here")
    if other is cell:
        return "1 (the baseline)"
    column, _ = launch.clock([cell, other])
    return ranking.ratio(cell, other, column)


def of_scene(results: Results, scene: str) -> dict[int, list[Cell]]:
    """For each cell, by its id, those that differ from it in the memory alone, where there are some."""
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
            lambda value: value if isinstance(value, str) else quantity.ratio(value, floor),
        ),
        *(launched[name] for name in ("registers", "shared_bytes", "constant_bytes", "occupancy")),
        times["max_error_outside_mask"],
    ]  # fmt: skip


def write(results: Results, out: Path) -> str:
    """scene-memory-*.csv, one a scene, and the section of the report; "" if the memory was not swept."""
    found = [(scene, of_scene(results, scene)) for scene in gpu.scenes(results)]
    tables = [
        (scene, [cell for cell in results.of(scene) if id(cell) in partners], columns(results, partners))
        for scene, partners in found
        if partners
    ]
    return table.section(out, "scene-memory", "Memory that keeps the scene", tables, CAPTION) if tables else ""
