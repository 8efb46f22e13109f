"""The Slurm executor, through submitit: a job has one exclusive host.

Jobs are submitted as arrays, as long as the scheduler accepts. The [slurm] table has their options (cluster.py).

A job receives SIGTERM when it is cancelled, pre-empted, or at the end of its time; some seconds later (Slurm's
KillWait, or the partition's GraceTime) it is killed with its descendants. Without cgroups the descendants receive
SIGTERM too. A job whose host is lost is queued again under its name.
"""

import contextlib
import io
import logging
import math
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from harness.errors import UserError, missing
from harness.executors import State, Work, first_line
from harness.experiment.cluster import Slurm as Table

PATIENCE = 60  # s for a command of Slurm to answer
FORMAT = "%i|%T|%N|%r"  # of squeue: job, state, hosts, reason
SOME = 1000  # indices of an array in one argument of scancel
ENDED = ("Invalid job id", "already completing or completed")  # messages of scancel about ended jobs
RUNNING = ("RUNNING", "COMPLETING", "SUSPENDED", "STOPPED", "SIGNALING", "STAGE_OUT")
WAITING = ("PENDING", "CONFIGURING", "REQUEUED", "REQUEUE_HOLD", "REQUEUE_FED", "RESIZING", "SPECIAL_EXIT")
ENDS = {
    "CANCELLED": "was cancelled (scancel)",
    "TIMEOUT": "ran out of time",
    "PREEMPTED": "was pre-empted",
    "NODE_FAIL": "lost its host",
    "OUT_OF_MEMORY": "ran out of memory",
    "BOOT_FAIL": "got a host that did not start",
    "DEADLINE": "reached its deadline",
}


class Slurm:
    """An Executor (harness/executors). logs: folder for the output of jobs and the files of submitit."""

    def __init__(self, table: Table, logs: Path):
        for program in ("sbatch", "squeue", "scancel"):
            if shutil.which(program) is None:
                raise UserError(f"--executor slurm: no {program} here", remedy="run rayrace on a login node")
        self.table, self.logs = table, logs.resolve()

    @property
    def most(self) -> int | None:
        """The largest number of jobs in the queue."""
        return self._limit("MaxJobCount")

    def submit(self, work: Work, folder: Path, numbers: list[int]) -> Iterator[tuple[int, str]]:
        try:
            import submitit
        except ImportError:
            raise missing("--executor slurm: submitit", "slurm") from None

        logging.getLogger("submitit").setLevel(logging.ERROR)
        # exec: Python becomes the job's first process. Slurm signals only that before the time is up; a shell would end
        # at the first SIGTERM, and its children would be killed or left running on the host.
        python = f"exec {shlex.quote(sys.executable)}"
        executor = submitit.SlurmExecutor(folder=self.logs, max_num_timeout=0, python=python)
        executor.update_parameters(**self._parameters())
        longest = self._limit("MaxArraySize") or 1001
        for start in range(0, len(numbers), longest):
            some = numbers[start : start + longest]
            try:
                with contextlib.redirect_stderr(io.StringIO()):  # submitit prints errors that it raises
                    jobs = executor.map_array(work, [str(folder.resolve())] * len(some), some)
            except (RuntimeError, OSError, subprocess.CalledProcessError) as error:
                raise UserError(f"Slurm refuses more jobs: {first_line(error)}") from None
            yield from zip(some, (job.job_id for job in jobs), strict=True)

    def _parameters(self) -> dict:
        """The parameters for submitit. No srun: a step may get the cores of one task, not all of the host's."""
        table = self.table
        values = {name: getattr(table, name) for name in ("account", "partition", "constraint")}
        parameters = {name: value for name, value in values.items() if value is not None}
        if table.gpus:
            parameters["gpus_per_node"] = table.gpus
        return parameters | {
            "job_name": "rayrace",
            "time": math.ceil(table.time / 60),
            "nodes": 1,
            "ntasks_per_node": 1,
            "exclusive": True,
            "use_srun": False,
            "stderr_to_stdout": True,
            "array_parallelism": table.at_once,
            "setup": list(table.setup) or None,
            "wckey": None,
            # mem 0: all memory of the host. submitit sets a warning signal before the end, which can come a minute
            # early and end a Python that is still starting; CONT has no effect. Jobs watch their time themselves.
            "additional_parameters": {"mem": 0, "signal": "B:CONT@1", **table.options},
        }

    def states(self, jobs: list[str]) -> dict[str, State]:
        if not jobs:
            return {}
        try:
            states = self._queue(jobs)
        except OSError as error:
            return dict.fromkeys(jobs, State("unknown", reason=str(error)))
        gone = [job for job in jobs if job not in states]
        return states | (self._accounts(gone) if gone else {})

    def _queue(self, jobs: list[str]) -> dict[str, State]:
        """The states of jobs that the scheduler still knows: all that have not ended, and those that ended recently. It
        forgets jobs of an array at once that are cancelled before they begin.

        Without --array, which omits the last job that is left of an array.
        """
        wanted, states, failed = set(jobs), {}, []
        for line in _ask(["squeue", "--me", "--noheader", "--states=all", f"--format={FORMAT}"]).splitlines():
            name, word, hosts, reason = (line.split("|") + [""] * 4)[:4]
            for job in wanted.intersection(_members(name)):
                states[job] = _state(word, hosts, reason=reason)
                failed += [job] if word == "FAILED" else []
        if failed:
            fields = "--Format=JobArrayID:40|,NodeList:100|,exit_code:20|"
            for line in _ask(["squeue", "--me", "--noheader", "--states=failed", fields]).splitlines():
                job, hosts, code = ([part.strip() for part in line.split("|")] + [""] * 3)[:3]
                if job in failed:
                    states[job] = _state("FAILED", hosts, code)
        return states

    def _accounts(self, jobs: list[str]) -> dict[str, State]:
        """The states, from Slurm's accounting, of jobs that the scheduler has forgotten: all of them have ended."""
        states = dict.fromkeys(jobs, State("ended", reason="the scheduler no longer knows it"))
        if shutil.which("sacct") is None:
            return states
        names = ",".join(_arrays(jobs))
        fields = "--format=JobID,State,NodeList,ExitCode"
        try:
            text = _ask(["sacct", "-X", "--noheader", "--parsable2", fields, "-j", names])
        except OSError:
            return states
        for line in text.splitlines():
            job, word, hosts, code = (line.split("|") + [""] * 4)[:4]
            if job in states:
                states[job] = _state(word, hosts, code)
        return states

    def cancel(self, jobs: list[str]) -> None:
        names = []
        for array, indices in _arrays(jobs).items():
            some = [indices[start : start + SOME] for start in range(0, len(indices), SOME)]
            names += [f"{array}_[{','.join(map(str, each))}]" for each in some] or [array]
        for name in names:
            try:
                _ask(["scancel", name])
            except OSError as error:
                if not any(word in str(error) for word in ENDED):
                    raise UserError(f"jobs were not cancelled: {error}", remedy="try again") from None

    def _limit(self, name: str) -> int | None:
        try:
            text = _ask(["scontrol", "show", "config"])
        except OSError:
            return None
        match = re.search(rf"^{name}\s*=\s*(\d+)", text, re.MULTILINE)
        return int(match[1]) if match else None


def _arrays(jobs: list[str]) -> dict[str, list[int]]:
    """The indices of jobs by array: `12_0`, `12_1` and the single job `13` become {"12": [0, 1], "13": []}."""
    arrays: dict[str, list[int]] = {}
    for job in jobs:
        array, _, index = job.partition("_")
        arrays.setdefault(array, []).extend([int(index)] if index else [])
    return arrays


def _members(name: str) -> Iterator[str]:
    """Yields the jobs that a name of squeue stands for: 12, 12_3 or, for waiting ones, 12_[0-2,5-9:2%4]."""
    array, bracket, rest = name.partition("_[")
    if not bracket:
        yield name
        return
    for some in rest.partition("]")[0].partition("%")[0].split(","):
        match = re.fullmatch(r"(\d+)(?:-(\d+))?(?::(\d+))?", some)
        if match is None:
            raise OSError(f"squeue: unknown form of a job name: {name}")
        first, last, step = match.groups()
        yield from (f"{array}_{index}" for index in range(int(first), int(last or first) + 1, int(step or 1)))


def _state(word: str, hosts: str, code: str = "", reason: str = "") -> State:
    """The State for Slurm's name of it, such as `CANCELLED by 1000`. code: the exit code."""
    name = word.split()[0].rstrip("+") if word.split() else ""
    host = "" if hosts in ("", "None assigned") else hosts
    if name in WAITING:
        return State("waiting", host, name, "" if reason == "None" else reason)
    if name in RUNNING:
        return State("running", host, name)
    if name == "COMPLETED":
        return State("ended", host, name)
    if name == "FAILED":
        return State("ended", host, name, f"failed ({_code(code) or reason or 'no reason known'})")
    return State("ended", host, name, ENDS.get(name, f"ended as {name}"))


def _code(code: str) -> str:
    """The text for an exit code: `7:0` of sacct and 1792 of squeue, a status of wait(2), become "exit 7"."""
    status, _, number = code.partition(":")
    if not status.isdigit():
        return ""
    exit_, signal = (int(status), int(number or 0)) if ":" in code else (int(status) >> 8, int(status) & 127)
    return f"signal {signal}" if signal else f"exit {exit_}" if exit_ else ""


def _ask(command: list[str]) -> str:
    """Runs a Slurm command and returns its output. OSError if it fails."""
    environment = {**os.environ, "LC_ALL": "C", "SLURM_BITSTR_LEN": "0"}  # 0: squeue does not abbreviate arrays
    try:
        answer = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, env=environment)
    except subprocess.TimeoutExpired:
        raise OSError(f"{command[0]} did not answer in {PATIENCE} s") from None
    if answer.returncode:
        raise OSError(f"{command[0]}: {answer.stderr.strip()}")
    return answer.stdout
