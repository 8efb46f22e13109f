"""Signals that ask this process to end: handled in order, so that it ends what it started."""

import contextlib
import os
import signal
import sys
import threading
import time

ASKED = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
TIDYING = 10.0  # s after a signal in which others are not heard, lest they cut the tidying up short

_asked: list[BaseException] = []  # what was raised last


class Stopped(BaseException):
    """A signal asked this process to end; `number` says which."""

    number = signal.SIGTERM


def heed(numbers: tuple = ASKED, because: str = "") -> None:
    """From now on these signals raise Stopped("NAMEbecause"), SIGINT KeyboardInterrupt. One that is ignored, as by
    nohup, stays so. Handlers are of the main thread: in others this does nothing."""
    if threading.current_thread() is not threading.main_thread():
        return
    _asked.clear()
    last = float("-inf")

    def stop(number, _):
        nonlocal last
        if time.monotonic() - last < TIDYING:
            return
        last = time.monotonic()
        error = KeyboardInterrupt() if number == signal.SIGINT else Stopped(f"{signal.Signals(number).name}{because}")
        error.number = number
        _asked[:] = [error]
        raise error

    for number in numbers:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, stop)


def heed_again() -> None:
    """Raise what a signal raised and the interpreter dropped, as it does where one comes in a destructor."""
    if _asked:
        raise _asked.pop()


def end(stopped: Stopped) -> None:
    """End as the signal would have ended this process, so that who started it sees why."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError, AttributeError):  # nobody listens
            stream.flush()
    signal.signal(stopped.number, signal.SIG_DFL)
    os.kill(os.getpid(), stopped.number)
