"""Writes the files of rayrace: each is a new file, in a folder that was opened without following a link, then renamed.

What stands at the place of a file may lead anywhere, also to the user's other files: a link, a second name of a file (a
hard link), a pipe, a device. None of them is written through.
"""

import errno
import os
import secrets
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from harness.errors import UserError

NO_LINK = os.O_NOFOLLOW | os.O_CLOEXEC
REMEDY = "remove it, or give another name"


def write(
    path: Path, fill: Callable[[BinaryIO], object], own: bool = True, shared: bool = False, sync: bool = True
) -> None:
    """Calls `fill(file)` to write the file at `path`, which then exists whole or not at all.

    own: True in a folder of rayrace, which may be no link, and in which PATH.part can only be left by a killed process.
    In another folder, which the user named, or if `shared` with other processes, the part gets a name that no file has.
    sync: the file is on the disk when this returns. UserError if anything but a plain file is at `path`.
    """
    path = Path(path)
    part = f"{path.name}.part" if own and not shared else f"{path.name}.{secrets.token_hex(8)}.part"
    try:
        with _opened(path.parent, own) as folder:
            _must_be_plain(folder, path)
            if own and not shared:
                with suppress(FileNotFoundError):
                    os.unlink(part, dir_fd=folder)
            new = os.O_WRONLY | os.O_CREAT | os.O_EXCL | NO_LINK

            def opener(*_) -> int:
                return os.open(part, new, 0o666, dir_fd=folder)

            file = open(path, "wb", opener=opener)  # noqa: SIM115  it has the name that libraries ask for
            try:
                with file:
                    fill(file)
                    file.flush()
                    if sync:
                        os.fsync(file.fileno())
                os.rename(part, path.name, src_dir_fd=folder, dst_dir_fd=folder)
            except BaseException:
                with suppress(FileNotFoundError):
                    os.unlink(part, dir_fd=folder)  # a full disk needs the room
                raise
    except OSError as error:
        error.strerror = error.strerror or str(error)  # an error of a library may have a text alone
        error.filename = str(path)
        raise


def data(path: Path, content: bytes, own: bool = True, shared: bool = False, sync: bool = False) -> None:
    """Writes a file of bytes, as `write` does."""
    write(path, lambda file: file.write(content), own, shared, sync)


def text(path: Path, content: str, own: bool = True, sync: bool = False) -> None:
    """Writes a text file in UTF-8, as `write` does."""
    data(path, content.encode("utf-8"), own, sync=sync)


def opened_in_place(path: Path, flags: int) -> int:
    """Returns a descriptor of the file at `path` in a folder of rayrace, to be changed in place, as lines are appended.

    UserError if it is no plain file, or has a second name, under which it would change too.
    """
    path = Path(path)
    try:
        with _opened(path.parent, own=True) as folder:
            _must_be_plain(folder, path)
            descriptor = os.open(path.name, flags | NO_LINK | os.O_NONBLOCK, 0o666, dir_fd=folder)
    except OSError as error:
        error.filename = str(path)
        raise
    if not has_one_name(os.fstat(descriptor)):
        os.close(descriptor)
        raise UserError(f"{path}: the file has a second name (a hard link)", remedy="put a copy in its place")
    return descriptor


def make_folder(path: Path) -> None:
    """Makes a folder of rayrace, with those above it, unless it exists. UserError if a link or a file is there."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        path.mkdir()
    except FileExistsError:
        if not stat.S_ISDIR(path.lstat().st_mode):
            raise UserError(f"{path}: not a folder, or a link to one", remedy=REMEDY) from None


def clear(path: Path) -> None:
    """Removes the file at `path` in a folder of rayrace, if there is one: another process will write it anew."""
    with suppress(FileNotFoundError), _opened(Path(path).parent, own=True) as folder:
        os.unlink(Path(path).name, dir_fd=folder)


def has_one_name(state: os.stat_result) -> bool:
    """Whether a file has one name; also if it was removed meanwhile, which the writer of lines reports."""
    return state.st_nlink <= 1


@contextmanager
def _opened(folder: Path, own: bool) -> Iterator[int]:
    """Yields a descriptor of a folder. UserError if it is one of rayrace and a link is in its place."""
    try:
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC | (os.O_NOFOLLOW if own else 0))
    except OSError as error:
        if own and error.errno in (errno.ELOOP, errno.ENOTDIR) and folder.is_symlink():
            raise UserError(f"{folder}: a link; nothing is written through it", remedy=REMEDY) from None
        raise
    try:
        yield descriptor
    finally:
        os.close(descriptor)


def _must_be_plain(folder: int, path: Path) -> None:
    """UserError if something is at `path`, in the open folder, that is no plain file."""
    with suppress(FileNotFoundError):
        mode = os.stat(path.name, dir_fd=folder, follow_symlinks=False).st_mode
        if stat.S_ISDIR(mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
        if not stat.S_ISREG(mode):
            what = "a link" if stat.S_ISLNK(mode) else "not a plain file"
            raise UserError(f"{path}: {what}; nothing is written through it", remedy=REMEDY)
