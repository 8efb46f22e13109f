"""The Dask executor, for labs with a running scheduler: a job is a Dask task, run by dask_task.py on a worker.

Nobody holds a job's future: who submitted it may end. The scheduler forgets a task when it ends, so the task leaves
word of how under its name, as an event of the scheduler, which is there as long as the scheduler is.
"""

import importlib.util
import time
import uuid
from collections.abc import Iterator
from pathlib import Path

from harness.errors import UserError
from harness.executors import State, Work, dask_task
from harness.experiment.cluster import Dask as Table

PATIENCE = 10  # s, until a scheduler answers
TAKEN = 60  # s, until it has taken a list of tasks
REMEDY = "start it (`dask scheduler`, and `dask worker` on each host), or mend [dask] scheduler"


class Dask:
    """An Executor (harness/executors)."""

    most = None

    def __init__(self, table: Table):
        if importlib.util.find_spec("distributed") is None:
            raise UserError("--executor dask: distributed is not installed", remedy="pip install 'rayrace[dask]'")
        self.table = table
        self._connected = None

    def submit(self, work: Work, folder: Path, numbers: list[int]) -> Iterator[tuple[int, str]]:
        client = self._client()
        run = f"rayrace-{uuid.uuid4().hex[:12]}"  # of this submission: what failed before is another task
        jobs = [f"{run}-{number}" for number in numbers]
        try:
            self._give(client, work, folder, jobs, numbers)
        except OSError as error:
            raise UserError(f"{self.table.scheduler} takes no more jobs: {_text(error)}") from None
        yield from zip(numbers, jobs, strict=True)

    def _give(self, client, work: Work, folder: Path, jobs: list[str], numbers: list[int]) -> None:
        """Until the scheduler has taken every job; UserError if it does not."""
        import distributed

        place = [work.__module__, work.__qualname__, str(folder.resolve())]
        futures = client.map(_run(), jobs, [place] * len(jobs), numbers, time=self.table.time, key=jobs, pure=False)
        distributed.fire_and_forget(futures)
        end = time.monotonic() + TAKEN
        left = jobs
        while left:
            # Asked before: what has failed since may have been taken, and done, in between.
            failed = {future.key: future for future in futures if future.status == "error"}
            left = client.run_on_scheduler(_left(), left)
            bad = next((failed[job] for job in left if job in failed), None)
            if bad or (left and time.monotonic() > end):
                why = " ".join(str(bad.exception()).split()) if bad else f"it has not taken them in {TAKEN} s"
                raise UserError(f"{self.table.scheduler} takes no more jobs: {why}")
            time.sleep(0.1 if left else 0)

    def states(self, jobs: list[str]) -> dict[str, State]:
        if not jobs:
            return {}
        try:
            told = self._client().run_on_scheduler(_look(), jobs)
        except (UserError, OSError) as error:
            self._connected = None
            return dict.fromkeys(jobs, State("unknown", reason=_text(error)))
        return {job: _state(*told[job]) for job in jobs}

    def cancel(self, jobs: list[str]) -> None:
        import distributed

        client = self._client()
        states = self.states(jobs)
        live = [job for job in jobs if states[job].kind in ("waiting", "running")]
        if not live:
            return
        # Workers first: what begins meanwhile ends at once.
        client.run(dask_task.stop, live, on_error="ignore")
        waiting = [job for job in live if states[job].kind == "waiting"]
        for job in waiting:
            client.log_event(job, {"host": "", "reason": dask_task.CANCELLED})
        client.cancel([distributed.Future(job, client=client) for job in waiting], force=True)

    def _client(self):
        """Connected to the scheduler. UserError if nobody answers."""
        import distributed

        if self._connected is None or self._connected.status != "running":
            address = self.table.scheduler
            try:
                self._connected = distributed.Client(address, timeout=PATIENCE, set_as_default=False)
            except (OSError, ValueError) as error:
                why = f"[dask] scheduler = {address!r}: nobody answers there in {PATIENCE} s ({_text(error)})"
                raise UserError(why, remedy=REMEDY) from None
        return self._connected


# What the scheduler sees is a function in a function: it travels whole, so that rayrace need not be installed there.


def _run():
    def run(job, work, number, time):
        from harness.executors import dask_task

        dask_task.run(job, work, number, time)

    return run


def _left():
    def left(jobs, dask_scheduler=None):
        """Returns the jobs that the scheduler neither has nor had."""
        return [job for job in jobs if job not in dask_scheduler.tasks and not dask_scheduler.get_events(topic=job)]

    return left


def _look():
    def look(jobs, dask_scheduler=None):
        """Returns for each job its own last message, and the scheduler's view: state, host, error."""
        found = {}
        for job in jobs:
            events = [event for _, event in dask_scheduler.get_events(topic=job)]
            task = dask_scheduler.tasks.get(job)
            if task is None:
                found[job] = events, "", "", ""
                continue
            worker = task.processing_on
            running = worker is not None and task in worker.executing
            state = "executing" if running else task.state
            if state == "queued" and not dask_scheduler.workers:
                state = "no-worker"
            found[job] = events, state, worker.host if worker is not None else "", task.exception_text or ""
        return found

    return look


def _state(events: list[dict], word: str, host: str, error: str) -> State:
    if events:
        return State("ended", events[-1]["host"], word, events[-1]["reason"])
    if word == "executing":
        return State("running", host, word)
    if word in ("memory", "erred", "forgotten"):
        return State("ended", host, word, error)
    if word:
        return State("waiting", host, word, "no worker is there" if word == "no-worker" else "")
    lost = "is known no more to the scheduler: its workers died, or the scheduler was started anew"
    return State("ended", reason=lost)


def _text(error: BaseException) -> str:
    return next((line.strip() for line in str(error).splitlines() if line.strip()), type(error).__name__)
