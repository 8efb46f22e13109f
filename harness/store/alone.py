"""Locks a run: one process at a time may write its rows or submit its jobs."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from harness.errors import UserError
from harness.system import holder

NAME = ".lock"  # in the folder of a run. It stays there, and is held by nobody who is dead


@contextmanager
def only_one(folder: Path) -> Iterator[None]:
    """Held by who writes or follows the run in a folder, which is there. UserError, at once, if another does."""
    if not Path(folder).is_dir():
        raise UserError(f"{folder}: not a run: no such folder", remedy="a run is a folder that `rayrace run` wrote")
    lock = FileLock(Path(folder) / NAME)
    try:
        lock.acquire(timeout=0)
    except Timeout:
        found = holder.find(Path(folder) / NAME)
        who = f", process {found.pid}" if found else ""
        remedy = f"let it end, or look with: rayrace status {folder}"
        raise UserError(f"{folder}: another rayrace is at work on this run{who}", remedy=remedy) from None
    try:
        yield
    finally:
        lock.release()
