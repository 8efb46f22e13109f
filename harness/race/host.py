"""The host that repetitions run on, one at a time."""

import pwd
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Protocol

import numpy as np

from harness.errors import printable
from harness.process import calibration, repetition, scratch
from harness.process.repetition import Result
from harness.process.session import Sessions
from harness.renderer.builder import cache_folder
from harness.renderer.limits import DEFAULT, Limits
from harness.renderer.parameters import Parameters
from harness.renderer.registry import Entry
from harness.store import alone
from harness.system import holder, machine_lock, trouble


class Host(Protocol):
    """Runs repetitions, and tells the time and the state of the machine. A run (race.py) knows no more of it."""

    @property
    def references(self) -> Path | None:
        """Folder of references that runs share (harness/judge/cache.py); None: each run makes its own."""

    def exclusive(self) -> AbstractContextManager:
        """Held during a run: nothing else is measured there meanwhile."""

    def clock(self) -> float:
        """Seconds on a clock that never steps; its epoch means nothing."""

    def look(self) -> dict:
        """The machine's counters now, as trouble.look has them."""

    def peaks(self, threads: int) -> dict:
        """Measures the machine's peaks just now, as calibration.peaks does."""

    def run(
        self,
        entry: Entry,
        arrays: dict[str, np.ndarray],
        parameters: Parameters,
        needs: tuple[str, ...],
        timeout: float = 600.0,
        series: Path | None = None,
        interval: float = 0.05,
        cache: Path | None = None,
        log: Path | None = None,
        limits: Limits = DEFAULT,
    ) -> Result:
        """One repetition, as repetition.run says."""

    def untimed(self) -> AbstractContextManager:
        """A context whose `run` and `close` are those of Sessions: for jobs whose times do not count."""


@contextmanager
def host_lock(say: Callable[[str], object]) -> Iterator[None]:
    """Held while measuring: two timed processes on one host disturb each other. say: hears for whom it waits."""

    def wait(other: machine_lock.Holder) -> None:
        say(f"another rayrace is measuring on this machine, {_who(other)}; waiting for it to end")

    with machine_lock.locked(wait):
        yield


def _who(other: machine_lock.Holder) -> str:
    """The process that measures, its user, and the folder of its run, or its command if it is another user's."""
    user = f" of {_name(other.user)}" if other.user is not None else ""
    if other.pid is None:
        return f"a process{user} whose number the system does not tell"
    folders = [file.parent for file in holder.opened(other.pid) if file.name == alone.NAME]
    what = folders[0] if folders else holder.command(other.pid)
    return printable(f"process {other.pid}{user}, {what}")


def _name(user: int) -> str:
    try:
        return pwd.getpwuid(user).pw_name
    except KeyError:
        return f"user {user}"


class ThisHost:
    """The Host that this process is on. say: hears for whom it waits before it measures."""

    def __init__(self, say: Callable[[str], object] = lambda _: None):
        self.say = say

    clock = staticmethod(time.monotonic)
    look = staticmethod(trouble.look)
    peaks = staticmethod(calibration.peaks)
    run = staticmethod(repetition.run)
    untimed = staticmethod(Sessions)

    @property
    def references(self) -> Path:
        return cache_folder("references")

    @contextmanager
    def exclusive(self) -> Iterator[None]:
        with host_lock(self.say):
            scratch.remove_left()
            yield
