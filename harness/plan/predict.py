"""Predicts how long a repetition of a cell takes, from finished repetitions."""

import statistics
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import orjson

from harness.errors import UserError
from harness.machine import environment
from harness.plan.plan import Cell
from harness.store import confined, schema, store

HISTORY = 16 * 2**20  # bytes of old runs to read, at most
NEVER_RAN = ("unavailable", "unsupported")


class Prediction(NamedTuple):
    """A predicted duration. source: such as "12 finished repetitions of numba"."""

    seconds: float
    source: str


class Predictor:
    """Predicts from a cell's own repetitions, else from those of its variant.

    The first repetition of a cell is predicted separately, as it includes builds, compilation and the reference
    picture. If no later one is known, the wall time of the first process replaces it. A truth, which all cells of a
    scene share, is made in one of them and takes much longer than the others: it is predicted by itself.
    """

    def __init__(self, records: Iterable[dict] = ()):
        self._own: dict[tuple[str, str], list[float]] = defaultdict(list)
        self._fits: dict[tuple[str, str], _Fit] = defaultdict(_Fit)
        self._truths: list[float] = []
        self._counts: dict[str, list[float]] = defaultdict(list)  # by cell and by variant
        for record in records:
            self.add(record)

    def add(self, record: dict) -> None:
        """Learns from a row (store.py). Rows of the passes load and cold, which last longer, are ignored; `count` alone
        learns from those of counts."""
        took, kind = record.get("took_s") or record.get("wall_s"), record.get("pass", "timed")
        if not took or kind in ("load", "cold"):
            return
        if kind == "count":
            for name in (record["cell"], record["variant"]):
                self._counts[name].append(took)
            return
        made = record.get("truth_s")
        if made is not None:
            self._truths.append(made)
            took = max(took - made, record.get("wall_s") or 1e-3)
        if record["repetition"] == 0 and kind == "timed":
            self._learn(record, "first", took)
            self._learn(record, "process", record.get("wall_s") or took)
        else:
            self._learn(record, "later", took)

    def _learn(self, record: dict, what: str, took: float) -> None:
        self._own[record["cell"], what].append(took)
        if record["status"] == "ok" and record.get("shapes") and record.get("lights") is not None:
            self._fits[record["variant"], what].add(_work(record), took)

    @property
    def truth(self) -> float:
        """Predicts how long (s) a truth takes: as long as those so far on average; 0 if none was ever made."""
        return statistics.mean(self._truths) if self._truths else 0.0

    def count(self, cell: Cell) -> float | None:
        """Predicts how long (s) the count of a cell takes: the median of its own, else of its variant's, if any."""
        times = self._counts.get(cell.key) or self._counts.get(cell.entry.name)
        return statistics.median(times) if times else None

    def seconds(self, cell: Cell, first: bool = False) -> Prediction | None:
        """Predicts a later repetition of a cell, or its first: the median of its own rows, else a fit over its variant.

        None if there are too few rows for both.
        """
        for what in ("first", "later") if first else ("later", "process"):
            own = self._own.get((cell.key, what))
            if own:
                return Prediction(statistics.median(own), f"{_count(own)} of the cell itself")
            fit = self._fits.get((cell.entry.name, what))
            seconds = fit and fit.at(cell.work * (cell.parameters.frames + 1))
            if seconds:
                return Prediction(seconds, f"{_count(fit.took)} of {cell.entry.name}")
        return None


class _Fit:
    """Fits T = a + b * work with a, b >= 0, by least squares of the relative error."""

    def __init__(self):
        self.took: list[float] = []
        self.least, self.most = float("inf"), 0
        self.ones = self.works = 0.0  # sums of 1/T and of w/T; below those of their products
        self.ones_ones = self.ones_works = self.works_works = 0.0

    def add(self, work: int, took: float) -> None:
        weight, share = 1 / took, work / took
        self.took.append(took)
        self.least, self.most = min(self.least, work), max(self.most, work)
        self.ones, self.works = self.ones + weight, self.works + share
        self.ones_ones += weight * weight
        self.ones_works += weight * share
        self.works_works += share * share

    def at(self, work: int) -> float | None:
        """Seconds for an amount of work; None for another size if only one size is known."""
        if self.most <= 1.001 * self.least:
            return statistics.median(self.took) if self.least <= work <= self.most else None
        # Normal equations. If a or b is negative, the best fit is on the border, where it is 0.
        determinant = self.ones_ones * self.works_works - self.ones_works**2
        a = (self.ones * self.works_works - self.works * self.ones_works) / determinant
        b = (self.works * self.ones_ones - self.ones * self.ones_works) / determinant
        if a < 0:
            a, b = 0.0, self.works / self.works_works
        elif b < 0:
            a, b = self.ones / self.ones_ones, 0.0
        return a + b * work


def _work(record: dict) -> int:
    """Cell.work of all frames of a row, and one for the warm-up."""
    parameters = record["parameters"]
    x0, y0, x1, y1 = map(int, parameters["region"].split(","))
    things = sum(record["shapes"].values()) + record["lights"]
    return (x1 - x0) * (y1 - y0) * (parameters["depth"] + 1) * things * (parameters["frames"] + 1)


def _count(rows: list) -> str:
    return f"{len(rows)} finished repetition{'s' if len(rows) > 1 else ''}"


def history(results: Path, but: Path | None = None, most: int = HISTORY) -> list[dict]:
    """Rows that ran on this machine, from the runs in the folder `results`, newest first: `most` bytes in total.

    but: a run to leave out, as its rows are known.
    """
    files = [path for kind in ("*", "*/parts/*") for path in results.glob(f"{kind}/repetitions.jsonl")]
    runs = sorted(files, key=lambda path: path.stat().st_mtime, reverse=True)
    runs = [path for path in runs if but is None or not path.resolve().is_relative_to(but.resolve())]
    here, past_rows = environment.capture() if runs else {}, []
    for path in runs:
        facts = path.with_name("run.json")
        most -= facts.stat().st_size if facts.exists() else 0
        if most <= 0:
            break
        try:
            run = store.facts_of(path.parent)
        except UserError:  # a damaged run
            continue
        if any((run.get("environment") or {}).get(name) != here[name] for name in ("host", "cpu")):
            continue
        try:
            tail = _tail(path, most)
        except UserError:  # no plain file
            continue
        most -= len(tail)
        cells = {cell["cell"]: cell for cell in run.get("cells", ())}
        rows = [{**cells.get(str(row.get("cell")), {}), **row} for row in map(_json, tail.splitlines())]
        past_rows += [row for row in rows if schema.teaches(row) and row["status"] not in NEVER_RAN]
    return past_rows


def _tail(path: Path, most: int) -> bytes:
    """The last `most` bytes of a file; its first line may be torn."""
    with confined.opened(path) as file:
        file.seek(max(0, path.stat().st_size - most))
        return file.read(most)


def _json(text: bytes) -> dict:
    try:
        return dict(orjson.loads(text))
    except (ValueError, TypeError):
        return {}
