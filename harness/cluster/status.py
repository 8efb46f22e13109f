"""Reports the progress of a run: finished repetitions, waiting and running jobs, losses with their reasons."""

import json
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from harness.cluster.campaign import executor_of
from harness.executors import Executor, State
from harness.experiment.cluster import Dask, Slurm
from harness.store import likeness, merge, store
from harness.store.jobs import Job, Jobs
from harness.store.record import identity, key

TABLES = {"slurm": Slurm, "dask": Dask}


@dataclass(frozen=True)
class Line:
    """The state of a batch. done, all: numbers of repetitions; job: its last one, or None; state: the scheduler's
    now, or None if the job has ended or was never submitted."""

    number: int
    cells: int
    done: int
    all: int
    job: Job | None
    state: State | None

    @property
    def host(self) -> str:
        """The host that its job runs or ran on; "" if unknown."""
        return (self.state.host if self.state else "") or (self.job.host if self.job else "")

    @property
    def said(self) -> str:
        """The state of its job, for people."""
        if self.job is None:
            return "not submitted"
        if self.job.ended:
            return f"ended: {self.job.reason}" if self.job.reason else "ended"
        state = self.state or State("unknown")
        return f"{state.kind} ({state.reason})" if state.reason else state.kind


@dataclass(frozen=True)
class Status:
    """The state of a run. statuses: rows by status; done, all: numbers of repetitions; unlike: differences of hosts."""

    folder: Path
    facts: dict
    statuses: Counter
    done: int
    all: int
    lines: list[Line]
    unlike: list[str]

    @property
    def live(self) -> int:
        """How many jobs have not ended."""
        return sum(line.job is not None and not line.job.ended for line in self.lines)

    def record(self) -> dict:
        """For --json."""
        return {
            "run": str(self.folder),
            "title": self.facts["title"],
            "executor": self.facts.get("executor", {}).get("name", "local"),
            "repetitions": self.all,
            "done": self.done,
            "statuses": dict(self.statuses),
            "jobs": [
                {
                    "batch": line.number, "cells": line.cells, "repetitions": line.all, "done": line.done,
                    "job": line.job and line.job.name, "state": line.said, "host": line.host,
                }
                for line in self.lines
            ],
            "unlike": self.unlike,
        }  # fmt: skip


def of(folder: Path) -> Status:
    """The Status of the run in a folder. UserError if `folder` is no run."""
    folder = Path(folder)
    hosts = store.hosts(folder)
    facts, records = store.read(folder, hosts=list(hosts))
    executor = facts.get("executor")
    ran = [record for record in records if not record.get("lost")]
    done = {key(record) for record in ran if record["pass"] != "load"}
    statuses = Counter(record["status"] for record in records)
    if executor is None:
        names = {cell["cell"]: identity(cell) for cell in facts["cells"]}
        count = len(merge.turns(facts, {"cells": names.values(), "pair": names.get(facts["pair"].get("cell"))}))
        return Status(folder, facts, statuses, len(done), count, [], [])
    jobs = Jobs(folder)
    last, live = jobs.last(), [job.name for job in jobs.live]
    states = scheduler(folder, executor).states(live) if live else {}
    lines = []
    for number, batch in enumerate(executor["batches"]):
        job = last.get(number)
        wanted = merge.turns(facts, batch)
        state = states.get(job.name) if job else None
        lines.append(Line(number, len(batch["cells"]), sum(name in done for name in wanted), len(wanted), job, state))
    return Status(folder, facts, statuses, len(done), sum(line.all for line in lines), lines, likeness.of_run(folder))


def cancel(folder: Path) -> int:
    """Cancels the jobs of the run in a folder; returns how many."""
    front, _ = store.read_front(Path(folder))
    names = [job.name for job in Jobs(folder).live]
    if names:
        scheduler(Path(folder), front["executor"]).cancel(names)
    return len(names)


def scheduler(folder: Path, executor: dict) -> Executor:
    """The executor that a run was submitted to. executor: that of its run.json."""
    settings = (
        TABLES[executor["name"]].model_validate_json(json.dumps(executor["table"]))
        if executor["name"] in TABLES
        else None
    )
    return executor_of(folder, executor["name"], settings)
