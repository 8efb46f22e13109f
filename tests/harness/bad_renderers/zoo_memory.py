"""Takes memory."""

import mmap
import os
import time

from main import good, hang

MB = 10**6


def fill(size):
    """Memory that is really used."""
    return bytearray(b"x") * size


def eat(step=20 * MB, most=900 * MB):
    held = [fill(step)]
    while len(held) * step < most:
        held.append(fill(step))
        time.sleep(0.01)
    hang()


def eat_in_children():
    for _ in range(5):
        if os.fork() == 0:
            held = fill(90 * MB)
            hang()
            del held
    hang()


def share_memory():
    """Five processes hold the same 150 MB, for long enough to be looked at."""
    held = mmap.mmap(-1, 150 * MB)
    for _ in range(150):
        held.write(b"x" * MB)
    children = []
    for _ in range(4):
        children.append(os.fork())
        if children[-1] == 0:
            for place in range(0, 150 * MB, 4096):
                held[place]
            time.sleep(0.6)
            os._exit(0)
    for child in children:
        os.waitpid(child, 0)
    good()


def spike():
    held = fill(380 * MB)
    del held
    good()


def fill_files(open_next, size=3 * MB, most=900 * MB):
    """Memory that is in no process: of files, which are mapped nowhere. Those of an older time are closed."""
    held = []
    for number in range(most // size):
        held.append(open_next(number))
        os.write(held[-1], b"x" * size)
        if len(held) > 100:
            os.close(held.pop(0))
        time.sleep(0.01)
    hang()


def create(number):
    return os.open(f"/dev/shm/rayrace-zoo-{os.getpid()}-{number}", os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600)


MISDEEDS = {
    "zoo-memory-file": lambda: fill_files(lambda number: os.memfd_create("zoo")),
    "zoo-memory-files": lambda: fill_files(create),
    "zoo-memory": eat,
    "zoo-memory-children": eat_in_children,
    "zoo-memory-shared": share_memory,
    "zoo-memory-spike": spike,
}
