"""Append-only files of JSON Lines: a line that was written stays, whatever happens later."""

import json
import mmap
import os
from pathlib import Path

import orjson

from harness.errors import UserError


def read(path: Path) -> list[dict]:
    """The whole lines of a file, the last one if it was not cut off; none if there is no file. UserError for a damaged
    one."""
    if not path.exists():
        return []
    whole, _, _ = path.read_bytes().rpartition(b"\n")
    return [_line(line, path, number) for number, line in enumerate(whole.splitlines(), 1)]


def _line(line: bytes, path: Path, number: int) -> dict:
    try:
        return orjson.loads(line)
    except ValueError:
        raise UserError("a damaged line", file=path, line=number) from None


def cut_torn(path: Path) -> None:
    """Take away a last line that was cut off, which nobody believes: the next would be written behind it."""
    if not path.exists() or path.stat().st_size == 0:
        return
    with open(path, "r+b") as file:
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as text:
            whole = text.rfind(b"\n") + 1
        file.truncate(whole)


def as_json(told, indent: int | None = None) -> str:
    """JSON in ASCII, with "?" for what is no Unicode, as names of files may hold: nobody could read it back."""
    unicode = json.dumps(told, ensure_ascii=False, allow_nan=False).encode("utf-8", errors="replace")
    return json.dumps(json.loads(unicode), indent=indent)


def append(path: Path, line: dict) -> None:
    """Write a line at the end, on the disk when this returns."""
    cut_torn(path)
    with open(path, "a", encoding="utf-8") as file:
        file.write(as_json(line) + "\n")
        file.flush()
        os.fsync(file.fileno())
