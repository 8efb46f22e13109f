"""Reads the text files that a user names: ordinary files of a limited size, in UTF-8."""

import os
import stat
from pathlib import Path

from harness.errors import UserError

LARGEST = 1 << 28  # bytes of a scene or a list of rays; of 100 bytes a row that is 2.7 million
UTF8 = "save it as text in UTF-8"
_KINDS = {
    stat.S_ISFIFO: "a pipe",
    stat.S_ISCHR: "a device",
    stat.S_ISBLK: "a device",
}


def read(path: Path, most: int = LARGEST) -> str:
    """The text of a file without its byte order mark, lines ended by "\\n".

    most: bytes of the file. UserError for a file that is missing, larger, a folder, a pipe or a device, or not text;
    with the line and column of the first byte that is not UTF-8.
    """
    try:
        with open(path, "rb", opener=_at_once) as file:
            status = os.fstat(file.fileno())
            for is_kind, name in _KINDS.items():
                if is_kind(status.st_mode):
                    remedy = "write what comes from it to a file, and name that file"
                    raise UserError(f"expected a file, found {name}", file=path, remedy=remedy)
            content = b"" if status.st_size > most else file.read(most + 1)
    except (FileNotFoundError, ValueError):  # ValueError: a NUL in the path
        raise UserError("no such file", file=path) from None
    except IsADirectoryError:
        raise UserError("expected a file, found a folder", file=path) from None
    except OSError as error:
        raise UserError(f"cannot be read: {error.strerror}", file=path) from None
    if max(status.st_size, len(content)) > most:
        remedy = "divide it, or put its triangles into the file of a MESH" if most == LARGEST else "divide it"
        raise UserError(f"the file has more than {most >> 20} MB", file=path, remedy=remedy)
    return decoded(content, path).replace("\r\n", "\n").replace("\r", "\n")


def _at_once(path, flags: int) -> int:
    """Opens a file, without waiting for who writes to it if it is a pipe."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def decoded(content: bytes, path: Path) -> str:
    """The text of UTF-8 without its byte order mark. UserError, with line and column, for anything else."""
    for mark, name in ((b"\xff\xfe\0\0", "UTF-32"), (b"\xff\xfe", "UTF-16"), (b"\xfe\xff", "UTF-16")):
        if content.startswith(mark):
            raise UserError(f"not a text file (UTF-8): it is in {name}", file=path, line=1, remedy=UTF8)
    zero = content.find(b"\0")
    if zero >= 0:
        # Letters of English in UTF-16 have a NUL each, before or behind them.
        half = 0.3 <= content[:1000].count(0) / len(content[:1000]) <= 0.6
        what = "it seems to be in UTF-16, without a byte order mark" if half else "it has a NUL byte here"
        raise UserError(f"not a text file (UTF-8): {what}", file=path, **_place(content, zero), remedy=UTF8)
    content = content.removeprefix(b"\xef\xbb\xbf")
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        at = error.start
    byte = content[at : at + 1]
    letter = byte.decode("cp1252", "replace")
    what = f"byte 0x{byte.hex()} here"
    what += f' is no UTF-8; in Windows-1252 it is "{letter}"' if letter.isprintable() and letter != "\ufffd" else ""
    raise UserError(f"not a text file (UTF-8): {what}", file=path, **_place(content, at), remedy=UTF8)


def _place(content: bytes, at: int) -> dict[str, int]:
    """Line and column, from 1, of a byte; columns in characters."""
    before = content[:at].replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    line = before.count(b"\n") + 1
    return {"line": line, "column": len(before.rpartition(b"\n")[2].decode("utf-8", "replace")) + 1}
