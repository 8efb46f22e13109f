"""Summarises the repetitions of one variant at one place as a cell. The process is the unit of replication."""

import math
from dataclasses import dataclass, field, replace
from functools import cached_property

import pandas as pd

from harness.statistics import statistics, steady
from harness.statistics.digits import percentage
from harness.statistics.statistics import Estimate
from harness.store import record
from harness.store.record import CONTRADICTED
from reports.run import repetition
from reports.run.missing import Missing

OF_FRAMES = ("first_s", *repetition.OF_STEADY)
BAD_FIRST = ("wrong picture", "failed", "timeout", "killed", "unsupported", "unavailable")


class Table:
    """The repetitions of a run, one row each: as a DataFrame, `frame`, and by column as lists, which are faster."""

    def __init__(self, frame: pd.DataFrame):
        self.frame = frame
        self._columns: dict[str, list] = {}

    def column(self, name: str) -> list:
        if name not in self._columns:
            self._columns[name] = [None if value != value else value for value in self.frame[name].tolist()]
        return self._columns[name]


@dataclass(frozen=True, eq=False)
class Cell:
    """All repetitions of one variant at one place, or those with one state of its cache.

    scene, point: its place (results.place). swept: all swept values.
    table: of the run. timed: its rows whose times count. loaded: rows of the repeated-load pass, which observes the GPU
    only. The second processes of the A/A pair are in neither.
    apart: "" or why no comparison includes the cell, whatever its results: it is an exhibit, ran in a simulator, or
    most of its repetitions contradict themselves.
    gpu: its variant used a GPU, or a simulator of one, somewhere in the run.
    """

    scene: str
    point: str
    variant: str
    parameters: dict
    table: Table = field(repr=False)
    timed: list[int] = field(repr=False)
    loaded: list[int] = field(repr=False)
    swept: dict = field(default_factory=dict)
    apart: str = ""
    simulated: bool = False
    gpu: bool = False
    cache: str = ""

    @cached_property
    def rows(self) -> pd.DataFrame:
        return self.table.frame.iloc[self.timed]

    @cached_property
    def load(self) -> pd.DataFrame:
        return self.table.frame.iloc[self.loaded]

    @cached_property
    def counting(self) -> list[int]:
        """The rows of the repetitions that count: those that are ok, without the few that contradict themselves."""
        if self.status != "ok":
            return []
        rows = self._with("ok")
        return rows if self.contradicted else [row for row in rows if not self._contradiction(row)]

    def _contradiction(self, row: int) -> str:
        why = self.table.column("unranked")[row] or ""
        return why if why.startswith(CONTRADICTED) else ""

    @property
    def good(self) -> pd.DataFrame:
        """The repetitions that count."""
        return self.table.frame.iloc[self.counting]

    def by_row(self, column: str, rows: list[int] | None = None) -> dict:
        """Returns the known values of a column by row, of the repetitions that count or of `rows`."""
        values = self.table.column(column)
        return {row: values[row] for row in (self.counting if rows is None else rows) if values[row] is not None}

    def _with(self, status: str) -> list[int]:
        return [row for row, value in self.by_row("status", self.timed).items() if value == status]

    @property
    def name(self) -> str:
        """The variant, with its number of threads where that was swept."""
        return f"{self.variant} ({self._threads})" if self._threads else self.variant

    @property
    def _threads(self) -> str:
        if "threads" not in self.swept:
            return ""
        count = self.parameters["threads"]
        return f"{count} thread{'s' * (count != 1)}"

    @property
    def label(self) -> str:
        """Its name with the state of its cache, and whether it ran in a simulator."""
        notes = [self._threads, f"{self.cache} cache" if self.cache else "", "simulator" if self.simulated else ""]
        notes = list(filter(None, notes))
        return f"{self.variant} ({', '.join(notes)})" if notes else self.variant

    @property
    def as_meant(self) -> bool:
        """Is it apart, with the result that it was made to show? An exhibit of a fault is to have a wrong picture."""
        if self.contradicted:
            return False
        return bool(self.apart) and (self.status == "ok" or (self.faulty and self.status == "wrong picture"))

    @property
    def exhibit(self) -> bool:
        return self.apart.startswith("exhibit")

    @property
    def faulty(self) -> bool:
        """Is it an exhibit of a fault, and not of a cost?"""
        return self.apart.startswith("exhibit: ")

    @property
    def contradicted(self) -> bool:
        return self.apart.startswith(CONTRADICTED)

    def by_cache(self) -> list["Cell"]:
        """Returns a cell for each state (cold, warm) of the cache of compiled code that its processes found."""
        cache = self.by_row("compile_cache")
        lost = set(self.timed) - set(self.counting)
        return [
            replace(
                self,
                cache="" if state == "off" else state,
                timed=[row for row in self.timed if row in lost or cache.get(row) == state],
            )
            for state in sorted(set(cache.values()))
        ] or [self]

    @property
    def size(self) -> tuple[int, int]:
        """Height and width of its picture, pixels."""
        x0, y0, x1, y1 = map(int, self.parameters["region"].split(","))
        return y1 - y0, x1 - x0

    @property
    def pixels(self) -> int:
        return math.prod(self.size)

    @property
    def place(self) -> tuple[str, str]:
        return self.scene, self.point

    @cached_property
    def status(self) -> str:
        """ "ok" if a repetition was good and none made a wrong picture; "not run" if none was stored."""
        statuses = set(self.by_row("status", self.timed).values())
        if "wrong picture" in statuses:
            return "wrong picture"
        if "ok" in statuses:
            return "ok"
        return next((status for status in BAD_FIRST if status in statuses), min(statuses, default="not run"))

    @property
    def reason(self) -> str:
        if not self.timed:
            return "the run ended before it"
        return self.table.column("reason")[self._with(self.status)[0]]

    @property
    def verdict(self) -> str:
        """Status and reason, how many repetitions of an ok cell were not ok, and why it is apart."""
        if self.status == "wrong picture" and self.faulty:
            return f"{self.apart}; its picture is wrong, as meant: {self.reason}"
        text = f"ok{self.lost}" if self.status == "ok" else f"{self.status}: {self.reason}"
        return f"{text}; {self.apart}" if self.apart else text

    @property
    def lost(self) -> str:
        """How many repetitions of an ok cell were not ok, and why; "" if none."""
        counting = set(self.counting)
        bad = [row for row in self.timed if row not in counting]
        if not bad:
            return ""
        status, reason = (self.table.column(name)[bad[0]] for name in ("status", "reason"))
        why = self._contradiction(bad[0]) if status == "ok" else f"{status}: {reason}"
        return f", but {len(bad)} of {len(self.timed)} processes not: {why}"

    @cached_property
    def unsteady(self) -> str:
        """Why it has no steady time, "" if it has: its repetitions that count have no steady state together."""
        notes = self.by_row("steady_note")
        return steady.together(list(self.by_row("change").values()), [notes.get(row, "") for row in self.counting])

    @property
    def outlying(self) -> int:
        """How many repetitions lie far from the others; they still count."""
        return sum(self.by_row("outlier").values())

    def values(self, column: str) -> list[float]:
        """Returns the known numbers of a column, one per repetition that counts."""
        return list(self.rounds(column).values())

    def rounds(self, column: str) -> dict[int, float]:
        """Returns `values` by the number of the repetition, which is its round of the run."""
        if self._without(column):
            return {}
        numbers = self.table.column("repetition")
        return {numbers[row]: float(value) for row, value in self.by_row(column).items()}

    def median(self, column: str, reason: str) -> Estimate | Missing:
        """Returns the median over processes; else Missing: the cell is not ok, has no steady state, or `reason`."""
        values = self.values(column)
        if values:
            return statistics.median(values)
        if self.status != "ok":
            return Missing(self.verdict)
        return Missing(self._without(column) or reason)

    def _without(self, column: str) -> str:
        """Why the cell has no times of this kind, whatever its repetitions say; "" if it has."""
        if self.contradicted and column in OF_FRAMES:
            return self.apart
        return self.unsteady if column in repetition.OF_STEADY else ""

    @cached_property
    def steady(self) -> Estimate | Missing:
        """The median over processes of the time of a steady frame, s."""
        return self.median("steady_s", steady.NO_FRAMES)

    def error(self, column: str = repetition.RMSE, worst=max) -> float | Missing:
        """Returns the worst of an error over all repetitions, those with a wrong picture too, or why there is none."""
        values = self.by_row(column, self.timed)
        if values:
            return float(worst(values.values()))
        reasons = [reason for name in (f"no_{column}", "no_error") if name in repetition.COLUMNS
                   for reason in self.by_row(name, self.timed).values()]  # fmt: skip
        if not reasons and self.parameters.get("kind") == "rays":
            reasons = ["first hits have none"]
        return Missing(next(iter(reasons), self.verdict if self.status != "ok" else "the run does not have it"))

    @property
    def below(self) -> float | None:
        """What its RMSE lies below where the truth cannot tell it from 0 in any repetition; else None."""
        bounds = self.by_row("error_below", self.timed)
        return max(bounds.values()) if bounds and len(bounds) == len(self.by_row(repetition.RMSE, self.timed)) else None

    @property
    def against(self) -> str:
        """What its error is held against, in words; "" for the truth of the scene."""
        return " and ".join(dict.fromkeys(self.by_row("against", self.timed).values()))

    @property
    def agrees(self) -> bool | Missing:
        """Do all pictures agree with their references?"""
        verdicts = self.by_row("agrees", self.timed).values()
        if verdicts:
            return all(verdicts)
        reasons = self.by_row("not_judged", self.timed)
        return Missing(next(iter(reasons.values()), self.verdict if self.status != "ok" else "the judge was not asked"))

    @property
    def mask(self) -> float | Missing:
        """The largest share of ill-conditioned pixels that a judged picture has."""
        shares = self.by_row("agreement_mask_fraction", self.timed).values()
        return float(max(shares)) if shares else Missing("it was not judged")

    @property
    def errors(self) -> str:
        """The errors of its pictures in words, and what they are held against; of several repetitions the worst."""
        worst = [self.error(name) for name in repetition.ERRORS]
        text = record.errors(*(None if isinstance(value, Missing) else value for value in worst), self.below)
        return ", ".join(filter(None, [text, self.against]))

    @property
    def agreement(self) -> str:
        """A tick if its pictures agree with their references, else a cross, with the share of a mask above 1 %."""
        if isinstance(self.agrees, Missing):
            return str(self.agrees)
        masked = isinstance(self.mask, float) and self.mask > record.MASK
        return ("✓" if self.agrees else "✗") + (f" (mask {percentage(self.mask)})" if masked else "")

    @cached_property
    def unranked(self) -> str:
        """Why no comparison includes the cell, "" if they do: it needs a steady time and a judged, right picture."""
        if self.status != "ok":
            return self.verdict
        if self.apart:
            return self.apart
        if isinstance(self.steady, Missing):
            return self.steady.reason
        reasons = self.by_row("not_judged")
        return f"its picture was not judged: {next(iter(reasons.values()))}" if reasons else ""
