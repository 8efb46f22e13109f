"""Reads and appends to files of JSON Lines. A line that was written is never lost; a torn last line is ignored."""

import json
import mmap
import os
from collections.abc import Iterator
from itertools import count
from pathlib import Path

from harness.errors import UserError
from harness.store import clean, confined
from harness.system import output

MOST, LONGEST = 150_000, 1 << 24  # lines of a file, bytes of a line
# Bytes of memory that the lines of a file may take (clean.py): all, some, and each more; a row of today takes 20 kB.
HEAVIEST, HEAVY, OF_EACH = 1500 << 20, 64 << 20, 1 << 18
APPENDING = os.O_WRONLY | os.O_APPEND | os.O_CREAT


def read(path: Path) -> list[dict]:
    """The objects in the whole lines of a file, without a torn last line; [] if there is no file. UserError, with the
    line, for a line that is not a JSON object, and if there are more than a run can have."""
    return list(parsed(path)) if path.exists() else []


def parsed(path: Path) -> Iterator[dict]:
    """Yields the objects of `read` one by one, so that the first bad one is found before the others are read."""
    weight = 0
    with confined.opened(path) as file:
        for number in count(1):
            line = file.readline(LONGEST)
            if not line.endswith(b"\n"):
                if len(line) == LONGEST:
                    raise UserError(f"a line of more than {LONGEST:,} bytes", file=path, line=number)
                return
            weight += clean.weight(line)
            most = min(HEAVIEST, HEAVY + OF_EACH * number)
            if number > MOST or weight > most:
                what = f"{MOST:,} lines" if number > MOST else f"{most >> 20:,} MiB of values"
                raise UserError(f"more than {what}, which rayrace reads at most", file=path, line=number)
            try:
                value = clean.parsed(line)
                if not isinstance(value, dict):
                    raise ValueError
            except ValueError:
                raise UserError("a damaged line", file=path, line=number) from None
            yield value


def cut_torn(path: Path) -> None:
    """Removes a torn last line, because the next line would be appended to it."""
    if not path.exists() or path.stat().st_size == 0:
        return
    with open(output.opened_in_place(path, os.O_RDWR), "r+b") as file:
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as text:
            whole = text.rfind(b"\n") + 1
        file.truncate(whole)


def as_json(value, indent: int | None = None) -> str:
    """JSON in ASCII, with "?" for lone surrogates, which file names may contain and no reader accepts."""
    unicode = json.dumps(value, ensure_ascii=False, allow_nan=False).encode("utf-8", errors="replace")
    return json.dumps(json.loads(unicode), indent=indent)


def append(path: Path, line: dict) -> None:
    """Appends a line; it is on the disk when this returns."""
    cut_torn(path)
    with open(output.opened_in_place(path, APPENDING), "a", encoding="utf-8") as file:
        file.write(as_json(line) + "\n")
        file.flush()
        os.fsync(file.fileno())
