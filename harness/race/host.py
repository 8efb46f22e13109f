"""The host that repetitions run on, one at a time."""

import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Protocol

import numpy as np
from filelock import FileLock, Timeout

from harness.process import calibration, repetition, scratch
from harness.process.repetition import Result
from harness.process.session import Sessions
from harness.renderer.builder import cache_folder
from harness.renderer.limits import DEFAULT, Limits
from harness.renderer.parameters import Parameters
from harness.renderer.registry import Entry
from harness.store import alone
from harness.system import holder, trouble


class Host(Protocol):
    """Runs repetitions, and tells the time and the state of the machine. A run (race.py) knows no more of it."""

    @property
    def references(self) -> Path | None:
        """Folder of references that runs share (kept.py); None: each run makes its own."""

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


def host_lock() -> FileLock:
    """Held while measuring: two timed processes on one host disturb each other."""
    return FileLock(Path(tempfile.gettempdir()) / "rayrace-measuring.lock")


def _who(lock: Path) -> str:
    """The process that holds the lock of measuring, and the folder of its run, or its command if it has none."""
    found = holder.find(lock)
    if found is None:
        return "process unavailable (the system does not tell)"
    folders = [file.parent for file in found.files if file.name == alone.NAME]
    return f"process {found.pid}, {folders[0] if folders else holder.command(found.pid)}"


class ThisHost:
    """The Host that this process is on."""

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
        lock = host_lock()
        try:
            lock.acquire(timeout=0)
        except Timeout:
            who = _who(Path(lock.lock_file))
            print(f"another rayrace is measuring on this machine, {who}; waiting for it to end", file=sys.stderr)
            lock.acquire()
        try:
            scratch.remove_left()
            yield
        finally:
            lock.release()
