"""Reads and appends to files of JSON Lines. A line that was written is never lost; a torn last line is ignored."""

import json
import mmap
import os
from pathlib import Path

import orjson

from harness.errors import UserError


def read(path: Path) -> list[dict]:
    """The objects in the whole lines of a file, without a torn last line; [] if there is no file. UserError, with the
    line, for a line that is not a JSON object."""
    return parsed(path.read_bytes(), path) if path.exists() else []


def parsed(content: bytes, path: Path) -> list[dict]:
    """`read` of a file with this content."""
    whole, _, _ = content.rpartition(b"\n")
    found = []
    for number, line in enumerate(whole.splitlines(), 1):
        try:
            found.append(orjson.loads(line))
            if not isinstance(found[-1], dict):
                raise ValueError
        except ValueError:
            raise UserError("a damaged line", file=path, line=number) from None
    return found


def cut_torn(path: Path) -> None:
    """Removes a torn last line, because the next line would be appended to it."""
    if not path.exists() or path.stat().st_size == 0:
        return
    with open(path, "r+b") as file:
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as text:
            whole = text.rfind(b"\n") + 1
        file.truncate(whole)


def as_json(told, indent: int | None = None) -> str:
    """JSON in ASCII, with "?" for lone surrogates, which file names may contain and no reader accepts."""
    unicode = json.dumps(told, ensure_ascii=False, allow_nan=False).encode("utf-8", errors="replace")
    return json.dumps(json.loads(unicode), indent=indent)


def append(path: Path, line: dict) -> None:
    """Appends a line; it is on the disk when this returns."""
    cut_torn(path)
    with open(path, "a", encoding="utf-8") as file:
        file.write(as_json(line) + "\n")
        file.flush()
        os.fsync(file.fileno())
