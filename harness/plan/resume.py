"""Resumes a run that was cut off: checks that nothing has changed, and returns the rows that exist."""

import json
from collections.abc import Iterable
from pathlib import Path

from harness.errors import UserError
from harness.machine import environment, fingerprint
from harness.plan.plan import Cell, Plan
from harness.store import store
from harness.store.record import identity

# What must be the same of the machine and its software, or the rows of one run would be of two.
MACHINE = fingerprint.MACHINE + fingerprint.SOFTWARE
CELL = ("renderer_version", "scene_version", "parameters", "needs")


def check(folder: Path, plan: Plan) -> tuple[dict, list[dict]]:
    """run.json and the rows of the run in `folder`. UserError, naming all that has changed, if they may not be mixed.

    Cells and repetitions that the run does not have are not changes: they are what is missing.
    """
    facts, records = store.read(folder)
    changes = _changes("this machine: ", facts["environment"], environment.capture(), MACHINE)
    changes += of_cells(facts["cells"], plan.cells, CELL)
    if changes:
        shown = [*changes[:10], *([f"and {len(changes) - 10} more"] if len(changes) > 10 else [])]
        remedy = "start a new run, and compare the two"
        raise UserError(f"{folder}: what it was made with has changed:\n  " + "\n  ".join(shown), remedy=remedy)
    return facts, records


def of_cells(before: list[dict], now: Iterable[Cell], names: tuple[str, ...]) -> list[str]:
    """A line for each value of `names` that is not what it was in the cell of the same identity; new cells are none."""
    known, found = {identity(cell): cell for cell in before}, []
    for cell in now:
        facts = cell.facts()
        found += _changes(f"{cell.label}: ", known.get(identity(facts), facts), facts, names)
    return found


def _changes(where: str, before: dict, now: dict, names: tuple[str, ...]) -> list[str]:
    """A line for each value that is not the same."""
    found = fingerprint.changes(before, json.loads(json.dumps(now)), names)
    return [f"{where}{name} was {json.dumps(old)}, is {json.dumps(new)}" for name, old, new in found]
