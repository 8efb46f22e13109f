"""Measures one repetition of a job, as every time that rayrace tells is measured: in a process of its own, with the
measurer beside it, what the machine did meanwhile, and what its marks contradict.

Runs of experiments (bench.py) and commands that time without one (turns.py) use it. Hold Host.exclusive meanwhile.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from harness.experiment.experiment import Measure
from harness.process.repetition import Result
from harness.race import contradiction, row
from harness.race.host import Host
from harness.renderer.limits import DEFAULT, Limits
from harness.renderer.parameters import Parameters
from harness.renderer.registry import Entry
from harness.system import ownership, trouble

# Where no experiment says another: s between two looks of the measurer, and that a later frame lasts at least.
INTERVAL, LEAST_FRAME = (Measure.model_fields[name].default for name in ("interval", "least_frame"))
WATCHES = 3  # tries to have a repetition watched to its end


@dataclass(frozen=True, eq=False)
class Task:
    """A job and who does it. scene: names its scene; what is known of one scene's processes is not asked again. name:
    of the job, for people or as a key."""

    entry: Entry
    arrays: dict
    parameters: Parameters
    needs: tuple[str, ...]
    scene: str
    name: str = ""
    timeout: float = 600.0
    limits: Limits = DEFAULT

    @property
    def job(self) -> tuple:
        """What Host.run and Sessions.run take first."""
        return self.entry, self.arrays, self.parameters, self.needs

    @property
    def more(self) -> dict:
        """What they take by name."""
        return {"timeout": self.timeout, "limits": self.limits}


@dataclass(frozen=True, eq=False)
class Measured:
    """One repetition. record: the measured part of a row (store.py), with `disturbed` and its doubts among `warnings`.

    warm: it found its compiled code in `cache`, if it keeps any. fresh: there was none, nor of an earlier process.
    """

    task: Task
    result: Result
    record: dict
    series: Path
    cache: Path
    warm: bool
    fresh: bool


class Audit:
    """Measures the repetitions of one run or command. interval: of the measurer, s."""

    def __init__(self, host: Host, interval: float = INTERVAL):
        self.host, self.interval = host, interval
        self.blanks = contradiction.Blanks()

    def measure(
        self,
        task: Task,
        series: Path,
        cache: Path,
        log: Path | None = None,
        cold: bool = False,
        run: Callable[..., Result] | None = None,
    ) -> Measured:
        """Runs a task once. series: file for the measurer. cache: folder of compiled code; cold: it is not to use that.

        run: runs it in place of Host.run, without a measurer, where it is not timed.
        """
        compiled, begun, before = _files(cache), self.host.clock(), self.host.look()
        more, again = {**task.more, "cache": None if cold else cache, "log": log}, []
        if run:
            result = run(*task.job, **more)
        else:
            result, again = self._watched(*task.job, **more, series=series)
        disturbed, seconds = trouble.between(before, self.host.look()), self.host.clock() - begun
        disturbed["measurer_s"] = _measurer_s(result)
        record = {**row.measured(result, series), "disturbed": disturbed}
        if record["wall_s"] is not None:
            record["warnings"] += again + trouble.doubts(disturbed, seconds, task.parameters.threads)
        warm = not cold and _files(cache) == compiled
        return Measured(task, result, record, series, cache, warm, cold or not compiled)

    def _watched(self, *job, **options) -> tuple[Result, list[str]]:
        """Returns the Result of a repetition, begun again where its measurer was lost; and that as warnings."""
        lost = []
        for _ in range(WATCHES):
            result = self.host.run(*job, **options, interval=self.interval)
            if result.status != "failed" or not result.outcome or not result.outcome.unwatched:
                return result, [f"it was repeated: {reason}" for reason in lost]
            lost.append(result.outcome.unwatched)
        return result, []

    def unranked(self, made: Measured, reason: str | None) -> str | None:
        """None, or why a repetition that is ok takes no part in comparisons. reason: known before; what its marks
        contradict is then one of its warnings."""
        contradicted = self.contradiction(made)
        if contradicted and reason:
            made.record["warnings"].append(contradicted)
        return reason or contradicted

    def contradiction(self, made: Measured) -> str | None:
        """None, or what the marks of a repetition that is ok contradict; it may run once more, for a single pixel."""
        task, blanks = made.task, self.blanks
        if made.warm:
            key, run = (task.entry.name, task.scene), partial(self.again, made)
        elif made.fresh:  # the cost of compiling once is not asked twice
            blanks, key, run = None, None, None
        else:  # it compiled again: so is its blank to do, all of it
            key, run = (task.entry.name, task.scene, "compiles"), partial(self.again, made, cached=False)
        disturbed = made.record["disturbed"]
        return contradiction.reason(made.result, made.series, task.entry, task.parameters, blanks, run, key, disturbed)

    def again(self, made: Measured, parameters: Parameters, cached: bool = True) -> Result:
        """The Result of a job like that of a repetition, but for its parameters. cached: with its compiled code."""
        task, cache = made.task, made.cache if cached else None
        return self.host.run(task.entry, task.arrays, parameters, task.needs, cache=cache, **task.more)


def _measurer_s(result: Result) -> float | dict:
    """Returns the CPU time of a repetition's measurer, s, or why it is unknown."""
    audit = result.outcome.measurer if result.outcome else None
    return audit["cpu_s"] if audit else {"unavailable": "nobody measured, or the measurer gave no account of itself"}


def _files(cache: Path) -> frozenset[str]:
    """The files of compiled code in a folder: a process that adds some has compiled."""
    return frozenset(str(path) for path in cache.rglob("*") if path.name != ownership.MARKER)
