"""Locks a file for one process at a time. The lock ends with the process; the file stays, and means nothing itself."""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class Busy(Exception):
    """Another process holds the lock."""


class NoLocks(OSError):
    """The file system of the lock's file has no locks, as NFS without its lock service and Lustre without -o flock."""


@contextmanager
def of_file(file: Path, wait: bool = False) -> Iterator[None]:
    """Holds the lock of a file (flock(2)), which is made if it is missing; its folder must exist.

    wait: until it is free; else Busy at once. NoLocks if the file system has none; another OSError if the file cannot
    be opened, or is a link.
    """
    descriptor = _locked(Path(file), wait)
    try:
        yield
    finally:
        os.close(descriptor)


def _locked(file: Path, wait: bool) -> int:
    while True:
        descriptor = os.open(file, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o644)
        try:
            take(descriptor, file, wait)
            if os.fstat(descriptor).st_nlink:
                return descriptor
        except BaseException:
            os.close(descriptor)
            raise
        os.close(descriptor)  # who held it has removed the file: others would lock a new one


def take(descriptor: int, file: Path, wait: bool) -> None:
    """Locks an open file, until it is closed. Busy and NoLocks as of `of_file`."""
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except BlockingIOError:
        raise Busy from None
    except OSError as error:
        raise NoLocks(error.errno, f"its file system has no locks ({error.strerror})", str(file)) from None
