"""Cuts a plan into batches, one a cluster job: cells that are compared with each other stay on one host."""

import json
import math
from dataclasses import dataclass, replace

from harness.plan.plan import Cell, Plan, Turn, pair_of
from harness.plan.predict import Predictor
from harness.store.record import identity

FILL = 0.8  # of a job's time, as it is predicted, that a batch is to take


@dataclass(frozen=True)
class Batch:
    """cells: of the plan. pair: that of them which is run twice in each round, for the noise floor of the job's host
    while it ran; None: `reason`. seconds: predicted; None if that cannot be."""

    cells: tuple[Cell, ...]
    pair: Cell | None
    reason: str
    seconds: float | None = None

    def of(self, plan: Plan) -> Plan:
        """The part of the plan. What is the truth is said by the whole of it."""
        versions = {cell.scene_version for cell in self.cells}
        arrays = {version: arrays for version, arrays in plan.arrays.items() if version in versions}
        return replace(plan, cells=self.cells, arrays=arrays, pair=self.pair, pair_reason=self.reason)

    def record(self) -> dict:
        """For run.json: its cells by what the experiment calls them."""
        named = [list(name(cell)) for cell in self.cells]
        return {"cells": named, "pair": list(name(self.pair)) if self.pair else None, "reason": self.reason}


def name(cell: Cell) -> tuple[str, str, str]:
    """The identity of a cell in the experiment, which is the same on all hosts."""
    return identity(cell.facts())


def restored(record: dict, plan: Plan) -> Batch:
    """The batch that Batch.record told, of a plan that was made anew. KeyError if a cell is no longer in it."""
    known = {name(cell): cell for cell in plan.cells}
    pair = known[tuple(record["pair"])] if record["pair"] else None
    return Batch(tuple(known[tuple(told)] for told in record["cells"]), pair, record["reason"])


def make(plan: Plan, wanted: str, most: int, time: float, predictor: Predictor) -> list[Batch]:
    """The batches of a plan, none of more than `most` cells or longer than `time` (s) if it is known, but for cells of
    one scene at one point: these are compared with each other, and stay together.

    wanted: measure.pair of the experiment.
    """
    places: dict[tuple, list[Cell]] = {}
    for cell in plan.cells:
        places.setdefault((cell.scene, json.dumps(cell.point, sort_keys=True)), []).append(cell)
    groups: list[list[Cell]] = []
    filled = math.inf
    for cells in places.values():
        seconds = sum(_seconds(cell, predictor, plan.cold) or 0.0 for cell in cells)
        if not groups or len(groups[-1]) + len(cells) > most or filled + seconds > FILL * time:
            groups.append([])
            filled = 0.0
        groups[-1] += cells
        filled += seconds
    return [_batch(tuple(cells), wanted, predictor, plan.cold) for cells in groups]


def _batch(cells: tuple[Cell, ...], wanted: str, predictor: Predictor, cold: bool) -> Batch:
    pair, reason = pair_of(cells, wanted)
    known = [_seconds(cell, predictor, cold) for cell in cells]
    return Batch(cells, pair, reason, None if None in known else sum(known))


def _seconds(cell: Cell, predictor: Predictor, cold: bool) -> float | None:
    """Predicted for all repetitions of a cell; a cold one is taken to last as long as a first."""
    later = predictor.seconds(cell)
    if later is None:
        return None
    first = predictor.seconds(cell, first=True) or later
    again = cell.processes * first.seconds if cold else 0.0
    return first.seconds + (cell.processes - 1) * later.seconds + again


def turns(plan: Plan, batch: Batch, seed: int, how: str) -> list[Turn]:
    """All that a batch runs."""
    return batch.of(plan).order(seed, how)
