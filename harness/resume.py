"""Going on with a run that was cut off: whether its rows may stand beside new ones, and which are there."""

import json
from pathlib import Path

from harness import environment, row, store
from harness.errors import UserError
from harness.plan import Plan

# What must be the same of the machine and its software, or the rows of one run would be of two.
MACHINE = (
    *("host", "os", "kernel", "cpu", "architecture", "cores", "memory_bytes", "gpu"),
    *("python", "compilers", "packages"),
)
CELL = ("renderer_version", "scene_version", "parameters", "needs")


def check(folder: Path, plan: Plan) -> tuple[dict, list[dict]]:
    """run.json and the rows of the run in `folder`. UserError, naming all that has changed, if they may not be mixed.

    Cells and repetitions that the run does not have are not changes: they are what is missing.
    """
    facts, records = store.read(folder)
    changes = _changes("this machine: ", facts["environment"], environment.capture(), MACHINE)
    before = {_identity(cell): cell for cell in facts["cells"]}
    for cell in plan.cells:
        now = row.facts(cell)
        old = before.get(_identity(now), now)
        changes += _changes(f"{cell.label}: ", old, now, CELL)
    if changes:
        shown = [*changes[:10], *([f"and {len(changes) - 10} more"] if len(changes) > 10 else [])]
        remedy = "start a new run, and compare the two"
        raise UserError(f"{folder}: what it was made with has changed:\n  " + "\n  ".join(shown), remedy=remedy)
    return facts, records


def _identity(cell: dict) -> tuple:
    """What an experiment calls a cell, whatever is behind the names."""
    return cell["variant"], cell["scene"], json.dumps(cell["point"], sort_keys=True)


def _changes(where: str, before: dict, now: dict, names: tuple[str, ...], prefix: str = "") -> list[str]:
    """A line for each value that is not the same; tables are looked into."""
    now, found = json.loads(json.dumps(now)), []
    for name in names:
        old, new = before.get(name), now.get(name)
        if isinstance(old, dict) and isinstance(new, dict):
            found += _changes(where, old, new, tuple(sorted({*old, *new})), f"{prefix}{name}.")
        elif old != new:
            found.append(f"{where}{prefix}{name} was {json.dumps(old)}, is {json.dumps(new)}")
    return found
