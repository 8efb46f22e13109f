"""The one lock of this machine, for all users and temporary folders: who holds it measures, and others wait.

On Linux it is the name of an abstract socket (unix(7)): no file that could be left behind, or be another user's. The
kernel frees the name when its process ends, however it ends, and tells whoever connects which process of which user
holds it. Who waits keeps that connection, which is cut when the holder ends, so waiting takes no processor time. A
container with a network of its own has a lock of its own. On other systems it is a lock of a file that all users may
open, in /tmp.
"""

import contextlib
import errno
import os
import select
import socket
import struct
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

from harness.system import lock

NAME = f"rayrace-measuring{os.environ.get('RAYRACE_LOCK', '')}"  # tests have a lock of their own
ADDRESS = f"\0{NAME}"
FILE = Path("/tmp", f"{NAME}.lock")
LOOK = 1.0  # s between looks at a holder who is known already
AGAIN = 0.1  # s after a look that found none: the holder has just ended, or not yet said who it is
MISSES = 20  # such looks in a row after which it is a holder who is not known


class Holder(NamedTuple):
    """The process that holds the lock. Each is None if the system does not tell; pid also in another container."""

    pid: int | None
    user: int | None


@contextlib.contextmanager
def locked(busy: Callable[[Holder], None] = lambda holder: None) -> Iterator[None]:
    """Holds the lock; waits while others do, and calls `busy` with each of them. OSError if there is no lock."""
    with contextlib.ExitStack() as stack:
        take, look = (_bind, _peer) if _has_names() else (_lock, _written)
        last, misses = None, 0
        while not take(stack):
            holder = look(last)
            misses = 0 if holder else misses + 1
            if misses == MISSES:
                holder = Holder(None, None)
            if holder and holder != last:
                busy(holder)
                last = holder
        yield


def _has_names() -> bool:
    """Whether this system has abstract sockets, and lets this process have one."""
    if not hasattr(socket, "SO_PEERCRED"):
        return False
    try:
        with socket.socket(socket.AF_UNIX) as own:
            own.bind("")  # a name that the kernel chooses
        return True
    except OSError:
        return False


def _bind(stack: contextlib.ExitStack) -> bool:
    """Takes the lock until `stack` is closed; False if another process holds it."""
    own = stack.enter_context(socket.socket(socket.AF_UNIX))
    try:
        own.bind(ADDRESS)
    except OSError as error:
        own.close()
        if error.errno == errno.EADDRINUSE:
            return False
        raise
    own.listen(socket.SOMAXCONN)  # nobody is answered: each connection is of one who waits
    return True


def _peer(last: Holder | None) -> Holder | None:
    """Returns the holder, after up to LOOK s if it is still `last`; None after AGAIN s if there is none."""
    with socket.socket(socket.AF_UNIX) as own:
        own.setblocking(False)
        try:
            own.connect(ADDRESS)
        except OSError:
            time.sleep(AGAIN)
            return None
        pid, user, _ = struct.unpack("iII", own.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, 12))
        holder = Holder(pid or None, user)
        if holder == last:
            end = select.poll()
            end.register(own, 0)  # hears of nothing but the end of the connection
            end.poll(1000 * LOOK)
        return holder


def _lock(stack: contextlib.ExitStack) -> bool:
    """The same as _bind with a lock of FILE, in which its holder writes who it is."""
    descriptor = _open()
    try:
        lock.take(descriptor, FILE, wait=False)
        os.ftruncate(descriptor, 0)
        os.pwrite(descriptor, f"{os.getpid()} {os.getuid()}\n".encode(), 0)
    except lock.Busy:
        os.close(descriptor)
        return False
    except BaseException:
        os.close(descriptor)
        raise
    stack.callback(os.close, descriptor)
    return True


def _written(last: Holder | None) -> Holder | None:
    """The same as _peer with what is written in FILE."""
    try:
        holder = Holder(*map(int, FILE.read_bytes()[:100].split()))
    except (OSError, ValueError, TypeError):
        holder = None
    if holder in (last, None):
        time.sleep(LOOK if holder else AGAIN)
    return holder


def _open() -> int:
    """Opens FILE; the first to do so makes it, so that all users may open it."""
    while True:
        try:  # first without O_CREAT: in a sticky folder Linux lets nobody open another user's file with it
            return os.open(FILE, os.O_RDWR | os.O_NOFOLLOW)
        except FileNotFoundError:
            pass
        with contextlib.suppress(FileExistsError):
            descriptor = os.open(FILE, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o666)
            os.fchmod(descriptor, 0o666)  # whatever the umask
            return descriptor
