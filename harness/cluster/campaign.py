"""The front end of a run on a cluster: submits its jobs (part.py), follows them, and records how each ended.

The command may end and be repeated with --resume: the folder of the run has the whole state.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from harness import executors
from harness.cluster import batch, part
from harness.cluster.batch import Batch
from harness.errors import UserError
from harness.executors import Executor, State
from harness.experiment.cluster import Dask, Slurm, warning
from harness.experiment.experiment import Experiment
from harness.machine import software
from harness.plan import resume
from harness.plan.plan import Plan, Turn, pair_facts
from harness.plan.predict import Predictor
from harness.race import race
from harness.race.bench import timestamp
from harness.store import store
from harness.store.jobs import Job, Jobs
from harness.store.record import identity, key
from harness.system import output

POLL = 5.0  # s between two questions to the scheduler
LOOK = 1.0  # s between two readings of the rows
# Statuses by the states of Slurm in which the scheduler ended a job.
BY_SCHEDULER = {
    **dict.fromkeys(("CANCELLED", "PREEMPTED", "NODE_FAIL"), "killed"),
    **dict.fromkeys(("TIMEOUT", "DEADLINE"), "timeout"),
}
SETTLE = 2  # answers in a row that a job has ended before it counts: a shared file system shows its last rows late


class Campaign:
    """The run in `folder` of an experiment that was read from `file`. name: of the executor."""

    def __init__(self, folder: Path, experiment: Experiment, file: Path, plan: Plan, name: str):
        self.folder, self.experiment, self.file, self.plan = Path(folder), experiment, Path(file), plan
        self.table = table(experiment, name)
        self.name = name
        self.jobs = Jobs(self.folder)
        self.batches: list[Batch] = []
        self.waiting: list[int] = []  # numbers of batches that the scheduler has no room for yet

    def begin(self, batches: list[Batch], only: tuple[str, ...], renderers: tuple[Path, ...]) -> None:
        """Writes run.json of a new run. only, renderers: as on the command line."""
        self.batches = batches
        executor = {
            "name": self.name,
            "file": str(self.file.resolve()),
            "only": list(only),
            "renderers": [str(path.resolve()) for path in renderers],
            "software": software.here(),
            "batches": [each.record() for each in batches],
            **self._limits(),
        }
        self.jobs.reserve()
        self._describe({**race.describe(self.experiment, self.plan), "pair": _pair(batches), "executor": executor})

    def go_on(self) -> None:
        """Resumes the run. UserError if cells, versions or software have changed since it was submitted."""
        front, _ = store.read_front(self.folder)
        executor = front["executor"]
        changes = software.differences(executor["software"], software.here())
        changes += resume.of_cells(front["cells"], self.plan.cells, part.CHECKED)
        names = [batch.name(cell) for cell in self.plan.cells]
        identities = {identity(cell) for cell in front["cells"]}
        changes += [f"{cell.label}: is new" for cell in self.plan.cells if batch.name(cell) not in identities]
        changes += [f"{', '.join(name)}: is gone" for name in identities - set(names)]
        resume.refuse(self.folder, changes, "start a new run")
        self.batches = [batch.restored(each, self.plan) for each in executor["batches"]]
        facts = {name: value for name, value in front.items() if name not in ("format", "hosts")}
        self._describe({**facts, "executor": {**executor, **self._limits()}})

    def _limits(self) -> dict:
        """The time limit of a job and its warning before the end (s), and the table of the executor."""
        return {"time": self.table.time, "warning": warning(self.table.time), "table": self.table.model_dump()}

    def _describe(self, facts: dict) -> None:
        front = store.Run(self.folder)
        front.describe(**facts)
        front.close()

    def turns(self, number: int) -> list[Turn]:
        """All turns of batch `number`."""
        return self.batches[number].of(self.plan).order(self.experiment.seed, self.experiment.order)

    def missing(self) -> dict[int, list[Turn]]:
        """The missing turns of each batch that is not complete, by its number."""
        done = {key(record) for record in part.finished(self.folder)}
        left = {
            number: [turn for turn in self.turns(number) if _key(turn) not in done]
            for number in range(len(self.batches))
        }
        return {number: turns for number, turns in left.items() if turns}

    def submit(self, executor: Executor, say: Callable[[str], None]) -> None:
        """Submits a job for each incomplete batch without one, as many as the scheduler takes. say: for messages."""
        self.settle(executor)
        busy = {job.number for job in self.jobs.live}
        self.waiting = [number for number in self.missing() if number not in busy]
        if busy:
            say(f"{len(busy)} of its jobs are still waiting or running, and go on")
        count = self._submit(executor)
        if count:
            say(f"{count} jobs submitted")
        if self.waiting:
            say(f"{len(self.waiting)} jobs wait for room: the scheduler takes {executor.most}")

    def _submit(self, executor: Executor) -> int:
        """Submits as many waiting batches as the scheduler has room for; returns how many."""
        room = None if executor.most is None else max(0, executor.most - len(self.jobs.live))
        numbers, self.waiting = self.waiting[:room], self.waiting[len(self.waiting) if room is None else room :]
        for number, name in executor.submit(part.work, self.folder, numbers) if numbers else ():
            self.jobs.submitted(number, name, timestamp())
        return len(numbers)

    def follow(self, executor: Executor, tell: race.Tell, say: Callable[[str], None] = lambda _: None) -> None:
        """Reports each repetition as it ends, until no job is left, and submits waiting batches when there is room."""
        cells = {batch.name(cell): cell for each in self.batches for cell in each.cells}
        rows, ended, last_poll, silence = _Rows(self.folder), {}, -math.inf, ""
        seen = {key(record) for record in rows.new()}
        total = len(seen) + sum(map(len, self.missing().values()))

        def look() -> None:
            for record in rows.new():
                if key(record) not in seen and identity(record) in cells:
                    seen.add(key(record))
                    tell(cells[identity(record)], record, len(seen), max(total, len(seen)), None)

        while self.jobs.live:
            if time.monotonic() - last_poll >= POLL:
                last_poll = time.monotonic()
                unknown = self.settle(executor, ended)
                if unknown and unknown != silence:
                    say(f"unknown state: {unknown}; asking again every {POLL:g} s")
                silence = unknown
                self._submit(executor)
            look()
            if self.jobs.live:
                time.sleep(LOOK)

    def settle(self, executor: Executor, ended: dict[str, int] | None = None) -> str:
        """Records how jobs ended. Returns "", or how many jobs the scheduler gives no state of, and why.

        ended: how many times in a row each job was seen to have ended; None: one time is enough.
        """
        live = self.jobs.live
        states = executor.states([job.name for job in live]) if live else {}
        for job in live:
            state = states[job.name]
            if state.kind != "ended":
                continue
            if ended is not None:
                ended[job.name] = ended.get(job.name, 0) + 1
                if ended[job.name] < SETTLE and (self._word(job) or part.SILENT)["status"] == part.SILENT["status"]:
                    continue
            self._end(job, state)
        unknown = [job.name for job in live if states[job.name].kind == "unknown"]
        return f"{len(unknown)} jobs: {states[unknown[0]].reason}" if unknown else ""

    def _word(self, job: Job) -> dict | None:
        """The end.json that the job itself wrote; None if there is none."""
        places = sorted((self.folder / part.PARTS).glob(f"{job.number:04d}-{job.name}*"))
        return part.ending(places[-1]) if places else None

    def _end(self, job: Job, state: State) -> None:
        word = self._word(job)
        host = state.host or (word or {}).get("hostname", "")
        status, reason = _verdict(word, state)
        if reason:
            reason = f"job {job.name}{f' on {host}' if host else ''}: {reason}"
        self.jobs.end(job, host, status, reason, timestamp())


def table(experiment: Experiment, name: str):
    """The experiment's table for this executor. UserError if dask has none."""
    if name == "dask":
        if experiment.dask is None:
            raise UserError('--executor dask: the experiment has no [dask] with scheduler = "tcp://..."')
        return experiment.dask
    return experiment.slurm


def executor_of(folder: Path, name: str, settings) -> Executor:
    """The executor `name` for the run in `folder`. settings: its table."""
    logs = Path(folder) / "jobs"
    output.make_folder(logs)
    return executors.find(name, settings, logs)


def plan_batches(experiment: Experiment, plan: Plan, name: str, predictor: Predictor) -> list[Batch]:
    """The batches of a plan for the executor `name`."""
    settings = table(experiment, name)
    return batch.make(plan, experiment.measure.pair, settings.cells, settings.time, predictor)


@dataclass(frozen=True)
class Forecast:
    """The jobs and host hours that a plan needs on a cluster, before anything is submitted."""

    table: Slurm | Dask
    batches: list[Batch]

    @property
    def seconds(self) -> float | None:
        """The predicted duration of all batches, from times of this machine; None if unknown."""
        durations = [each.seconds for each in self.batches]
        return None if None in durations else sum(durations)

    @property
    def text(self) -> str:
        """One sentence for people."""
        jobs, limit = len(self.batches), self.table.time
        most = max(len(each.cells) for each in self.batches)
        hours = "unknown" if self.seconds is None else f"{self.seconds / 3600:.3g} h from times of this machine"
        long = sum(each.seconds is not None and each.seconds > limit for each in self.batches)
        sentence = (
            f"{jobs} jobs of at most {most} cells, each with a host of its own for at most {limit / 3600:.3g} h:"
            f" at most {jobs * limit / 3600:.3g} host hours, predicted: {hours}"
        )
        if long:
            sentence += f"; {long} of them will probably run out of time; --resume completes them"
        return sentence

    def record(self) -> dict:
        """For --json."""
        return {
            "jobs": len(self.batches),
            "cells": [len(each.cells) for each in self.batches],
            "hours_at_most": len(self.batches) * self.table.time / 3600,
            "hours_predicted": None if self.seconds is None else self.seconds / 3600,
        }


def _verdict(word: dict | None, state: State) -> tuple[str, str]:
    """Status and reason for the repetitions that a job has not run, from its end.json and the scheduler's state."""
    if word and word["status"] == "":
        return "", ""
    if state.word in BY_SCHEDULER:
        return BY_SCHEDULER[state.word], state.reason
    if word and word["status"] != part.SILENT["status"]:
        return word["status"], word["reason"]
    said = word["reason"] if word else "it left no end.json"
    return "failed", f"{state.reason or 'ended'}: {said}"


def _key(turn: Turn) -> tuple:
    return *batch.name(turn.cell), turn.number, turn.kind


def _pair(batches: list[Batch]) -> dict:
    """For run.json: the pair of the first batch that has one; each part records its own."""
    return pair_facts(next((each.pair for each in batches if each.pair), None), batches[0].reason)


class _Rows:
    """Reads the rows of all parts as they are written."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.sizes: dict[Path, int] = {}
        self.counts: dict[Path, int] = {}

    def new(self) -> list[dict]:
        """The rows since the last call."""
        rows = []
        for path in sorted(self.folder.glob(f"{part.PARTS}/*/repetitions.jsonl")):
            size = path.stat().st_size
            if size == self.sizes.get(path) or not path.with_name("run.json").exists():
                continue
            self.sizes[path] = size
            records = store.read(path.parent)[1]
            rows += records[self.counts.get(path, 0) :]
            self.counts[path] = len(records)
        return rows
