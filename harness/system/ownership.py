"""Marks the folders that rayrace makes, and proves later that a folder is one of them: what cannot be proved stays."""

import contextlib
import json
import os
import platform
import stat
import time
from collections.abc import Iterator
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows, where nothing can be proved
    fcntl = None

MARKER = ".rayrace.json"
SIZE = 4096  # bytes that a marker has at most


class Doubt(Exception):
    """Why a folder cannot be proved to be rayrace's, or its process to have ended."""


class Alive(Exception):
    """The process that made a folder still runs."""


@contextlib.contextmanager
def held(folder: Path, name: str = "") -> Iterator[None]:
    """Mark a folder that this process has just made, and lock the mark until the end of the block or of the process.

    name: what the folder will be called, if it is going to be renamed.
    """
    told = {"purpose": "a folder that rayrace made and may remove", "folder": _identity(folder.lstat()), **_process()}
    told |= {"name": name or folder.name, "time": time.strftime("%Y-%m-%dT%H:%M:%S%z")}
    with contextlib.ExitStack() as stack:
        opened = [os.open(folder / MARKER, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)]
        stack.callback(os.close, opened[0])
        if fcntl:
            opened.append(os.open(folder, os.O_RDONLY))  # version 0.1 removes folders that nobody has locked
            stack.callback(os.close, opened[1])
            with contextlib.suppress(OSError):  # a file system without locks
                for descriptor in opened:
                    fcntl.flock(descriptor, fcntl.LOCK_EX)
        os.write(opened[0], json.dumps(told).encode() + b"\n")
        yield


def make(folder: Path) -> None:
    """Make a marked folder, with its parents, unless it is there."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    with contextlib.suppress(FileExistsError):
        folder.mkdir()
        with held(folder):
            pass


def is_ours(folder: Path) -> bool:
    """Did rayrace make this folder, whether or not the process that made it has ended?"""
    try:
        with proved(folder, ended=False):
            return True
    except (Doubt, Alive):
        return False


@contextlib.contextmanager
def proved(folder: Path, name: str = "", ended: bool = True) -> Iterator[None]:
    """The block runs only if this process's user made `folder` in a process of this host that has ended.

    The mark is locked meanwhile, so that no two processes are about one folder. Raises Doubt with the reason if that is
    not certain, Alive if the process runs. name: in the mark, if the folder was to be renamed. ended: False for a
    folder that outlives the process that made it.
    """
    if fcntl is None:
        raise Doubt("this system has no locks")
    try:
        there = folder.lstat()
        if not stat.S_ISDIR(there.st_mode) or there.st_uid != os.getuid():
            raise Doubt("it is no folder of this user")
        descriptor = os.open(folder / MARKER, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    except FileNotFoundError:
        raise Doubt(f"it has no {MARKER}") from None
    except OSError as error:
        raise Doubt(f"{MARKER} in it cannot be opened: {error.strerror}") from None
    try:
        told = _mark(name or folder.name, there, descriptor)
        if ended:
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                raise Alive from None
            if not _has_ended(told):
                raise Alive
        yield
    finally:
        os.close(descriptor)


def _mark(name: str, there: os.stat_result, descriptor: int) -> dict:
    """Returns the content of the open mark of a folder; Doubt if it is not of this folder."""
    mark = os.fstat(descriptor)
    if not stat.S_ISREG(mark.st_mode) or mark.st_uid != there.st_uid or mark.st_nlink != 1:
        raise Doubt(f"{MARKER} in it is no file that rayrace writes")
    try:
        told = json.loads(os.read(descriptor, SIZE))
    except (OSError, ValueError):
        raise Doubt(f"{MARKER} in it is damaged") from None
    if not isinstance(told, dict) or (told.get("name"), told.get("folder")) != (name, _identity(there)):
        raise Doubt(f"{MARKER} in it is of another folder")
    return told


def _identity(folder: os.stat_result) -> list[int]:
    """A copy of a folder has another."""
    return [folder.st_dev, folder.st_ino]


def _process() -> dict:
    """This process: host, boot, name space of processes, number, start. Values are None where the system has none."""
    return {
        "host": platform.node(),
        "boot": _read("/proc/sys/kernel/random/boot_id"),
        "processes": _link("/proc/self/ns/pid"),
        "pid": os.getpid(),
        "started": _started("self"),
    }


def _has_ended(told: dict) -> bool:
    """Has the process of a mark ended? Doubt if that cannot be known here."""
    now = _process()
    if told.get("host") != now["host"] or None in (told.get("boot"), now["boot"]):
        raise Doubt("it is of another host, or the system does not tell")
    if told["boot"] != now["boot"]:
        return True
    if told.get("processes") != now["processes"] or not isinstance(told.get("pid"), int):
        raise Doubt("it is of another container")
    return _started(str(told["pid"])) != told.get("started")


def _started(process: str) -> int | None:
    """When a process started, in ticks since the boot; None if it is not there. Its name may hold anything."""
    text = _read(f"/proc/{process}/stat")
    return int(text.rpartition(")")[2].split()[19]) if text else None


def _read(path: str) -> str | None:
    try:
        return Path(path).read_text(encoding="ascii", errors="replace").strip()
    except OSError:
        return None


def _link(path: str) -> str | None:
    try:
        return os.readlink(path)
    except OSError:
        return None
