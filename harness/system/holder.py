"""Finds the process that holds a lock on a file, in the kernel's table of locks."""

import os
import shlex
from pathlib import Path
from typing import NamedTuple

from harness.errors import printable

SHOWN = 200  # characters of a command


class Holder(NamedTuple):
    """`files` are those that the process has open; none if they are another user's."""

    pid: int
    files: tuple[Path, ...]


def find(lock: Path) -> Holder | None:
    """Returns who holds a lock on a file; None if nobody does, or the system does not tell.

    It tells on Linux, of processes that this one can see: not of those in another container.
    """
    try:
        wanted = lock.stat()
        table = Path("/proc/locks").read_text(encoding="ascii")
    except OSError:
        return None
    for line in table.splitlines():  # 1: FLOCK ADVISORY WRITE 29526 fe:00:2175716 0 EOF
        words = line.split()
        if len(words) != 8 or words[4] == "0":  # waits for the lock ("->"); is in another container
            continue
        major, minor, inode = words[5].split(":")
        if int(inode) != wanted.st_ino:
            continue
        try:
            links = [entry.path for entry in os.scandir(f"/proc/{words[4]}/fd")]
        except PermissionError:
            if os.makedev(int(major, 16), int(minor, 16)) == wanted.st_dev:
                return Holder(int(words[4]), ())
            continue
        except OSError:  # it has ended
            continue
        if any(_is(link, wanted) for link in links):  # the device of the table is not that of `stat` everywhere (btrfs)
            return Holder(int(words[4]), tuple(Path(name) for link in links if (name := _name(link))))
    return None


def command(pid: int) -> str:
    """Returns the command of a process, from the word `rayrace` on; "command unavailable" if the system does not tell.

    Of a long one the first words.
    """
    try:
        words = Path(f"/proc/{pid}/cmdline").read_bytes().decode(errors="replace").split("\0")[:-1]
    except OSError:
        words = []
    names = [Path(word).name for word in words]
    if "rayrace" in names:
        words = ["rayrace", *words[names.index("rayrace") + 1 :]]
    shown = printable(shlex.join(words))
    return (shown if len(shown) <= SHOWN else f"{shown[:SHOWN]} ..") or "command unavailable"


def _is(link: str, wanted: os.stat_result) -> bool:
    try:
        return os.path.samestat(os.stat(link), wanted)
    except OSError:
        return False


def _name(link: str) -> str:
    try:
        return os.readlink(link)
    except OSError:
        return ""
