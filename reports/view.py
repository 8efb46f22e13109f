"""Views: cells of a run that show the same thing by other means, brought together, and the pictures they stored."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from reports import launch
from reports.cell import Missing
from reports.results import Cell, Results, point_label

# What no right picture can depend on.
UNSEEN = (*launch.UNSEEN, "threads", "frames", "least_frame", "walk", "accel", "kernel")


@dataclass(frozen=True)
class View:
    """Cells with one scene, and equal parameters but for a few. names: what theory may call it, its case and scene."""

    label: str
    names: tuple[str, ...]
    cells: list[Cell]


def views(cells: list[Cell], free: tuple[str, ...]) -> list[View]:
    """Views of cells that differ in the parameters `free`, in the variant, and in UNSEEN. Exhibits are in none."""
    found: dict[tuple, list[Cell]] = {}
    for cell in cells:
        if not cell.apart:
            # A generated scene has one name for all of its counts, which are swept and no parameters.
            more = {key: value for key, value in cell.swept.items() if key not in cell.parameters}
            key = cell.scene, json.dumps(more, sort_keys=True), launch.rest(cell, (*free, *UNSEEN))
            found.setdefault(key, []).append(cell)
    return [View(_label(mine, free), _names(mine[0]), mine) for mine in found.values()]


def _label(cells: list[Cell], free: tuple[str, ...]) -> str:
    swept = {key: value for key, value in cells[0].swept.items() if key not in (*free, *UNSEEN, "case")}
    return ", ".join([*_names(cells[0]), *([point_label(swept)] if swept else [])])


def _names(cell: Cell) -> tuple[str, ...]:
    case = cell.swept.get("case")
    return tuple(dict.fromkeys([*([str(case)] if case else []), Path(cell.scene).stem]))


def differing(cells: list[Cell], keys: tuple[str, ...]) -> tuple[str, ...]:
    """Those parameters that the cells do not agree in."""
    return tuple(key for key in keys if len({str(cell.parameters.get(key)) for cell in cells}) > 1)


def picture(results: Results, cell: Cell) -> np.ndarray | Missing:
    """The picture that a cell stored, float64 (height, width, 3), whatever the judge says of it, or why there is none.

    One with pixels that are not finite is Missing.
    """
    record = results.record(cell)
    if record is None or not record["picture"]:
        return Missing(cell.verdict if cell.status != "ok" else "no picture was stored")
    found = array(results, record["picture"]["file"])
    if not isinstance(found, Missing) and not np.isfinite(found).all():
        return Missing(f"its picture is not finite: {cell.verdict}")
    return found


def array(results: Results, file: str | None) -> np.ndarray | Missing:
    """An array in the folder of the run, as float64, or why it cannot be had."""
    if file is None:
        return Missing("the run does not name it")
    try:
        return np.load(results.folder / file, allow_pickle=False).astype(np.float64)
    except (OSError, ValueError):
        return Missing(f"{file} is not there")
