"""A run, loaded: a pandas DataFrame with one row a repetition, and its cells in the order of the experiment.

The process is the unit of replication: every number of a repetition is one number, and the steady time is the mean of
its frames after the first.
"""

from dataclasses import dataclass, field, replace
from pathlib import Path

import pandas as pd

from harness import statistics, store
from harness.statistics import Estimate

BAD_FIRST = ("wrong picture", "failed", "timeout", "killed", "unsupported", "unavailable")


@dataclass(frozen=True)
class Missing:
    """A value that is not there, and why. Its text starts with "unavailable"."""

    reason: str

    def __str__(self):
        return self.reason if self.reason.startswith("unavailable") else f"unavailable: {self.reason}"


@dataclass(frozen=True)
class Cell:
    """All repetitions of one variant at one place (a scene and a swept point), or those with one state of its cache."""

    scene: str
    point: str
    variant: str
    parameters: dict
    rows: pd.DataFrame = field(repr=False)
    cache: str = ""

    @property
    def label(self) -> str:
        return f"{self.variant} ({self.cache} cache)" if self.cache else self.variant

    def by_cache(self) -> list["Cell"]:
        """The cell itself, or a cell for each state in which its processes found their cache of compiled code."""
        states = sorted(self.good["compile_cache"].dropna().unique())
        bad = self.rows["status"] != "ok"
        return [
            replace(self, cache=state, rows=self.rows[bad | (self.rows["compile_cache"] == state)]) for state in states
        ] or [self]

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
        """Status and reason; of an ok cell also how many of its repetitions were not."""
        if self.status != "ok":
            return f"{self.status}: {self.reason}"
        bad = self.rows[self.rows["status"] != "ok"]
        if bad.empty:
            return "ok"
        worst = bad.iloc[0]
        return f"ok, but {len(bad)} of {len(self.rows)} repetitions not: {worst['status']}: {worst['reason']}"

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
    repetitions = pd.DataFrame([_row(record) for record in records], columns=COLUMNS)
    cells = {}
    for told in [*facts["cells"], *records]:
        name = told["scene"], point_label(told["point"]), told["variant"]
        if name not in cells:
            table = repetitions
            mine = (table["scene"] == name[0]) & (table["point"] == name[1]) & (table["variant"] == name[2])
            cells[name] = Cell(*name, told["parameters"], table[mine])
    return Results(Path(folder), facts, records, repetitions, list(cells.values()))


def point_label(point: dict) -> str:
    """The swept values of a point, for people; "no sweep" if there are none."""
    return ", ".join(f"{key} = {value}" for key, value in point.items()) or "no sweep"


def place_label(place: tuple[str, str]) -> str:
    scene, point = place
    return Path(scene).stem if point == "no sweep" else f"{Path(scene).stem}, {point}"


MEMORY = "peak_bytes", "render_peak_bytes", "peak_virtual_bytes", "floor_bytes"
ACCURACY = "reference", "max_outside", "max_inside", "rmse", "bad_pixels", "mask_fraction", "tolerance"
COLUMNS = (
    "scene", "point", "variant", "technology", "repetition", "status", "reason", "wall_s", "first_s", "steady_s",
    "steady_frames", "compile_s", "compile_cache", "build_s", "user_s", "system_s", "rays", "rays_per_s",
    *MEMORY, "memory_method", *ACCURACY, "not_judged", "warnings",
)  # fmt: skip


def _row(record: dict) -> dict:
    """A record as a flat row; what it does not tell is left out, which pandas makes NaN."""
    frames = record["frames_s"] or []
    steady = frames[1:]
    rays = record["rays"] and sum(record["rays"][kind] for kind in ("primary", "reflected", "transmitted", "shadow"))
    compiled = [end - start for name, start, end in record["phases"] or [] if name == "compile"]
    methods = (record["used"] or {}).get("methods") or {}
    memory, accuracy = record["memory"] or {}, record["accuracy"] or {}
    return {
        **{name: record[name] for name in ("scene", "variant", "technology", "repetition", "status", "reason")},
        "wall_s": record["wall_s"],
        **{name: (record["cpu"] or {}).get(name) for name in ("user_s", "system_s")},
        **{name: memory.get(name) for name in MEMORY},
        **{name: accuracy.get(name) for name in ACCURACY},
        "point": point_label(record["point"]),
        "memory_method": memory.get("method"),
        "first_s": frames[0] if frames else None,
        "steady_s": sum(steady) / len(steady) if steady else None,
        "steady_frames": len(steady),
        "compile_s": sum(compiled) if compiled else None,
        "compile_cache": methods.get("compile_cache"),
        "build_s": (record["build"] or {}).get("seconds"),
        "rays": rays,
        "rays_per_s": rays * len(steady) / sum(steady) if rays and steady else None,
        "not_judged": _not_judged(record),
        "warnings": "; ".join(record["warnings"]),
    }


def _not_judged(record: dict) -> str | None:
    """Why the picture of a record has no verdict; None if it has one, or if there is no picture."""
    if record["accuracy"] is None:
        return "the judge was not asked" if record["status"] == "ok" else None
    return record["accuracy"].get("unavailable")
