"""Locks a folder of rayrace, so that one process at a time writes it or submits its jobs."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from harness.errors import UserError
from harness.system import holder

NAME = ".lock"  # in the folder of a run. The file stays; the lock ends with the process that holds it


@contextmanager
def only_one(folder: Path) -> Iterator[None]:
    """Held while a process writes or follows the run in `folder`. UserError at once if there is no such folder, or
    another process holds it."""
    if not Path(folder).is_dir():
        raise UserError(f"{folder}: not a run: no such folder", remedy="a run is a folder that `rayrace run` wrote")
    file = Path(folder) / NAME

    def busy() -> UserError:
        found = holder.find(file)
        who = f", process {found.pid}" if found else ""
        remedy = f"wait for it to end, or look with: rayrace status {folder}"
        return UserError(f"{folder}: another rayrace is at work on this run{who}", remedy=remedy)

    with locked(file, busy):
        yield


@contextmanager
def locked(file: Path, busy: Callable[[], Exception]) -> Iterator[None]:
    """Holds the lock `file`; raises `busy()` at once if another process holds it. Its folder must exist."""
    lock = FileLock(file)
    try:
        lock.acquire(timeout=0)
    except Timeout:
        raise busy() from None
    try:
        yield
    finally:
        lock.release()
