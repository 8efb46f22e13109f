"""Resumes a run that was cut off: checks that nothing has changed, and returns its rows."""

import dataclasses
import json
from collections.abc import Iterable
from pathlib import Path

from harness.errors import UserError
from harness.machine import environment, fingerprint
from harness.plan.plan import Cell, Plan
from harness.renderer.parameters import Parameters
from harness.store import store
from harness.store.record import identity

# Properties of machine and software that must not change during a run.
MACHINE = fingerprint.MACHINE + fingerprint.SOFTWARE
DEFAULTS = {
    field.name: field.default for field in dataclasses.fields(Parameters) if field.default is not dataclasses.MISSING
}
CELL = ("renderer_version", "scene_version", "parameters", "needs")


def check(folder: Path, plan: Plan) -> tuple[dict, list[dict]]:
    """run.json and the rows of the run in `folder`. UserError if the machine, its software or a cell has changed.

    Cells and repetitions that the run does not have yet are no changes.
    """
    facts, records = store.read(folder)
    changes = _changes("this machine: ", facts["environment"], environment.capture(), MACHINE)
    # A parameter that older versions did not have may change the identifiers alone, and rows would not match.
    changes += of_cells(facts["cells"], plan.cells, CELL) or of_cells(facts["cells"], plan.cells, ("cell",))
    refuse(folder, changes, "start a new run, and compare the two")
    return facts, records


def refuse(folder: Path, changes: list[str], remedy: str) -> None:
    """UserError with the first ten of `changes`, if there are any."""
    if changes:
        shown = [*changes[:10], *([f"and {len(changes) - 10} more"] if len(changes) > 10 else [])]
        raise UserError("\n  ".join([f"{folder}: it cannot be resumed after these changes:", *shown]), remedy=remedy)


def of_cells(before: list[dict], now: Iterable[Cell], names: tuple[str, ...]) -> list[str]:
    """A line for each value of `names` that differs from that of the same cell before; new cells are no changes.

    A parameter that an older version did not have had the value that is the default now.
    """
    cells, changes = {identity(cell): cell | {"parameters": DEFAULTS | cell["parameters"]} for cell in before}, []
    for cell in now:
        facts = cell.facts()
        changes += _changes(f"{cell.label}: ", cells.get(identity(facts), facts), facts, names)
    return changes


def _changes(where: str, before: dict, now: dict, names: tuple[str, ...]) -> list[str]:
    """A line for each value that differs."""
    changes = fingerprint.changes(before, json.loads(json.dumps(now)), names)
    readable = [change for change in changes if not any(map(_unread, change[1:]))]
    return [f"{where}{name} was {json.dumps(old)}, is {json.dumps(new)}" for name, old, new in readable]


def _unread(value) -> bool:
    """Whether an error of the system kept a fact from being read: it says nothing of a change."""
    return isinstance(value, str) and value.startswith("unavailable: [Errno ")
