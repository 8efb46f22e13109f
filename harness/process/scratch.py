"""Temporary folders: each is marked as rayrace's own, and removed at the end with all that a renderer put into it."""

import contextlib
import errno
import itertools
import os
import re
import secrets
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from harness.system import ownership

NAME = re.compile(r"rayrace-[0-9a-f]{32}")
OLD = re.compile(r"rayrace-((caches|check)-)?[0-9a-f]{16}")  # of version 0.1, which had no marks
FILES = "files"  # in such a folder, beside its mark
LEAST = 1 << 20  # bytes of the disk, less than what a repetition writes


@contextlib.contextmanager
def scratch() -> Iterator[Path]:
    """A new temporary folder, which is removed also if a signal comes while it is made or removed."""
    around = Path(tempfile.gettempdir(), f"rayrace-{secrets.token_hex(16)}")  # known before it is there
    made = True
    try:
        try:
            around.mkdir(mode=0o700)
        except FileExistsError:
            made = False
            raise
        with ownership.marked(around):
            (around / FILES).mkdir()
            yield around / FILES
    finally:
        if made:
            try:
                _remove_whole(around)
            except BaseException:  # after a signal others are not heard for a while (stopping.py)
                _remove_whole(around)
                raise


def remove_left() -> None:
    """Remove the temporary folders that processes of this user left when they were killed."""
    for place in _named(NAME):
        with contextlib.suppress(OSError, ownership.Doubt, ownership.Alive), ownership.proved(place):
            if {path.name for path in place.iterdir()} <= {ownership.MARKER, FILES}:
                _remove_whole(place)


def doubtful() -> dict[Path, str]:
    """Folders that are called like temporary ones of rayrace, and why they cannot be proved to be: they stay."""
    doubts = {}
    for place in [*_named(NAME), *_named(OLD)]:
        try:
            with ownership.proved(place):
                if {path.name for path in place.iterdir()} - {ownership.MARKER, FILES}:
                    doubts[place] = "it holds files that rayrace did not make"
        except ownership.Doubt as doubt:
            doubts[place] = str(doubt)
        except (ownership.Alive, OSError):  # at work, or gone meanwhile
            pass
    return doubts


def _named(pattern: re.Pattern) -> list[Path]:
    try:
        places = sorted(Path(tempfile.gettempdir()).iterdir())
    except OSError:
        return []
    return [place for place in places if pattern.fullmatch(place.name)]


def _remove_whole(around: Path) -> None:
    """Remove a temporary folder, its mark last: after a kill in between, the rest can still be proved to be ours."""
    remove(around / FILES)
    remove(around)


def must_have_room(folder: Path, size: int) -> None:
    """OSError if the disk of a folder is full, or will be with `size` bytes more."""
    if shutil.disk_usage(folder).free < LEAST + size:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(folder))


def remove(path: str | Path) -> None:
    """Remove a file or folder and what is below it, whatever the permissions and however deep; no link is followed.

    What cannot be removed stays.
    """
    with contextlib.suppress(OSError, RecursionError):
        shutil.rmtree(path)
    with contextlib.suppress(OSError):
        if os.path.islink(path) or os.path.isfile(path):
            os.unlink(path)
        elif os.path.isdir(path):
            _flatten(path)
            os.rmdir(path)


def _flatten(path: str | Path) -> None:
    """Empty a folder: moves the folders below its folders up to it first, so that no path gets too long."""
    names = (os.path.join(path, f"rayrace-{number}") for number in itertools.count())
    os.chmod(path, 0o700)
    while folders := _unlink(path):
        for folder in folders:
            for below in _unlink(folder):
                os.rename(below, next(name for name in names if not os.path.lexists(name)))
            os.rmdir(folder)


def _unlink(path: str | Path) -> list[str]:
    """Remove the files in a folder; returns the folders in it, made accessible."""
    folders = []
    with os.scandir(path) as entries:
        for entry in list(entries):
            if entry.is_dir(follow_symlinks=False):
                os.chmod(entry.path, 0o700)
                folders.append(entry.path)
            else:
                os.unlink(entry.path)
    return folders
