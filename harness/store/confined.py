"""Confines the paths that a run names to its own folder: a run may come from a stranger."""

import contextlib
import os
import re
import stat
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import BinaryIO

from harness.errors import UserError
from harness.system import output

DAMAGED = "it is damaged, or not a run of rayrace"
COPY = "put a copy in its place: cp FILE COPY && mv COPY FILE"
NAME = re.compile(r"(pictures|series|logs)/[\w-][\w.,'+-]*")
FOLDERS = "", "pictures", "series", "logs", "parts", "jobs", "report"  # report: an older one may be overwritten


def files(record: dict) -> Iterator[tuple[dict, str]]:
    """Yields (table, key) for each file name in a record: table[key] is the name."""
    for table in (record, *(record.get(name) for name in ("picture", "agreement", "error", "bound"))):
        if isinstance(table, dict):
            for key in _named(tuple(table)):
                if isinstance(table[key], str):
                    yield table, key


@lru_cache(maxsize=256)  # rows of a run have the same keys
def _named(keys: tuple[str, ...]) -> tuple[str, ...]:
    """Returns the keys whose value may be the name of a file."""
    return tuple(key for key in keys if key in ("file", "series") or key.endswith("_file"))


def stray(record: dict) -> str | None:
    """The first file name in a record that no file of a run can have; None if there is none."""
    return next((table[key] for table, key in files(record) if not NAME.fullmatch(table[key])), None)


def content(path: Path, most: int) -> bytes:
    """Returns the bytes of a file. UserError if it is no plain file, or has more than `most` bytes."""
    with opened(path) as file:
        size = os.fstat(file.fileno()).st_size
        if size > most:
            raise UserError(f"{path}: {size:,} bytes, where rayrace reads {most:,} at most", remedy=DAMAGED)
        return file.read(size)


def opened(path: Path) -> BinaryIO:
    """Returns a file, open to be read. UserError if it is a pipe or a device, which may never end."""
    file = open(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb")  # noqa: SIM115
    if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        file.close()
        raise UserError(f"{path}: not a plain file")
    return file


def check_to_write(folder: Path) -> None:
    """`check` of a run that will be gone on with: UserError too if a file that is changed in place has a second name,
    as a change of it would change the other."""
    check(folder)
    with contextlib.suppress(FileNotFoundError, NotADirectoryError), os.scandir(folder) as entries:  # no run at all
        for entry in entries:
            if entry.is_file(follow_symlinks=False) and not output.has_one_name(entry.stat(follow_symlinks=False)):
                raise UserError(f"{entry.path}: the file has a second name (a hard link)", remedy=COPY)


def check_output(folder: Path) -> None:
    """UserError if a folder that files are written to has a link, a pipe or a device in it, at any depth."""
    left = [folder]
    while left:
        try:
            entries = list(os.scandir(left.pop()))
        except FileNotFoundError:
            continue
        for entry in entries:
            if entry.is_dir(follow_symlinks=False):
                left.append(Path(entry.path))
            elif not entry.is_file(follow_symlinks=False):
                raise UserError(f"{entry.path}: not a plain file", remedy="remove it; nothing is written through it")


def check(folder: Path) -> None:
    """UserError if the folder of a run contains a link that leads out of it, or a pipe or device, which may never end.
    The folder itself may be a link; submitit leaves links to files beside them."""
    for name in FOLDERS:
        with contextlib.suppress(FileNotFoundError, NotADirectoryError), os.scandir(folder / name) as entries:
            for entry in entries:
                plain = entry.is_file(follow_symlinks=False) or entry.is_dir(follow_symlinks=False)
                if not plain and not (name == "jobs" and _leads_beside(entry)):
                    remedy = "a run has no links; replace it by the file that it leads to"
                    raise UserError(f"{entry.path}: not a plain file", remedy=remedy)


def _leads_beside(entry: os.DirEntry) -> bool:
    """Whether an entry is a link to a plain file of the same folder."""
    path, target = Path(entry.path), Path(os.path.realpath(entry.path))
    return entry.is_symlink() and target.is_file() and target.parent == Path(os.path.realpath(path.parent))
