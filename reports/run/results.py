"""Loads a run as a DataFrame of repetitions and as cells in the order of the experiment.

Within a place, cells that no comparison includes come last.
"""

import gc
from collections.abc import Callable, Collection, Iterable
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import pandas as pd

from harness.statistics import statistics
from harness.statistics.statistics import Floor
from harness.store import store
from harness.store.record import CONTRADICTED, FALSE_FRAMES
from reports.run import repetition
from reports.run.cell import Cell, Missing, Table

__all__ = ["Cell", "Missing", "Results", "grouped", "load", "place_label", "point_label"]

MOST_CONTRADICTED = 1 / 2  # of the good repetitions of a cell that is ranked


@dataclass(frozen=True, eq=False)
class Results:
    """A loaded run.

    folder: of the run. facts: its run.json. records: the repetitions as stored. repetitions: the same as a table.
    """

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

    @cached_property
    def left_out(self) -> bool:
        """Did the run have pictures of which its folder has none?"""
        kept = [record["picture"]["file"] for record in self.records if record["picture"]]
        return bool(kept) and not any((self.folder / file).exists() for file in dict.fromkeys(kept))

    def of(self, scene: str) -> list[Cell]:
        return self._by_scene[scene]

    def at(self, place: tuple[str, str]) -> list[Cell]:
        return self._by_place[place]

    @cached_property
    def counted(self) -> dict[tuple[str, str, str], dict]:
        """The records of the pass "count", by scene, swept values and variant; {} if nothing was to be counted."""
        records = (record for record in self.records if record.get("pass") == "count")
        return {(record["scene"], point_label(record["point"]), record["variant"]): record for record in records}

    def counts(self, cell: Cell) -> dict | Missing:
        """Returns `counts` of a cell (store.py), or why there are none."""
        record = self.counted.get((cell.scene, point_label(cell.swept), cell.variant))
        if record is None:
            return Missing("the run ended before it was counted" if self.counted else "the run did not count")
        return record.get("counts") or Missing(record["reason"])

    def operations(self, cell: Cell) -> dict | None:
        """Returns `operations` of a cell (store.py); None if they were not counted."""
        record = self.counted.get((cell.scene, point_label(cell.swept), cell.variant)) or {}
        operations = record.get("operations")
        return None if not operations or "unavailable" in operations else operations

    @cached_property
    def _by_scene(self) -> dict[str, list[Cell]]:
        return grouped(self.cells, lambda cell: cell.scene)

    @cached_property
    def _by_place(self) -> dict[tuple[str, str], list[Cell]]:
        return grouped(self.cells, lambda cell: cell.place)

    @property
    def floor(self) -> Floor:
        """The noise floor of the run, from its A/A pair."""
        return self._floor[0]

    @property
    def pair(self) -> str:
        """The label of the cell that ran twice in every round, the A/A pair; "" if none did."""
        return self._floor[1]

    def floor_by(self, column: str) -> Floor:
        """Returns the noise floor of other times of a frame than the medians in `steady_s`."""
        return self._floor[0] if column == repetition.STEADY else self._largest_floor(column)[0]

    @cached_property
    def _floor(self) -> tuple[Floor, str]:
        return self._largest_floor(repetition.STEADY)

    def _largest_floor(self, column: str) -> tuple[Floor, str]:
        """The largest noise floor of the A/A pairs of all jobs: any two cells may come from that job. And its label."""
        pairs = self.facts.get("pairs") or [self.facts.get("pair") or {"unavailable": "the run has no A/A pair"}]
        floors = [self._of_pair(pair, column) for pair in pairs]
        measured = [(floor, label) for floor, label in floors if floor.value is not None]
        return max(measured, key=lambda entry: entry[0].value) if measured else floors[0]

    def _of_pair(self, pair: dict, column: str) -> tuple[Floor, str]:
        if "unavailable" in pair:
            return Floor(None, pair["unavailable"]), ""
        rows = self.repetitions[(self.repetitions["cell"] == pair["cell"]) & (self.repetitions["status"] == "ok")]
        rows = rows[~rows["unranked"].fillna("").str.startswith(CONTRADICTED)]
        times = rows.dropna(subset=column).pivot_table(index="repetition", columns="pass", values=column)
        both = times.reindex(columns=["timed", "pair"]).dropna()
        return statistics.noise_floor(both["timed"].tolist(), both["pair"].tolist()), pair["label"]

    def record(self, cell: Cell) -> dict | None:
        """Returns the record of the first repetition with a picture, else of the first; None if none was stored."""
        records = [self.records[row] for row in cell.timed]
        return next((record for record in records if record["picture"]), next(iter(records), None))


def load(folder: Path, hosts: Collection[str] | None = None) -> Results:
    """Returns the run in `folder`.

    hosts: those whose rows are taken as one machine's. UserError if `folder` holds no run, or one of several hosts
    and `hosts` is None.
    """
    with _without_collecting():
        return _load(folder, hosts)


@contextmanager
def _without_collecting():
    """Stops the garbage collector: a run leaves no garbage, and collecting takes as long as reading 100,000 rows."""
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
    groups = grouped(range(len(rows)), lambda number: tuple(rows[number][key] for key in ("scene", "point", "variant")))
    for numbers in groups.values():
        _mark_outliers([rows[number] for number in numbers])
    table = Table(pd.DataFrame(rows, columns=[*repetition.COLUMNS, "outlier"]))
    on_gpu = {record["variant"] for record in records if record.get("device") or record.get("gpu")}
    cells = {}
    for entry in [*facts["cells"], *records]:
        name = entry["scene"], point_label(entry["point"]), entry["variant"]
        if name in cells:
            continue
        numbers = groups.get(name, [])
        stored = [records[number] for number in numbers]
        cells[name] = Cell(
            *place(entry),
            entry["variant"],
            entry["parameters"],
            table,
            [number for number in numbers if rows[number]["pass"] == "timed"],
            [number for number in numbers if rows[number]["pass"] == "load"],
            entry["point"],
            _apart(stored),
            any((record.get("device") or {}).get("simulated") for record in stored),
            name[2] in on_gpu,
        )
    by_place = grouped(cells.values(), lambda cell: cell.place).values()
    order = [cell for group in by_place for cell in sorted(group, key=lambda cell: bool(cell.apart))]
    return Results(Path(folder), facts, records, table.frame, order)


def _apart(records: list[dict]) -> str:
    """Returns why no comparison includes a cell, from its records; "" if all do.

    A contradiction counts in more than half of the good timed repetitions: the machine disturbs a few. One later frame
    that was not what it should be counts for all.
    """
    reasons = [record.get("unranked") or "" for record in records]
    always = [why for why in reasons if why.startswith(FALSE_FRAMES) or (why and not why.startswith(CONTRADICTED))]
    if always:
        return always[0]
    good = [record for record in records if record["status"] == "ok" and (record.get("pass") or "timed") == "timed"]
    doubts = [record["unranked"] for record in good if record.get("unranked")]
    if len(doubts) <= MOST_CONTRADICTED * len(good):
        return ""
    return doubts[0] if len(good) == 1 else f"{doubts[0]} (in {len(doubts)} of {len(good)} processes)"


def grouped(items: Iterable, key: Callable) -> dict[Any, list]:
    """Returns the items in lists by `key(item)`; lists and items are in the order in which they first appear."""
    groups = {}
    for item in items:
        groups.setdefault(key(item), []).append(item)
    return groups


def _mark_outliers(rows: list[dict]) -> None:
    """Marks the rows of a cell whose steady times lie far from the others'."""
    counting = [row for row in rows if row["pass"] == "timed" and row["status"] == "ok" and row["steady_s"] is not None]
    for row, is_out in zip(counting, statistics.outliers([row["steady_s"] for row in counting]), strict=True):
        row["outlier"] = is_out


def point_label(point: dict) -> str:
    """Returns the swept values of a point as text; "no sweep" if there are none."""
    return ", ".join(f"{key} = {value}" for key, value in point.items()) or "no sweep"


def place(record: dict) -> tuple[str, str]:
    """Returns the scene and the swept values without `threads`: numbers of threads are compared with each other."""
    return record["scene"], point_label({key: value for key, value in record["point"].items() if key != "threads"})


def place_label(place: tuple[str, str]) -> str:
    scene, point = place
    return Path(scene).stem if point == "no sweep" else f"{Path(scene).stem}, {point}"
