"""This machine, one repetition at a time."""

import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from harness import calibration, repetition, trouble
from harness.builder import cache_folder


def host_lock() -> FileLock:
    """Held while measuring: two timed processes on one host disturb each other."""
    return FileLock(Path(tempfile.gettempdir()) / "rayrace-measuring.lock")


class Local:
    """An Executor (harness/executors)."""

    clock = staticmethod(time.monotonic)
    look = staticmethod(trouble.look)
    peaks = staticmethod(calibration.peaks)
    run = staticmethod(repetition.run)

    @property
    def references(self) -> Path:
        return cache_folder("references")

    @contextmanager
    def exclusive(self) -> Iterator[None]:
        lock = host_lock()
        try:
            lock.acquire(timeout=0)
        except Timeout:
            print("another rayrace is measuring on this machine; waiting for it to end", file=sys.stderr)
            lock.acquire()
        try:
            yield
        finally:
            lock.release()
