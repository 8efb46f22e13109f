"""Marks the folders that rayrace makes, and later proves that a folder is one of them. Others are never removed."""

import contextlib
import json
import os
import platform
import stat
import time
from collections.abc import Iterator
from pathlib import Path

from harness.system.finding import read

try:
    import fcntl
except ImportError:  # Windows, where there is no proof
    fcntl = None

MARKER = ".rayrace.json"
SIZE = 4096  # bytes of a marker, at most


class Doubt(Exception):
    """There is no proof that a folder is rayrace's, or that its process has ended; the text says why."""


class Alive(Exception):
    """The process that made a folder still runs."""


@contextlib.contextmanager
def marked(folder: Path, name: str = "") -> Iterator[None]:
    """Marks a folder that this process has just made, and locks the mark until the block or the process ends.

    name: the folder's later name, if it will be renamed.
    """
    mark = {"purpose": "a folder that rayrace made and may remove", "folder": _identity(folder.lstat()), **_process()}
    mark |= {"name": name or folder.name, "time": time.strftime("%Y-%m-%dT%H:%M:%S%z")}
    with contextlib.ExitStack() as stack:
        opened = [os.open(folder / MARKER, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)]
        stack.callback(os.close, opened[0])
        if fcntl:
            opened.append(os.open(folder, os.O_RDONLY))  # version 0.1 removes unlocked folders
            stack.callback(os.close, opened[1])
            with contextlib.suppress(OSError):  # a file system without locks
                for descriptor in opened:
                    fcntl.flock(descriptor, fcntl.LOCK_EX)
        os.write(opened[0], json.dumps(mark).encode() + b"\n")
        yield


def make(folder: Path) -> None:
    """Makes a marked folder, with its parents, unless it exists."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    with contextlib.suppress(FileExistsError):
        folder.mkdir()
        with marked(folder):
            pass


def is_ours(folder: Path) -> bool:
    """Whether rayrace made this folder; the process that made it may still run."""
    try:
        with proved(folder, ended=False):
            return True
    except (Doubt, Alive):
        return False


@contextlib.contextmanager
def proved(folder: Path, name: str = "", ended: bool = True) -> Iterator[None]:
    """Runs the block only if this user made `folder` in a process of this host that has ended.

    The mark is locked meanwhile, so two processes never handle one folder. Raises Doubt if there is no proof, Alive if
    the process runs. name: the one in the mark, if the folder was to be renamed. ended: False for a folder that
    outlives the process that made it.
    """
    if fcntl is None:
        raise Doubt("this system has no locks")
    try:
        there = folder.lstat()
        if not stat.S_ISDIR(there.st_mode) or there.st_uid != os.getuid():
            raise Doubt("it is not a folder of this user")
        descriptor = os.open(folder / MARKER, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    except FileNotFoundError:
        raise Doubt(f"it has no {MARKER}") from None
    except OSError as error:
        raise Doubt(f"{MARKER} in it cannot be opened: {error.strerror}") from None
    try:
        mark = _mark(name or folder.name, there, descriptor)
        if ended:
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                raise Alive from None
            if not _has_ended(mark):
                raise Alive
        yield
    finally:
        os.close(descriptor)


def _mark(name: str, there: os.stat_result, descriptor: int) -> dict:
    """The content of the open mark of a folder. Doubt if it is of another folder, or damaged."""
    mark = os.fstat(descriptor)
    if not stat.S_ISREG(mark.st_mode) or mark.st_uid != there.st_uid or mark.st_nlink != 1:
        raise Doubt(f"{MARKER} in it is not a file that rayrace writes")
    try:
        content = json.loads(os.read(descriptor, SIZE))
    except (OSError, ValueError):
        raise Doubt(f"{MARKER} in it is damaged") from None
    if not isinstance(content, dict) or (content.get("name"), content.get("folder")) != (name, _identity(there)):
        raise Doubt(f"{MARKER} in it is of another folder")
    return content


def _identity(folder: os.stat_result) -> list[int]:
    """Device and inode; a copy of the folder has others."""
    return [folder.st_dev, folder.st_ino]


def _process() -> dict:
    """This process: host, boot, PID namespace, PID, start. A value is None if the system has none."""
    return {
        "host": platform.node(),
        "boot": read(Path("/proc/sys/kernel/random/boot_id")),
        "processes": _link("/proc/self/ns/pid"),
        "pid": os.getpid(),
        "started": _started("self"),
    }


def _has_ended(mark: dict) -> bool:
    """Whether the process of a mark has ended. Doubt if that cannot be known here."""
    now = _process()
    if mark.get("host") != now["host"] or None in (mark.get("boot"), now["boot"]):
        raise Doubt("it is from another host, or the system has no boot ID")
    if mark["boot"] != now["boot"]:
        return True
    if mark.get("processes") != now["processes"] or not isinstance(mark.get("pid"), int):
        raise Doubt("it is from another container")
    return _started(str(mark["pid"])) != mark.get("started")


def _started(process: str) -> int | None:
    """When a process started, in ticks since the boot; None if there is no such process."""
    text = read(Path(f"/proc/{process}/stat"))
    return int(text.rpartition(")")[2].split()[19]) if text else None  # its name, in (), may contain anything


def _link(path: str) -> str | None:
    try:
        return os.readlink(path)
    except OSError:
        return None
