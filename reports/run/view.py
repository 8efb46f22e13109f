"""Views: groups cells of a run that show the same thing by other means."""

from dataclasses import dataclass
from pathlib import Path

from reports.run import launch
from reports.run.results import Cell, point_label

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
            key = cell.scene, launch.counts(cell), launch.rest(cell, (*free, *UNSEEN))
            found.setdefault(key, []).append(cell)
    return [View(_label(mine, free), _names(mine[0]), mine) for mine in found.values()]


def _label(cells: list[Cell], free: tuple[str, ...]) -> str:
    swept = {key: value for key, value in cells[0].swept.items() if key not in (*free, *UNSEEN, "case")}
    return ", ".join([*_names(cells[0]), *([point_label(swept)] if swept else [])])


def _names(cell: Cell) -> tuple[str, ...]:
    case = cell.swept.get("case")
    return tuple(dict.fromkeys([*([str(case)] if case else []), Path(cell.scene).stem]))


def differing(cells: list[Cell], keys: tuple[str, ...]) -> tuple[str, ...]:
    """Returns the parameters in which the cells differ."""
    return tuple(key for key in keys if len({str(cell.parameters.get(key)) for cell in cells}) > 1)
