"""Compares two runs cell by cell: faster, slower, not resolved, picture changed.

Two cells match if variant, scene and swept values have the same names. They are compared if the scene's content and
all parameters of the picture are equal too, both are ranked, and both have enough processes for an interval. The runs
were not interleaved, so processes are not paired, and a ratio counts only beyond the larger of the two noise floors,
and if its whole interval is beyond what the machine may have drifted by between the runs (drift.py).
"""

import json
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from harness.errors import UserError
from harness.statistics import statistics
from harness.statistics.statistics import Estimate, Floor
from harness.store import store
from reports.compare import drift, instructions, pictures, runs, witness
from reports.compare.drift import Drift
from reports.compare.instructions import Counts
from reports.compare.pictures import Difference
from reports.compare.witness import Witness
from reports.run import naming, ranking, results
from reports.run.results import Cell, Results

CHANGED, INCOMPARABLE, ONLY_A, ONLY_B = "picture changed", "not comparable", "only in A", "only in B"
VERDICTS = "slower", "faster", statistics.NOT_RESOLVED, CHANGED, INCOMPARABLE, ONLY_A, ONLY_B


@dataclass(frozen=True)
class Row:
    """The change of a cell between two runs.

    time: faster, slower, not resolved, or not comparable, for `reason`; "" if it is in one run only. a, b: medians over
    processes of the times that `witness` chose, s. ratio: b / a. picture: None without two pictures. only: the verdict
    on a cell of one run only, else "". broken: it was ok in A and is not in B. unchanged: renderer, scene, machine and
    software are the same, so that any change of its time is drift. counts: of instructions; None if none of the runs
    counted any. wanted: it was ok in A, so that there is something to hold B against. floor: the larger noise floor of
    these times.
    """

    name: str
    time: str = ""
    reason: str = ""
    a: Estimate | None = None
    b: Estimate | None = None
    ratio: Estimate | None = None
    picture: Difference | None = None
    only: str = ""
    broken: bool = False
    unchanged: bool = False
    counts: Counts | None = None
    wanted: bool = True
    witness: Witness | None = None
    floor: float | None = None

    @property
    def verdict(self) -> str:
        """One of VERDICTS. A changed picture comes first: a cell that renders something else has not become faster."""
        if self.only:
            return self.only
        return CHANGED if self.picture is not None and self.picture.changed else self.time


@dataclass(frozen=True)
class Comparison:
    """Two runs compared. a, b: their folders. machine, others: lines on differences. floors: noise floors of both.
    drift: of the machine between them.
    """

    a: Path
    b: Path
    machine: list[str]
    others: list[str]
    floors: tuple[Floor, Floor]
    drift: Drift
    rows: list[Row]

    @property
    def floor(self) -> float | None:
        """The larger known noise floor; None if none is known."""
        return _larger(self.floors)

    @property
    def counts(self) -> dict[str, int]:
        """The number of rows by verdict."""
        counts = Counter(row.verdict for row in self.rows)
        return {verdict: counts[verdict] for verdict in VERDICTS if counts[verdict]}

    @property
    def broken(self) -> list[Row]:
        """The cells that were ok in A and are not in B."""
        return [row for row in self.rows if row.broken]


def compare(folder_a: Path, folder_b: Path, host: str = "") -> Comparison:
    """Compares run B with run A. host: the one to use of runs on several hosts.

    UserError if a folder holds no run, or if no cell is in both.
    """
    a, b = (results.load(folder, store.named(folder, host)) for folder in (folder_a, folder_b))
    named_a, named_b = (dict(zip(map(_identity, run.cells), _named(run), strict=True)) for run in (a, b))
    both = [(cell, named_b[key][1]) for key, (_, cell) in named_a.items() if key in named_b]
    if not both:
        raise UserError(f"{folder_a}, {folder_b}: no cell has the same variant, scene and swept values in both")
    floors, moved = (a.floor, b.floor), drift.between(a, b, [pair for pair in both if not other_job(a, b, *pair)])
    machine, others = runs.machine(a, b), runs.others(a, b, both)
    same = not machine and not runs.software(a, b)
    rows = [
        _row(name, a, b, cell, named_b[key][1], moved, same) if key in named_b else Row(name, only=ONLY_A)
        for key, (name, cell) in named_a.items()
    ]
    rows += [Row(name, only=ONLY_B) for key, (name, _) in named_b.items() if key not in named_a]
    return Comparison(Path(folder_a), Path(folder_b), machine, others, floors, moved, rows)


def _named(run: Results) -> list[tuple[str, Cell]]:
    return list(zip(naming.names(run.cells), run.cells, strict=True))


def _identity(cell: Cell) -> tuple:
    return cell.variant, cell.scene, json.dumps(cell.swept, sort_keys=True)


def _larger(floors: Iterable[Floor]) -> float | None:
    return max((floor.value for floor in floors if floor.value is not None), default=None)


def _row(name: str, a: Results, b: Results, cell_a: Cell, cell_b: Cell, moved: Drift, same: bool) -> Row:
    """same: machine and software are."""
    another = other_job(a, b, cell_a, cell_b)
    wanted = cell_a.status == "ok" and not cell_a.as_meant
    if another:
        return Row(name, INCOMPARABLE, another, wanted=wanted)
    right = cell_a.status == cell_b.status == "ok"
    picture = pictures.compare(a, b, cell_a, cell_b) if right else None
    counts = instructions.compare(a, b, cell_a, cell_b)
    unranked = [f"in {which}: {cell.unranked}" for which, cell in (("A", cell_a), ("B", cell_b)) if cell.unranked]
    if unranked:
        broken = cell_a.status == "ok" != cell_b.status
        why = "; ".join(unranked)
        return Row(name, INCOMPARABLE, why, picture=picture, broken=broken, counts=counts, wanted=wanted)
    chosen, unchanged = witness.of((a, cell_a), (b, cell_b)), same and drift.unchanged(a, b, cell_a, cell_b)
    ratio, floor = ranking.unpaired(cell_b, cell_a, chosen.column), _larger([x.floor_by(chosen.column) for x in (a, b)])
    time = INCOMPARABLE if ratio.low is None else statistics.verdict(ratio, floor)
    if time in ("slower", "faster") and (unchanged or moved.value is None or not _beyond(ratio, moved.value)):
        time = statistics.NOT_RESOLVED
    medians = (statistics.median(cell.values(chosen.column)) for cell in (cell_a, cell_b))
    more = {"unchanged": unchanged, "counts": counts, "witness": chosen, "floor": floor}
    return Row(name, time, ratio.note, *medians, ratio, picture, **more)


def _beyond(ratio: Estimate, moved: float) -> bool:
    """Whether the whole interval of a ratio differs from 1 by more than a drift."""
    return statistics.difference(ratio.low if ratio.value > 1 else ratio.high) > moved


def other_job(a: Results, b: Results, cell_a: Cell, cell_b: Cell) -> str:
    """Returns why two cells were not asked for the same picture, "" if they were."""
    if len({_scene_version(a, cell_a), _scene_version(b, cell_b)} - {None}) > 1:
        return "the content of the scene changed"
    changed = [
        f"{name} {cell_a.parameters[name]} -> {cell_b.parameters[name]}"
        for name in runs.changed_picture(cell_a, cell_b)
    ]
    return f"another picture was asked for: {', '.join(changed)}" if changed else ""


def _scene_version(run: Results, cell: Cell) -> str | None:
    return (run.record(cell) or {}).get("scene_version")
