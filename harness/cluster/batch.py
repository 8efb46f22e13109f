"""Cuts a plan into batches, one for each cluster job; cells that are compared with each other stay on one host."""

import json
import math
from dataclasses import dataclass, replace

from harness.plan.plan import Cell, Plan, pair_of
from harness.plan.predict import Predictor
from harness.store.record import identity

FILL = 0.8  # share of a job's time that a batch is predicted to take, at most


@dataclass(frozen=True)
class Batch:
    """A part of a plan for one job. pair: the cell that runs twice in each round, for the noise floor of the host; None
    for the given `reason`. seconds: predicted duration, None if unknown."""

    cells: tuple[Cell, ...]
    pair: Cell | None
    reason: str
    seconds: float | None = None

    def of(self, plan: Plan) -> Plan:
        """`plan` with this batch's cells alone; its truths are those of the whole plan."""
        versions = {cell_or_whole.scene_version for cell in self.cells for cell_or_whole in (cell, cell.whole or cell)}
        arrays = {version: arrays for version, arrays in plan.arrays.items() if version in versions}
        return replace(plan, cells=self.cells, arrays=arrays, pair=self.pair, pair_reason=self.reason)

    def record(self) -> dict:
        """For run.json; cells are recorded by name()."""
        named = [list(name(cell)) for cell in self.cells]
        return {"cells": named, "pair": list(name(self.pair)) if self.pair else None, "reason": self.reason}


def name(cell: Cell) -> tuple[str, str, str]:
    """The identity of a cell in the experiment, equal on all hosts: variant, scene, point."""
    return identity(cell.facts())


def restored(record: dict, plan: Plan) -> Batch:
    """The Batch of a Batch.record(), from a plan that was made again. KeyError if a cell is no longer in it."""
    cells = {name(cell): cell for cell in plan.cells}
    pair = cells[tuple(record["pair"])] if record["pair"] else None
    return Batch(tuple(cells[tuple(cell_name)] for cell_name in record["cells"]), pair, record["reason"])


def make(plan: Plan, wanted: str, most: int, time: float, predictor: Predictor) -> list[Batch]:
    """The batches of a plan, each with at most `most` cells and a predicted duration of at most FILL * `time` (s).

    Exception: cells of one scene at one point, whole or without something, are compared with each other, and always
    stay together. wanted: measure.pair of the experiment.
    """
    places: dict[tuple, list[Cell]] = {}
    for cell in plan.cells:
        point = {key: value for key, value in cell.point.items() if key != "without"}
        places.setdefault((cell.scene, json.dumps(point, sort_keys=True)), []).append(cell)
    groups: list[list[Cell]] = []
    filled = math.inf
    for cells in places.values():
        seconds = sum(_seconds(cell, predictor, plan) or 0.0 for cell in cells)
        seconds += len(plan.truths_of(cells)) * predictor.truth
        if not groups or len(groups[-1]) + len(cells) > most or filled + seconds > FILL * time:
            groups.append([])
            filled = 0.0
        groups[-1] += cells
        filled += seconds
    return [_batch(tuple(cells), wanted, predictor, plan) for cells in groups]


def _batch(cells: tuple[Cell, ...], wanted: str, predictor: Predictor, plan: Plan) -> Batch:
    pair, reason = pair_of(cells, wanted)
    durations = [_seconds(cell, predictor, plan) for cell in cells]
    truths = len(plan.truths_of(cells)) * predictor.truth
    return Batch(cells, pair, reason, None if None in durations else sum(durations) + truths)


def _seconds(cell: Cell, predictor: Predictor, plan: Plan) -> float | None:
    """The predicted duration of all repetitions of a cell; a cold one is assumed to last as long as the first."""
    later = predictor.seconds(cell)
    if later is None:
        return None
    first = predictor.seconds(cell, first=True) or later
    again = cell.processes * first.seconds if plan.cold else 0.0
    counting = (predictor.count(cell) or 0.0) if plan.count else 0.0
    return first.seconds + (cell.processes - 1) * later.seconds + again + counting
