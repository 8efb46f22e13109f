"""Confines the paths that a run names to its own folder: a run may come from a stranger."""

import contextlib
import os
import re
from collections.abc import Iterator
from pathlib import Path

from harness.errors import UserError

NAME = re.compile(r"(pictures|series|logs)/[\w-][\w.,'+-]*")
LOOKED_INTO = "", "pictures", "series", "logs", "parts", "report"  # a report is written where an older one may be


def files(record: dict) -> Iterator[tuple[dict, str]]:
    """(table, key) of each name of a file in a record."""
    for table in (record, *(record.get(name) for name in ("picture", "accuracy", "error", "bound"))):
        if isinstance(table, dict):
            for key in ("file", "series", *(key for key in table if key.endswith("_file"))):
                if isinstance(table.get(key), str):
                    yield table, key


def stray(record: dict) -> str | None:
    """The first name in a record that is of no file of a run; None if all are."""
    return next((table[key] for table, key in files(record) if not NAME.fullmatch(table[key])), None)


def check(folder: Path) -> None:
    """UserError if the folder of a run holds a link, which may lead anywhere, or a pipe or device, whose end may never
    come. The folder itself may be a link."""
    for name in LOOKED_INTO:
        with contextlib.suppress(FileNotFoundError, NotADirectoryError), os.scandir(folder / name) as entries:
            for entry in entries:
                if not (entry.is_file(follow_symlinks=False) or entry.is_dir(follow_symlinks=False)):
                    raise UserError(
                        f"{entry.path}: no plain file", remedy="a run has no links; replace it by what it leads to"
                    )
