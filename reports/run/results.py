"""Loads a run: a pandas DataFrame with one row a repetition, and its cells in the order of the experiment.

Of the cells of a place, those that take no part in comparisons come last.
"""

import gc
from collections.abc import Collection
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import pandas as pd

from harness.statistics import statistics
from harness.statistics.statistics import Floor
from harness.store import store
from harness.store.record import CONTRADICTED
from reports.run import repetition
from reports.run.cell import Cell, Missing, Table

__all__ = ["Cell", "Missing", "Results", "load", "place_label", "point_label"]

MOST_CONTRADICTED = 1 / 2  # of the good repetitions of a cell that is ranked


@dataclass(frozen=True, eq=False)
class Results:
    """folder: of the run. facts: its run.json. repetitions: one row each. records: as stored, in the same order."""

    folder: Path
    facts: dict
    records: list[dict]
    repetitions: pd.DataFrame
    cells: list[Cell]

    @property
    def scenes(self) -> list[str]:
        return list(self._by_scene)

    @property
    def places(self) -> list[tuple[str, str]]:
        return list(self._by_place)

    @cached_property
    def variants(self) -> list[str]:
        return list(dict.fromkeys(cell.variant for cell in self.cells))

    def of(self, scene: str) -> list[Cell]:
        return self._by_scene[scene]

    def at(self, place: tuple[str, str]) -> list[Cell]:
        return self._by_place[place]

    @cached_property
    def _by_scene(self) -> dict[str, list[Cell]]:
        return _grouped(self.cells, lambda cell: cell.scene)

    @cached_property
    def _by_place(self) -> dict[tuple[str, str], list[Cell]]:
        return _grouped(self.cells, lambda cell: cell.place)

    @property
    def floor(self) -> Floor:
        """The noise floor of the run, from its A/A pair."""
        return self._floor[0]

    @property
    def pair(self) -> str:
        """The label of the cell that was run twice in every round; "" if none was."""
        return self._floor[1]

    @cached_property
    def _floor(self) -> tuple[Floor, str]:
        """Returns the largest noise floor over the A/A pairs of all jobs, as any two cells may be of that job."""
        pairs = self.facts.get("pairs") or [self.facts.get("pair") or {"unavailable": "the run has no A/A pair"}]
        found = [self._of_pair(pair) for pair in pairs]
        known = [told for told in found if told[0].value is not None]
        return max(known, key=lambda told: told[0].value) if known else found[0]

    def _of_pair(self, pair: dict) -> tuple[Floor, str]:
        if "unavailable" in pair:
            return Floor(None, pair["unavailable"]), ""
        mine = self.repetitions[(self.repetitions["cell"] == pair["cell"]) & (self.repetitions["status"] == "ok")]
        mine = mine[~mine["unranked"].fillna("").str.startswith(CONTRADICTED)]
        told = mine.dropna(subset="steady_s").pivot_table(index="repetition", columns="pass", values="steady_s")
        both = told.reindex(columns=["timed", "pair"]).dropna()
        return statistics.noise_floor(both["timed"].tolist(), both["pair"].tolist()), pair["label"]

    def record(self, cell: Cell) -> dict | None:
        """The stored record of its first repetition that has a picture or was good, else of its first."""
        mine = [self.records[row] for row in cell.timed]
        return next((record for record in mine if record["picture"]), next(iter(mine), None))


def load(folder: Path, hosts: Collection[str] | None = None) -> Results:
    """The run in `folder`; hosts: of several, those that are taken as one machine. UserError if it is none, or of
    several hosts and they are not named."""
    with _without_collecting():
        return _load(folder, hosts)


@contextmanager
def _without_collecting():
    """Nothing is garbage while a run is read, and looking for it takes as long as reading 100,000 rows."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


def _load(folder: Path, hosts: Collection[str] | None) -> Results:
    facts, records = store.read_complete(folder, hosts)
    rows = [{**repetition.row(record), "point": point_label(record["point"]), "outlier": False} for record in records]
    groups: dict[tuple, list[int]] = {}
    for number, row in enumerate(rows):
        groups.setdefault((row["scene"], row["point"], row["variant"]), []).append(number)
    for mine in groups.values():
        _mark_outliers([rows[number] for number in mine])
    table = Table(pd.DataFrame(rows, columns=[*repetition.COLUMNS, "outlier"]))
    on_gpu = {record["variant"] for record in records if record.get("device") or record.get("gpu")}
    cells = {}
    for told in [*facts["cells"], *records]:
        name = told["scene"], point_label(told["point"]), told["variant"]
        if name in cells:
            continue
        mine = groups.get(name, [])
        stored = [records[number] for number in mine]
        cells[name] = Cell(
            *name,
            told["parameters"],
            table,
            [number for number in mine if rows[number]["pass"] == "timed"],
            [number for number in mine if rows[number]["pass"] == "load"],
            told["point"],
            _apart(stored),
            any((record.get("device") or {}).get("simulated") for record in stored),
            name[2] in on_gpu,
        )
    by_place = _grouped(cells.values(), lambda cell: cell.place).values()
    order = [cell for mine in by_place for cell in sorted(mine, key=lambda cell: bool(cell.apart))]
    return Results(Path(folder), facts, records, table.frame, order)


def _apart(records: list[dict]) -> str:
    """Why a cell is in no comparison, from its records; "" if it is in all.

    A contradiction must be that of more than half of its timed repetitions that are ok: a few are the machine's doing.
    """
    always = [why for record in records if (why := record.get("unranked") or "") and not why.startswith(CONTRADICTED)]
    if always:
        return always[0]
    good = [record for record in records if record["status"] == "ok" and (record.get("pass") or "timed") == "timed"]
    found = [record["unranked"] for record in good if record.get("unranked")]
    if len(found) <= MOST_CONTRADICTED * len(good):
        return ""
    return found[0] if len(good) == 1 else f"{found[0]} (in {len(found)} of {len(good)} repetitions)"


def _grouped(cells, key) -> dict:
    found = {}
    for cell in cells:
        found.setdefault(key(cell), []).append(cell)
    return found


def _mark_outliers(rows: list[dict]) -> None:
    """Marks the rows of a cell that count and whose steady time lies far from the others'."""
    counting = [row for row in rows if row["pass"] == "timed" and row["status"] == "ok" and row["steady_s"] is not None]
    for row, is_out in zip(counting, statistics.outliers([row["steady_s"] for row in counting]), strict=True):
        row["outlier"] = is_out


def point_label(point: dict) -> str:
    """The swept values of a point, for people; "no sweep" if there are none."""
    return ", ".join(f"{key} = {value}" for key, value in point.items()) or "no sweep"


def place_label(place: tuple[str, str]) -> str:
    scene, point = place
    return Path(scene).stem if point == "no sweep" else f"{Path(scene).stem}, {point}"
