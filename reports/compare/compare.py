"""Compares two runs cell by cell: faster, slower, not resolved, picture changed.

Two cells match if variant, scene and swept values have the same names. They are compared if the scene's content and
all parameters of the picture are equal too, both are ranked, and both have enough processes for an interval. The runs
were not interleaved, so processes are not paired, and a ratio counts only beyond the larger of the two noise floors,
and if its whole interval is beyond what the machine may have drifted by between the runs (drift.py).
"""

import json
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from harness.errors import UserError
from harness.statistics import statistics
from harness.statistics.statistics import Estimate, Floor
from harness.store import store
from reports.compare import drift, instructions, pictures, runs
from reports.compare.drift import Drift
from reports.compare.instructions import Counts
from reports.compare.pictures import Difference
from reports.run import naming, ranking, results
from reports.run.results import Cell, Results

CHANGED, INCOMPARABLE, ONLY_A, ONLY_B = "picture changed", "not comparable", "only in A", "only in B"
VERDICTS = "slower", "faster", statistics.NOT_RESOLVED, CHANGED, INCOMPARABLE, ONLY_A, ONLY_B


@dataclass(frozen=True)
class Row:
    """The change of a cell between two runs.

    time: faster, slower, not resolved, or not comparable, for `reason`; "" if it is in one run only. a, b: medians over
    processes of the steady times, s. ratio: b / a. picture: None without two pictures. only: the verdict on a cell of
    one run only, else "". broken: it was ok in A and is not in B. unchanged: renderer, scene, machine and software are
    the same, so that any change of its time is drift. counts: of instructions; None if none of the runs counted any.
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

    def slower(self, percent: float) -> list[Row]:
        """Returns the cells that are significantly slower by more than `percent`, with the whole interval and though
        the machine may have drifted.

        UserError if no cell was compared and none broke, or if one changed and the drift is unknown: a gate must not
        pass without a comparison.
        """
        compared = [row for row in self.rows if row.ratio is not None and row.time != INCOMPARABLE]
        if not self.broken and not compared:
            raise UserError(f"{self.a}, {self.b}: no cell could be compared; see the reasons above")
        if not self.broken and self.drift.value is None and not all(row.unchanged for row in compared):
            raise UserError(f"{self.a}, {self.b}: drift of the machine between them: {self.drift.source}")
        least = (1 + percent / 100) * (1 + (self.drift.value or 0))
        return [row for row in self.rows if row.time == "slower" and row.ratio.low > least]

    def more_instructions(self, percent: float) -> list[Row]:
        """Returns the cells that take more instructions by more than `percent`.

        UserError if no instructions were compared and no cell broke: a gate must not pass without a comparison.
        """
        compared = [row for row in self.rows if row.counts is not None and row.counts.ratio is not None]
        if not self.broken and not compared:
            reasons = dict.fromkeys(f"{row.name}: {row.counts.reason}" for row in self.rows if row.counts)
            why = "; ".join(reasons) or "none of the runs counted any"
            raise UserError(
                f"{self.a}, {self.b}: instructions of no cell could be compared: {why}",
                remedy="run both with --set measure.count=true, on machines where `rayrace doctor` names the same tool",
            )
        return [row for row in compared if row.counts.more(percent)]


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
        _row(name, a, b, cell, named_b[key][1], _larger(floors), moved, same)
        if key in named_b
        else Row(name, only=ONLY_A)
        for key, (name, cell) in named_a.items()
    ]
    rows += [Row(name, only=ONLY_B) for key, (name, _) in named_b.items() if key not in named_a]
    return Comparison(Path(folder_a), Path(folder_b), machine, others, floors, moved, rows)


def _named(run: Results) -> list[tuple[str, Cell]]:
    return list(zip(naming.names(run.cells), run.cells, strict=True))


def _identity(cell: Cell) -> tuple:
    return cell.variant, cell.scene, json.dumps(cell.swept, sort_keys=True)


def _larger(floors: tuple[Floor, Floor]) -> float | None:
    return max((floor.value for floor in floors if floor.value is not None), default=None)


def _row(name: str, a: Results, b: Results, cell_a: Cell, cell_b: Cell, floor, moved: Drift, same: bool) -> Row:
    """same: machine and software are."""
    another = other_job(a, b, cell_a, cell_b)
    if another:
        return Row(name, INCOMPARABLE, another)
    right = cell_a.status == cell_b.status == "ok"
    picture = pictures.compare(a, b, cell_a, cell_b) if right else None
    counts = instructions.compare(a, b, cell_a, cell_b)
    unranked = [f"in {which}: {cell.unranked}" for which, cell in (("A", cell_a), ("B", cell_b)) if cell.unranked]
    if unranked:
        broken = cell_a.status == "ok" != cell_b.status
        return Row(name, INCOMPARABLE, "; ".join(unranked), picture=picture, broken=broken, counts=counts)
    ratio, unchanged = ranking.unpaired(cell_b, cell_a), same and drift.unchanged(a, b, cell_a, cell_b)
    time = INCOMPARABLE if ratio.low is None else statistics.verdict(ratio, floor)
    if time in ("slower", "faster") and (unchanged or moved.value is None or not _beyond(ratio, moved.value)):
        time = statistics.NOT_RESOLVED
    medians = cell_a.steady, cell_b.steady
    return Row(name, time, ratio.note, *medians, ratio, picture, unchanged=unchanged, counts=counts)


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
