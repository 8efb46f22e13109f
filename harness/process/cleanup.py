"""What a process that was killed has left of its temporary folders (scratch.py): the next run takes it away."""

import contextlib
import errno
import os
import shutil
import stat
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows, where they stay
    fcntl = None

LEAST = 1 << 20  # bytes of the disk, less than what a repetition writes
YOUNG = 60.0  # s in which an empty folder may be of a process that is about to hold it


@contextlib.contextmanager
def hold(folder: Path) -> Iterator[None]:
    """Hold a temporary folder: its lock ends with this process, however that ends."""
    with _open(folder) as descriptor:
        with contextlib.suppress(OSError):  # a file system without locks
            fcntl and fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield


def _is_held(folder: Path) -> bool:
    with _open(folder) as descriptor:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:  # held, or nobody can tell
            return True
    return False


@contextlib.contextmanager
def _open(folder: Path) -> Iterator[int | None]:
    descriptor = os.open(folder, os.O_RDONLY | os.O_NOFOLLOW) if fcntl else None
    try:
        yield descriptor
    finally:
        if fcntl:
            os.close(descriptor)


def found() -> list[Path]:
    """Temporary folders of this user's processes that are no more."""
    dead = []
    for place in Path(tempfile.gettempdir()).glob("rayrace-*"):
        with contextlib.suppress(OSError):
            told = place.lstat()
            if stat.S_ISDIR(told.st_mode) and told.st_uid == getattr(os, "getuid", lambda: 0)():
                old = any(place.iterdir()) or abs(time.time() - told.st_mtime) > YOUNG
                if fcntl and old and not _is_held(place):
                    dead.append(place)
    return dead


def remove() -> None:
    for place in found():
        shutil.rmtree(place, ignore_errors=True)


def must_have_room(folder: Path, size: int) -> None:
    """OSError if the disk of a folder is full, or will be with `size` bytes more."""
    if shutil.disk_usage(folder).free < LEAST + size:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(folder))
