"""The Dask executor, for a running scheduler: a job is a Dask task, which dask_task.py runs on a worker.

No process holds a job's future, so the process that submitted it may end. The scheduler forgets a task when it ends, so
the task records its end as an event under its name, which the scheduler keeps while it runs.
"""

import importlib.util
import time
import uuid
from collections.abc import Iterator
from pathlib import Path

from harness.errors import UserError, missing
from harness.executors import State, Work, dask_task, first_line
from harness.experiment.cluster import Dask as Table

PATIENCE = 10  # s for a scheduler to answer
TAKEN = 60  # s for it to accept a list of tasks
REMEDY = "start it (`dask scheduler`, and `dask worker` on each host), or correct [dask] scheduler"


class Dask:
    """An Executor (harness/executors)."""

    most = None

    def __init__(self, table: Table):
        if importlib.util.find_spec("distributed") is None:
            raise missing("--executor dask: distributed", "dask")
        self.table = table
        self._connected = None

    def submit(self, work: Work, folder: Path, numbers: list[int]) -> Iterator[tuple[int, str]]:
        client = self._client()
        run = f"rayrace-{uuid.uuid4().hex[:12]}"  # unique: a task that failed before has another name
        jobs = [f"{run}-{number}" for number in numbers]
        try:
            self._give(client, work, folder, jobs, numbers)
        except OSError as error:
            raise UserError(f"{self.table.scheduler} refuses more jobs: {first_line(error)}") from None
        yield from zip(numbers, jobs, strict=True)

    def _give(self, client, work: Work, folder: Path, jobs: list[str], numbers: list[int]) -> None:
        """Submits jobs and waits until the scheduler has accepted each; UserError if it does not."""
        import distributed

        place = [work.__module__, work.__qualname__, str(folder.resolve())]
        futures = client.map(_run(), jobs, [place] * len(jobs), numbers, time=self.table.time, key=jobs, pure=False)
        distributed.fire_and_forget(futures)
        end = time.monotonic() + TAKEN
        left = jobs
        while left:
            # Read first: a job that fails after this line may have been accepted, and done, before the next.
            failed = {future.key: future for future in futures if future.status == "error"}
            left = client.run_on_scheduler(_left(), left)
            bad = next((failed[job] for job in left if job in failed), None)
            if bad or (left and time.monotonic() > end):
                why = " ".join(str(bad.exception()).split()) if bad else f"it did not accept them in {TAKEN} s"
                raise UserError(f"{self.table.scheduler} refuses more jobs: {why}")
            time.sleep(0.1 if left else 0)

    def states(self, jobs: list[str]) -> dict[str, State]:
        if not jobs:
            return {}
        try:
            answers = self._client().run_on_scheduler(_look(), jobs)
        except (UserError, OSError) as error:
            self._connected = None
            return dict.fromkeys(jobs, State("unknown", reason=first_line(error)))
        return {job: _state(*answers[job]) for job in jobs}

    def cancel(self, jobs: list[str]) -> None:
        import distributed

        client = self._client()
        states = self.states(jobs)
        live = [job for job in jobs if states[job].kind in ("waiting", "running")]
        if not live:
            return
        # Workers first, so that a job that begins meanwhile ends at once.
        client.run(dask_task.stop, live, on_error="ignore")
        waiting = [job for job in live if states[job].kind == "waiting"]
        for job in waiting:
            client.log_event(job, {"host": "", "reason": dask_task.CANCELLED})
        client.cancel([distributed.Future(job, client=client) for job in waiting], force=True)

    def _client(self):
        """The client, connected to the scheduler. UserError if it does not answer."""
        import distributed

        if self._connected is None or self._connected.status != "running":
            address = self.table.scheduler
            try:
                self._connected = distributed.Client(address, timeout=PATIENCE, set_as_default=False)
            except (OSError, ValueError) as error:
                why = f"[dask] scheduler = {address!r}: no answer in {PATIENCE} s ({first_line(error)})"
                raise UserError(why, remedy=REMEDY) from None
        return self._connected


# Functions in functions are pickled as code, so the scheduler does not need rayrace.


def _run():
    def run(job, work, number, time):
        from harness.executors import dask_task

        dask_task.run(job, work, number, time)

    return run


def _left():
    def left(jobs, dask_scheduler=None):
        """The jobs that the scheduler does not know and has no events of."""
        return [job for job in jobs if job not in dask_scheduler.tasks and not dask_scheduler.get_events(topic=job)]

    return left


def _look():
    def look(jobs, dask_scheduler=None):
        """For each job its events, and the scheduler's state, host and error."""
        states = {}
        for job in jobs:
            events = [event for _, event in dask_scheduler.get_events(topic=job)]
            task = dask_scheduler.tasks.get(job)
            if task is None:
                states[job] = events, "", "", ""
                continue
            worker = task.processing_on
            running = worker is not None and task in worker.executing
            state = "executing" if running else task.state
            if state == "queued" and not dask_scheduler.workers:
                state = "no-worker"
            states[job] = events, state, worker.host if worker is not None else "", task.exception_text or ""
        return states

    return look


def _state(events: list[dict], word: str, host: str, error: str) -> State:
    if events:
        return State("ended", events[-1]["host"], word, events[-1]["reason"])
    if word == "executing":
        return State("running", host, word)
    if word in ("memory", "erred", "forgotten"):
        return State("ended", host, word, error)
    if word:
        return State("waiting", host, word, "there is no worker" if word == "no-worker" else "")
    lost = "the scheduler no longer knows it: its workers died, or the scheduler was restarted"
    return State("ended", reason=lost)
