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


def fill_files(open_next, step=20 * MB, most=900 * MB):
    """Memory that is in no process: of files, which are mapped nowhere."""
    for _ in range(0, most, step):
        file = open_next()
        os.write(file, b"x" * step)
        time.sleep(0.02)
    hang()


def fill_one():
    file = os.memfd_create("zoo")
    fill_files(lambda: file)


def fill_many():
    """Of which none is open for longer than it takes to write it."""
    last = []

    def open_next():
        for file in last:
            os.close(file)
        number = time.monotonic_ns()
        last[:] = [os.open(f"/dev/shm/rayrace-zoo-{os.getpid()}-{number}", os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600)]
        return last[0]

    fill_files(open_next)


MISDEEDS = {
    "zoo-memory-file": fill_one,
    "zoo-memory-files": fill_many,
    "zoo-memory": eat,
    "zoo-memory-children": eat_in_children,
    "zoo-memory-shared": share_memory,
    "zoo-memory-spike": spike,
}
