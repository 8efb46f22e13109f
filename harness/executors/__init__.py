"""Executors: run tasks in this process or on hosts of a scheduler, each host one task at a time.

A task is `work(folder, number)`: a function of a module, a folder that all machines see, and which of the folder's
tasks it is. All that it is told and all that comes of it lies in the folder: whoever submitted it need not stay.
"""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple, Protocol

from harness.errors import UserError

Work = Callable[[str, int], None]


class State(NamedTuple):
    """The state of a job. kind: waiting, running, ended or unknown. host: where it runs or ran; "" if unknown. word:
    the scheduler's own for it. reason: why it waits, or why it ended before its work was done; "" if it need not say.
    """

    kind: str
    host: str = ""
    word: str = ""
    reason: str = ""


class Executor(Protocol):
    """Has tasks done, one job each."""

    @property
    def most(self) -> int | None:
        """How many jobs the scheduler takes at once; None if it sets no limit, or does not tell."""

    def submit(self, work: Work, folder: Path, numbers: list[int]) -> Iterator[tuple[int, str]]:
        """(number, job) of each task as it is accepted. UserError if one is not; those before it are."""

    def states(self, jobs: list[str]) -> dict[str, State]:
        """The State of each of `jobs`."""

    def cancel(self, jobs: list[str]) -> None:
        """End jobs; those that have ended are left alone."""


NAMES = ("local", "slurm", "dask")


def find(name: str, settings, logs: Path) -> Executor:
    """The executor called so; settings: its table (cluster.py); logs: folder for what jobs print.

    UserError if there is none of that name, or what it needs is not here.
    """
    if name == "local":
        from harness.executors.local import Local

        return Local()
    if name == "slurm":
        from harness.executors.slurm import Slurm

        return Slurm(settings, logs)
    if name == "dask":
        from harness.executors.dask import Dask

        return Dask(settings)
    raise UserError(f"--executor {name}: known: {', '.join(NAMES)}")
