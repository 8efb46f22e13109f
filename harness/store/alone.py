"""Locks a folder of rayrace, so that one process at a time writes it or submits its jobs."""

import contextlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from harness.errors import UserError, of_system
from harness.system import holder, lock

REMEDY = "put it on a local disk, or have the file system mounted with locks (of Lustre: -o flock)"
NAME = ".lock"  # in the folder of a run. The file stays; the lock ends with the process that holds it


@contextmanager
def only_one(folder: Path) -> Iterator[None]:
    """Held while a process writes or follows the run in `folder`. UserError at once if there is no such folder, or
    another process holds it."""
    if not Path(folder).is_dir():
        raise UserError(f"{folder}: not a run: no such folder", remedy="a run is a folder that `rayrace run` wrote")
    file = Path(folder) / NAME

    def busy() -> UserError:
        pid = holder.find(file)
        who = f", process {pid}" if pid else ""
        remedy = f"wait for it to end, or look with: rayrace status {folder}"
        return UserError(f"{folder}: another rayrace is at work on this run{who}", remedy=remedy)

    with locked(file, busy):
        yield


@contextmanager
def locked(file: Path, busy: Callable[[], Exception]) -> Iterator[None]:
    """Holds the lock `file`; raises `busy()` at once if another process holds it. Its folder must exist. UserError if
    its file system has no locks."""
    with contextlib.ExitStack() as stack:
        try:
            stack.enter_context(lock.of_file(file))
        except lock.Busy:
            raise busy() from None
        except lock.NoLocks as error:
            raise UserError(of_system(error), remedy=REMEDY) from None
        yield
