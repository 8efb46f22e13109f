"""Confines the paths that a run names to its own folder: a run may come from a stranger."""

import contextlib
import os
import re
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

from harness.errors import UserError

NAME = re.compile(r"(pictures|series|logs)/[\w-][\w.,'+-]*")
FOLDERS = "", "pictures", "series", "logs", "parts", "report"  # report: an older one may be overwritten


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


def check(folder: Path) -> None:
    """UserError if the folder of a run contains a link, which may lead anywhere, or a pipe or device, which may never
    end. The folder itself may be a link."""
    for name in FOLDERS:
        with contextlib.suppress(FileNotFoundError, NotADirectoryError), os.scandir(folder / name) as entries:
            for entry in entries:
                if not (entry.is_file(follow_symlinks=False) or entry.is_dir(follow_symlinks=False)):
                    remedy = "a run has no links; replace it by the file that it leads to"
                    raise UserError(f"{entry.path}: not a plain file", remedy=remedy)
