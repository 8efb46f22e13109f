"""A folder for what a renderer is given and writes, which goes when it has ended, whatever it made of it."""

import contextlib
import itertools
import os
import secrets
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from harness.process import cleanup


@contextlib.contextmanager
def scratch(prefix: str = "rayrace-") -> Iterator[Path]:
    """A new temporary folder, which goes also where a signal comes as it is made or removed."""
    folder = Path(tempfile.gettempdir(), prefix + secrets.token_hex(8))  # known before it is there
    try:
        folder.mkdir(mode=0o700)
        with cleanup.hold(folder):
            yield folder
    finally:
        try:
            remove(folder)
        except BaseException:  # after a signal others are not heard for a while (stopping.py)
            remove(folder)
            raise


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
    """Remove what is in a folder, after its folders' folders have been moved up to it: no path gets long."""
    names = (os.path.join(path, f"rayrace-{number}") for number in itertools.count())
    os.chmod(path, 0o700)
    while folders := _unlink(path):
        for folder in folders:
            for below in _unlink(folder):
                os.rename(below, next(name for name in names if not os.path.lexists(name)))
            os.rmdir(folder)


def _unlink(path: str | Path) -> list[str]:
    """Remove the files in a folder; the folders in it, which are open to all that may be done now."""
    folders = []
    with os.scandir(path) as entries:
        for entry in list(entries):
            if entry.is_dir(follow_symlinks=False):
                os.chmod(entry.path, 0o700)
                folders.append(entry.path)
            else:
                os.unlink(entry.path)
    return folders
