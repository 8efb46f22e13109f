"""A run, loaded: a pandas DataFrame with one row a repetition, and its cells in the order of the experiment.

The process is the unit of replication. Of the cells of a place, those that take no part in comparisons come last.
"""

from dataclasses import dataclass, field, replace
from pathlib import Path

import pandas as pd

from harness import statistics, store
from harness.statistics import Estimate
from reports import repetition

BAD_FIRST = ("wrong picture", "failed", "timeout", "killed", "unsupported", "unavailable")


@dataclass(frozen=True)
class Missing:
    """A value that is not there, and why. Its text starts with "unavailable"."""

    reason: str

    def __str__(self):
        return self.reason if self.reason.startswith("unavailable") else f"unavailable: {self.reason}"


@dataclass(frozen=True)
class Cell:
    """All repetitions of one variant at one place (a scene and a swept point), or those with one state of its cache.

    rows: those whose times count. load: those of the repeated-load pass, of which only the GPU is looked at.
    apart: "" or why it takes no part in any comparison, whatever came out: an exhibit, or a simulator.
    gpu: did its variant use a GPU, or a simulator of one, anywhere in the run?
    """

    scene: str
    point: str
    variant: str
    parameters: dict
    rows: pd.DataFrame = field(repr=False)
    load: pd.DataFrame = field(repr=False)
    swept: dict = field(default_factory=dict)
    apart: str = ""
    simulated: bool = False
    gpu: bool = False
    cache: str = ""

    @property
    def label(self) -> str:
        notes = [f"{self.cache} cache"] * bool(self.cache) + ["simulator"] * self.simulated
        return f"{self.variant} ({', '.join(notes)})" if notes else self.variant

    @property
    def as_meant(self) -> bool:
        """Is it apart, and did it do what it is there for? A wrong picture is no failure of an exhibit."""
        return bool(self.apart) and (self.status == "ok" or (self.exhibit and self.status == "wrong picture"))

    @property
    def exhibit(self) -> bool:
        return self.apart.startswith("exhibit")

    def by_cache(self) -> list["Cell"]:
        """The cell itself, or a cell for each state in which its processes found their cache of compiled code."""
        states = sorted(self.good["compile_cache"].dropna().unique())
        bad = self.rows["status"] != "ok"
        return [
            replace(
                self, cache="" if state == "off" else state, rows=self.rows[bad | (self.rows["compile_cache"] == state)]
            )
            for state in states
        ] or [self]

    @property
    def pixels(self) -> int:
        x0, y0, x1, y1 = map(int, self.parameters["region"].split(","))
        return (x1 - x0) * (y1 - y0)

    @property
    def place(self) -> tuple[str, str]:
        return self.scene, self.point

    @property
    def status(self) -> str:
        """ "ok" if a repetition was good and none made a wrong picture; "not run" if none was stored."""
        found = set(self.rows["status"])
        if "wrong picture" in found:
            return "wrong picture"
        if "ok" in found:
            return "ok"
        return next((status for status in BAD_FIRST if status in found), min(found, default="not run"))

    @property
    def reason(self) -> str:
        if self.rows.empty:
            return "the run ended before it"
        return self.rows.loc[self.rows["status"] == self.status, "reason"].iloc[0]

    @property
    def verdict(self) -> str:
        """Status and reason; of an ok cell also how many of its repetitions were not; and why it is apart."""
        if self.status == "wrong picture" and self.exhibit:
            return f"{self.apart}; its picture is wrong, as meant: {self.reason}"
        text = f"ok{self.lost}" if self.status == "ok" else f"{self.status}: {self.reason}"
        return f"{text}; {self.apart}" if self.apart else text

    @property
    def lost(self) -> str:
        """Of an ok cell: "" or how many of its repetitions were not, and why."""
        bad = self.rows[self.rows["status"] != "ok"]
        if bad.empty:
            return ""
        worst = bad.iloc[0]
        return f", but {len(bad)} of {len(self.rows)} repetitions not: {worst['status']}: {worst['reason']}"

    @property
    def good(self) -> pd.DataFrame:
        """The repetitions that count."""
        return self.rows[self.rows["status"] == "ok"] if self.status == "ok" else self.rows[:0]

    def values(self, column: str) -> list[float]:
        """Of the repetitions that count, one number each; those that are not known are left out."""
        return [float(value) for value in self.good[column].dropna()]

    def mean(self, column: str, reason: str) -> Estimate | Missing:
        """Mean over processes, or Missing: for `reason`, or since the cell is not ok."""
        values = self.values(column)
        if values:
            return statistics.mean(values)
        return Missing(reason if self.status == "ok" else self.verdict)

    def worst(self, column: str) -> float | Missing:
        """The largest value over all repetitions that were judged, the rejected ones included."""
        values = self.rows[column].dropna()
        if len(values):
            return float(values.max())
        reasons = self.rows["not_judged"].dropna()
        if len(reasons):
            return Missing(reasons.iloc[0])
        return Missing(self.verdict if self.status != "ok" else "the judge gave none")

    @property
    def unranked(self) -> str:
        """ "" or why the cell takes no part in a comparison: only a steady time with a judged picture does."""
        if self.status != "ok":
            return self.verdict
        if self.apart:
            return self.apart
        if not self.values("steady_s"):
            return "no steady frames"
        if self.good["not_judged"].notna().any():
            return f"its picture was not judged: {self.good['not_judged'].dropna().iloc[0]}"
        return ""


@dataclass(frozen=True)
class Results:
    """folder: of the run. facts: its run.json. repetitions: one row each. records: as stored, in the same order."""

    folder: Path
    facts: dict
    records: list[dict]
    repetitions: pd.DataFrame
    cells: list[Cell]

    @property
    def scenes(self) -> list[str]:
        return list(dict.fromkeys(cell.scene for cell in self.cells))

    @property
    def places(self) -> list[tuple[str, str]]:
        return list(dict.fromkeys(cell.place for cell in self.cells))

    @property
    def variants(self) -> list[str]:
        return list(dict.fromkeys(cell.variant for cell in self.cells))

    def of(self, scene: str) -> list[Cell]:
        return [cell for cell in self.cells if cell.scene == scene]

    def at(self, place: tuple[str, str]) -> list[Cell]:
        return [cell for cell in self.cells if cell.place == place]

    def record(self, cell: Cell) -> dict | None:
        """The stored record of its first repetition that has a picture or was good, else of its first."""
        mine = [self.records[index] for index in cell.rows.index]
        return next((record for record in mine if record["picture"]), next(iter(mine), None))


def load(folder: Path) -> Results:
    """The run in `folder`. UserError if it is none."""
    facts, records = store.read(folder)
    rows = [{**repetition.row(record), "point": point_label(record["point"])} for record in records]
    table = pd.DataFrame(rows, columns=repetition.COLUMNS)
    on_gpu = {record["variant"] for record in records if record.get("device") or record.get("gpu")}
    cells = {}
    for told in [*facts["cells"], *records]:
        name = told["scene"], point_label(told["point"]), told["variant"]
        if name not in cells:
            here = table[(table["scene"] == name[0]) & (table["point"] == name[1]) & (table["variant"] == name[2])]
            mine = [records[index] for index in here.index]
            timed = here["pass"] == "timed"
            cells[name] = Cell(
                *name,
                told["parameters"],
                here[timed],
                here[~timed],
                told["point"],
                next((record["unranked"] for record in mine if record.get("unranked")), ""),
                any((record.get("device") or {}).get("simulated") for record in mine),
                name[2] in on_gpu,
            )
    places = list(dict.fromkeys(cell.place for cell in cells.values()))
    order = sorted(cells.values(), key=lambda cell: (places.index(cell.place), bool(cell.apart)))
    return Results(Path(folder), facts, records, table, order)


def point_label(point: dict) -> str:
    """The swept values of a point, for people; "no sweep" if there are none."""
    return ", ".join(f"{key} = {value}" for key, value in point.items()) or "no sweep"


def place_label(place: tuple[str, str]) -> str:
    scene, point = place
    return Path(scene).stem if point == "no sweep" else f"{Path(scene).stem}, {point}"
