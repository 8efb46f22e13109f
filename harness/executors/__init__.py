"""Executors run tasks on hosts of a scheduler, one task at a time on each host.

A task is `work(folder, number)`: a function of a module, a folder that all machines see, and the number of the task.
Its input and output are files in that folder, so the process that submitted it may end.
"""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple, Protocol

from harness.errors import UserError

Work = Callable[[str, int], None]


class State(NamedTuple):
    """The state of a job. kind: waiting, running, ended or unknown. host: where it runs or ran; "" if unknown. word:
    the scheduler's name of the state. reason: why it waits, or why it ended before its work was done; else "".
    """

    kind: str
    host: str = ""
    word: str = ""
    reason: str = ""


class Executor(Protocol):
    """Runs tasks, each as a job."""

    @property
    def most(self) -> int | None:
        """How many jobs the scheduler accepts at once; None if there is no limit, or it is unknown."""

    def submit(self, work: Work, folder: Path, numbers: list[int]) -> Iterator[tuple[int, str]]:
        """Yields (number, job) for each task as it is accepted. UserError if one is refused; those before it run."""

    def states(self, jobs: list[str]) -> dict[str, State]:
        """The State of each of `jobs`."""

    def cancel(self, jobs: list[str]) -> None:
        """Cancels jobs; has no effect on ended ones."""


NAMES = ("local", "slurm", "dask")  # local: in this process, without an executor


def find(name: str, settings, logs: Path) -> Executor:
    """The executor of this name. settings: its table (cluster.py); logs: folder for the output of jobs.

    UserError for an unknown name, or if a program or package that it needs is missing.
    """
    if name == "slurm":
        from harness.executors.slurm import Slurm

        return Slurm(settings, logs)
    if name == "dask":
        from harness.executors.dask import Dask

        return Dask(settings)
    raise UserError(f"--executor {name}: known: {', '.join(NAMES[1:])}")


def first_line(error: BaseException) -> str:
    """The first line of an error's text that is not blank; without one, the error's class."""
    return next((line.strip() for line in str(error).splitlines() if line.strip()), type(error).__name__)
