"""Pairs the cells of smaller models with those of their whole scenes: [leave_out] of an experiment."""

import json
from functools import lru_cache

from harness.store.record import WHOLE
from reports.run.cell import Cell
from reports.run.results import Results

KEY = "without"  # of a point


def without(cell: Cell) -> str:
    """Returns what is left out of the scene or the job of a cell; "" if nothing is."""
    name = cell.swept.get(KEY, WHOLE)
    return "" if name == WHOLE else name


@lru_cache(maxsize=4)
def wholes(results: Results) -> dict[Cell, Cell]:
    """Returns for each cell without something the cell of the same variant and point with nothing left out, if the run
    has that."""
    by_place = {_place(cell): cell for cell in results.cells if not without(cell)}
    pairs = ((cell, by_place.get(_place(cell))) for cell in results.cells if without(cell))
    return {cell: whole for cell, whole in pairs if whole}


def _place(cell: Cell) -> tuple[str, str, str]:
    rest = {key: value for key, value in cell.swept.items() if key != KEY}
    return cell.variant, cell.scene, json.dumps(rest, sort_keys=True)
