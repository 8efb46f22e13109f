"""Times a few jobs without an experiment as a run times its cells: processes in turn, each audited (audit.py).

Every time that a command tells comes from here. What it tells of a doubt are the words of a run.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from harness.errors import UserError
from harness.judge import judge
from harness.plan.plan import rounds
from harness.process.repetition import Result
from harness.process.scratch import scratch
from harness.race import frames, row
from harness.race.audit import Audit, Measured, Task
from harness.renderer.builder import cache_folder
from harness.renderer.registry import Entry
from harness.statistics import statistics, steady
from harness.statistics.statistics import Estimate
from harness.store.record import CONTRADICTED, FALSE_FRAMES, UNCHECKED
from harness.system import trouble

MOST_CONTRADICTED = 1 / 2  # of the processes of a job that has a time


def kernels(entry: Entry) -> Path:
    """The folder in which a renderer keeps compiled code between commands. Cells of a run have folders of their own."""
    return cache_folder("kernels") / entry.renderer.manifest.name


@dataclass(eq=False)
class Times:
    """What was measured of one job. records: of each process the measured part of a row (store.py) and its status."""

    task: Task
    records: list[dict] = field(default_factory=list)

    def repeat(self, audit: Audit, series: Path, due: bool = False) -> Result:
        """Times it once more. series: file for the measurer. due: a later frame is to be checked: whether it is the
        picture that a job of its own makes; nobody judges that picture."""
        task = self.task
        made = audit.measure(task, series, kernels(task.entry))
        status, reason, unranked = made.result.status, made.result.reason, row.unranked(task.entry, made.result.said)
        if status == "ok" and (broken := judge.broken(made.result)):
            status, reason = "wrong picture", broken
        if status == "ok":
            unranked = audit.unranked(made, unranked) or self._false_frame(audit, made, due)
        named = {"variant": task.entry.name, "cell": task.name, "pass": "timed"}
        self.records.append({**made.record, **named, "status": status, "reason": reason, "unranked": unranked})
        return made.result

    def _false_frame(self, audit: Audit, made: Measured, due: bool) -> str | None:
        """None, or why a later frame of a good process is not what it should be; a doubt, if that is not known."""
        parameters = self.task.parameters
        reason = frames.unchecked(self.task.entry, parameters)
        if not reason and due and parameters.frames:
            choice, run = frames.choose(made.result, parameters), partial(audit.again, made)
            reason = frames.verdict(choice, made.result, parameters, run, lambda *_: None) or ""
        if not reason.startswith(UNCHECKED):
            return reason or None
        made.record["warnings"].append(reason)
        return None

    @property
    def failed(self) -> str:
        """Why a process of it failed; "" if none did."""
        return next(
            (f"{record['status']}: {record['reason']}" for record in self.records if record["status"] != "ok"), ""
        )

    @property
    def counting(self) -> dict[int, dict]:
        """The records of the processes that count by round: those that are ok and contradict nothing."""
        return {
            number: record
            for number, record in enumerate(self.records)
            if record["status"] == "ok" and not (record["unranked"] or "").startswith(CONTRADICTED)
        }

    @property
    def broken(self) -> str:
        """Why the job has no time; "" if it has one."""
        if self.failed:
            return self.failed
        unranked = [record["unranked"] or "" for record in self.records]
        if false := next((why for why in unranked if why.startswith(FALSE_FRAMES)), ""):
            return false
        lying = [record["unranked"] for number, record in enumerate(self.records) if number not in self.counting]
        if len(lying) > MOST_CONTRADICTED * len(self.records):
            return lying[0]
        processes = [steady.find(record["frames_s"]) for record in self.counting.values()]
        return steady.together(
            [process.change for process in processes if process.change is not None],
            [process.note for process in processes],
        )

    @property
    def rounds(self) -> dict[int, float]:
        """The time of a frame of each process that counts (s), by round."""
        times = {number: steady.find(record["frames_s"]).seconds for number, record in self.counting.items()}
        return {number: seconds for number, seconds in times.items() if seconds is not None}

    @property
    def seconds(self) -> Estimate:
        """The time of a frame, s, with its interval over processes. Of a job that is not broken."""
        return statistics.median(list(self.rounds.values()))

    def record(self) -> dict:
        """The time of a frame and its doubts, for JSON."""
        if self.broken:
            return {"unavailable": self.broken, "doubts": self.doubts}
        estimate = self.seconds
        facts = {"seconds": estimate.value, "low": estimate.low, "high": estimate.high, "processes": estimate.processes}
        return {**facts, "doubts": self.doubts}

    @property
    def peaks(self) -> list[float]:
        """Peak memory of the processes that count, bytes, where it is known."""
        peaks = [(record["memory"] or {}).get("peak_bytes") for record in self.counting.values()]
        return [peak for peak in peaks if peak is not None]

    @property
    def doubts(self) -> list[str]:
        """The reasons to doubt the time, as a run has them: without what disturbed fewer than half of the processes."""
        warnings = [record["warnings"] for record in self.records]
        seldom = trouble.seldom(warnings)
        doubts = [text for texts in warnings for text in texts if text not in seldom]
        doubts += [record["unranked"] for record in self.records if record["unranked"]]
        return list(dict.fromkeys(doubts))


def take(tasks: Sequence[Task], count: int, audit: Audit, seed: int = 0) -> list[Times]:
    """Times each of the tasks in `count` processes, as `more` does."""
    timings = [Times(task) for task in tasks]
    more(timings, count, audit, seed)
    return timings


def more(timings: list[Times], count: int, audit: Audit, seed: int = 0) -> None:
    """Times each in `count` further processes, in rounds as of Plan.order. Hold Host.exclusive meanwhile.

    What fails has no further turn.
    """
    turns, before = frames.Turns(), [len(times.records) for times in timings]
    with scratch() as folder:
        for number, members in enumerate(rounds(list(enumerate(timings)), count, seed)):
            for place, times in members:
                if not times.failed:
                    due = turns.is_due(str(place), before[place] + number, before[place] + count)
                    times.repeat(audit, folder / f"{place}-{number}.csv", due)


def paired(above: Times, below: Times) -> tuple[list[float], list[float]]:
    """The times of two jobs in the rounds that both have, in order."""
    above_times, below_times = above.rounds, below.rounds
    both = sorted(above_times.keys() & below_times.keys())
    return [above_times[number] for number in both], [below_times[number] for number in both]


def ratio(above: Times, below: Times) -> Estimate:
    """The ratio of two times, paired by round. UserError if they share no round."""
    above_times, below_times = paired(above, below)
    if not above_times:
        raise UserError("no round has a time of both", remedy="more processes may have one")
    return statistics.ratio(above_times, below_times, paired=True)


def floor(first: Times, again: Times) -> statistics.Floor:
    """The noise floor of a job that was timed twice in each round."""
    return statistics.noise_floor(*paired(first, again))
