"""Finds what runs on this machine have measured of one picture: its methods with their errors and times."""

from dataclasses import dataclass
from pathlib import Path

from harness.errors import UserError
from harness.store import record, store
from reports.run import method, results
from reports.run.cell import Cell
from reports.run.results import Results


@dataclass(frozen=True)
class Advice:
    """A method that a run has measured.

    parameters: its values by name. rmse: linear RGB; standard_error: of that, with what half the
    depth of the truth changes. seconds: of a steady frame. run: its folder.
    """

    variant: str
    parameters: dict
    rmse: float
    standard_error: float
    seconds: float
    run: Path


@dataclass(frozen=True)
class Wanted:
    """A picture to render.

    scene: hash of its arrays. picture: values of parameters that say what is seen. against: "scene" or "centres".
    given: methods that the user fixed, by name. variant: the one that the user fixed, or "". here: the identity of this
    machine.
    """

    scene: str
    picture: dict
    against: str
    given: dict
    variant: str
    here: dict[str, str]


def find(folder: Path, wanted: Wanted) -> list[Advice]:
    """The methods of the newest run in `folder` that measured this very picture, the quickest first; [] if none did."""
    for run in sorted(folder.glob("*/run.json"), key=lambda path: path.stat().st_mtime, reverse=True):
        try:
            facts, records = store.read(run.parent)
        except UserError:  # of another format, or damaged
            continue
        machine = facts.get("environment", {})
        if not facts.get("cells") or any(machine.get(name) != value for name, value in wanted.here.items()):
            continue
        if not any(record.get("scene_version") == wanted.scene for record in records):
            continue
        loaded = results.load(run.parent)
        if methods := [advice for cell in loaded.cells if (advice := _advice(loaded, cell, wanted))]:
            return sorted(methods, key=lambda advice: advice.seconds)
    return []


def _advice(loaded: Results, cell: Cell, wanted: Wanted) -> Advice | None:
    cell_record = loaded.record(cell)
    if cell_record is None or cell_record.get("scene_version") != wanted.scene or cell.unranked:
        return None
    error, same = cell_record.get("error") or {}, {**wanted.picture, **wanted.given}
    if "rmse_standard_error" not in error or error.get("against") != wanted.against:
        return None  # held against another truth, or by a version before 0.2
    if any(cell.parameters.get(name) != value for name, value in same.items()) or wanted.variant not in (
        "",
        cell.variant,
    ):
        return None
    doubt = error["rmse_standard_error"] + record.doubt(error)
    return Advice(cell.variant, method.of(cell), error["rmse"], doubt, cell.steady.value, loaded.folder)
