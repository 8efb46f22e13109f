"""Runs a task on a Dask worker (dask.py), in a process of its own that receives signals and can be ended, as on Slurm.

As a program, `python -m harness.executors.dask_task`, it is that process: it reads {"module", "function", "folder",
"number"} from a line of standard input, does the work and prints {"reason"}. RAYRACE_JOB is the job's name. If standard
input closes, the worker has died, and the process ends itself.
"""

import contextlib
import importlib
import json
import os
import select
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import traceback
from collections.abc import Iterator
from pathlib import Path

LOOK = 1.0  # s between two polls; more would disturb measurements
GRACE = 30.0  # s between SIGTERM and SIGKILL, as Slurm's default
CANCELLED = "was cancelled"
LATE = "ran out of time"
LONGEST = 300  # characters of a reason

_stopped: set[str] = set()  # jobs of this worker that are to end


class Failed(Exception):
    """The work was not done."""


def stop(jobs: list[str]) -> None:
    """On a worker: ends these jobs, or keeps them from beginning."""
    _stopped.update(jobs)


def run(job: str, work: list[str], number: int, time: float) -> None:
    """Calls work(folder, number) when the host is free, for at most `time` seconds. work: module, function, folder.

    Records as an event of the scheduler how the job ended. Raises Failed if its work was not done.
    """
    from distributed import get_worker

    reason = _run(job, work, number, time)
    get_worker().log_event(job, {"host": socket.gethostname(), "reason": reason[:LONGEST]})
    if reason:
        raise Failed(reason)


def _run(job: str, work: list[str], number: int, seconds: float) -> str:
    """Why the work was not done; "" if it was."""
    with _turn(job) as claimed:
        if not claimed:
            return CANCELLED
        task = dict(zip(("module", "function", "folder"), work, strict=True), number=number)
        command = [sys.executable, "-m", "harness.executors.dask_task"]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "env": {**os.environ, "RAYRACE_JOB": job}}
        process = subprocess.Popen(command, start_new_session=True, **pipes)
        with process.stdin, process.stdout:
            with contextlib.suppress(BrokenPipeError):
                process.stdin.write(json.dumps(task).encode() + b"\n")
                process.stdin.flush()
            why = _watch(process, job, time.monotonic() + seconds)
            said = process.stdout.read()
        code = process.wait()
    if why:
        return why
    with contextlib.suppress(ValueError):
        return json.loads(said)["reason"]
    return f"failed (signal {-code})" if code < 0 else f"failed (exit {code})"


@contextlib.contextmanager
def _turn(job: str) -> Iterator[bool]:
    """Waits until this task has the host to itself; yields False if the task was stopped meanwhile."""
    from harness.system import lock

    user = os.getuid() if hasattr(os, "getuid") else 0
    file = Path(tempfile.gettempdir()) / f"rayrace-task-{user}.lock"
    with contextlib.ExitStack() as stack:
        while job not in _stopped:
            try:
                stack.enter_context(lock.of_file(file))
                break
            except lock.Busy:
                time.sleep(LOOK)
        yield job not in _stopped  # it may have been stopped while it took the lock


def _watch(process: subprocess.Popen, job: str, until: float) -> str:
    """Waits until the process ends, or ends it when it must stop or is late. Returns the reason, or ""."""
    why, kill = "", float("inf")
    while not select.select([process.stdout], [], [], LOOK)[0]:  # ready when it prints its result or ends
        now = time.monotonic()
        if not why and (job in _stopped or now > until):
            why = CANCELLED if job in _stopped else LATE
            kill = now + GRACE
            process.send_signal(signal.SIGTERM)
        if now > kill:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
    return why


def _end_with_the_worker() -> None:
    """Ends this process when standard input closes. In a thread, as the work needs the main one for its signals."""

    def watch():
        os.read(0, 1)
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(GRACE)
        os.killpg(os.getpid(), signal.SIGKILL)

    threading.Thread(target=watch, daemon=True).start()


def main() -> None:
    answer = os.dup(1)
    os.dup2(2, 1)  # output of the work goes to the worker's log
    line = b""
    while not line.endswith(b"\n"):
        line += os.read(0, 1) or b"\n"
    task = json.loads(line)
    _end_with_the_worker()
    try:
        work = importlib.import_module(task["module"])
        for name in task["function"].split("."):
            work = getattr(work, name)
        work(task["folder"], task["number"])
        reason = ""
    except SystemExit as end:
        if not isinstance(end.code, str):
            raise
        reason = end.code
    except Exception as error:
        traceback.print_exc()
        reason = f"failed ({type(error).__name__}: {error})"
    os.write(answer, json.dumps({"reason": reason}).encode())


if __name__ == "__main__":
    main()
