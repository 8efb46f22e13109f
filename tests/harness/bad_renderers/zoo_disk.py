"""Fills the disk, and what is kept of its output."""

import contextlib
import os
import signal
import sys
import tempfile
import time

from main import flags, good, hang

OUT, CACHE = flags["out"], flags["cache"]
HERE = os.path.dirname(OUT)  # the folder that is removed when the process has ended
MB = 10**6


def write_files(folder, size=2 * MB, most=100):
    os.makedirs(folder, exist_ok=True)
    for number in range(most):
        with open(f"{folder}/{number}", "wb") as file:
            file.write(b"x" * size)
        time.sleep(0.01)
    hang()


def one_large_file(by_signal):
    """Where nobody counts what is written."""
    signal.signal(signal.SIGXFSZ, signal.SIG_DFL if by_signal else signal.SIG_IGN)
    with open(f"{os.path.dirname(CACHE)}/large", "wb", buffering=0) as file:
        for _ in range(200):
            file.write(b"x" * MB)


def a_million_files():
    for number in range(10**6):
        os.close(os.open(f"{OUT}/{number}", os.O_CREAT | os.O_WRONLY))
    hang()


def nest():
    os.chdir(OUT)
    for _ in range(300):
        os.mkdir("d")
        os.chdir("d")
    os.chdir("/")
    good()


def forbid():
    """Leaves folders that nobody may enter, and one that nobody may change."""
    good()
    os.makedirs(f"{HERE}/neutral/a/b")
    os.chmod(f"{HERE}/neutral/a", 0o500)
    os.chmod(f"{HERE}/neutral", 0)


def chatter(fd, line=b"x" * 99 + b"\n"):
    for _ in range(10**9 // (1000 * len(line))):
        with contextlib.suppress(OSError):  # of the largest file
            os.write(fd, line * 1000)
    hang()


def grow_output():
    good()
    sys.stdout.flush()
    os.ftruncate(1, 3 * MB)


def leave_temporary_files():
    for _ in range(3):
        with open(f"{tempfile.mkdtemp()}/file", "wb") as file:
            file.write(b"x" * 1000)
    good()


def go_silent():
    good()
    sys.stdout.flush()
    os.close(1)
    os.close(2)
    hang()


def close_at_once():
    os.close(1)
    os.close(2)
    os._exit(0)


MISDEEDS = {
    "zoo-disk-out": lambda: write_files(OUT),
    "zoo-disk-cache": lambda: write_files(CACHE),
    "zoo-disk-temporary": lambda: write_files(tempfile.gettempdir()),
    "zoo-disk-folder": lambda: write_files(os.getcwd()),
    "zoo-disk-file": lambda: one_large_file(by_signal=False),
    "zoo-disk-signal": lambda: one_large_file(by_signal=True),
    "zoo-disk-million": a_million_files,
    "zoo-disk-nested": nest,
    "zoo-disk-forbidden": forbid,
    "zoo-disk-left": leave_temporary_files,
    "zoo-output": lambda: chatter(1),
    "zoo-output-error": lambda: chatter(2),
    "zoo-output-line": lambda: chatter(1, b"x"),
    "zoo-output-grown": grow_output,
    "zoo-output-closed": close_at_once,
    "zoo-output-silent": go_silent,
}
