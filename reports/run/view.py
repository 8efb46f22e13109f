"""Groups cells into views: cells that show the same thing by different means."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from reports.run import launch, words
from reports.run.results import Cell, grouped, point_label

# A right picture does not depend on these parameters.
UNSEEN = (*launch.UNSEEN, "threads", "frames", "least_frame", "walk", "accel", "kernel")


@dataclass(frozen=True)
class View:
    """Cells with one scene and equal parameters except a few.

    label: its name in CSV files. title: the same in words. names: its cases and scene, which theory may use.
    """

    label: str
    title: str
    names: tuple[str, ...]
    cells: list[Cell]


def views(cells: list[Cell], free: tuple[str, ...], stands: Callable[[Cell], Cell] = lambda cell: cell) -> list[View]:
    """Returns views of cells that differ only in the variant and in the parameters `free` and UNSEEN; no exhibits.

    stands: returns the cell whose point and parameters decide in which view a cell is.
    """
    groups = grouped(
        (cell for cell in cells if not cell.apart),
        lambda cell: (cell.scene, launch.counts(stands(cell)), launch.rest(stands(cell), (*free, *UNSEEN))),
    )
    return [
        View(_label(group, free, point_label), _label(group, free, words.of_point), _names(group), group)
        for group in groups.values()
    ]


def _label(cells: list[Cell], free: tuple[str, ...], wording: Callable[[dict], str]) -> str:
    swept = {key: value for key, value in cells[0].swept.items() if key not in (*free, *UNSEEN, "case")}
    names = _names(cells)
    names = names if len(names) < 3 else names[-1:]  # of several cases their scene
    return ", ".join([*names, *([wording(swept)] if swept else [])])


def _names(cells: list[Cell]) -> tuple[str, ...]:
    cases = [str(case) for cell in cells if (case := cell.swept.get("case"))]
    return tuple(dict.fromkeys([*cases, Path(cells[0].scene).stem]))


def differing(cells: list[Cell], keys: tuple[str, ...]) -> tuple[str, ...]:
    """Returns the parameters in which the cells differ."""
    return tuple(key for key in keys if len({str(cell.parameters.get(key)) for cell in cells}) > 1)
