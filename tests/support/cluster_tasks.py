"""Tasks (harness/executors) for tests of executors. Each leaves a file in its folder, of JSON, called by its number."""

import itertools
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

LONG = 300.0  # s: until somebody ends it


def stamp(folder: str, number: int) -> None:
    """Take a moment; when, where and with what."""
    begin = time.monotonic()  # the same clock for all processes of a machine
    time.sleep(0.3)
    told = {"cores": sorted(os.sched_getaffinity(0)), "count": os.cpu_count(), "environment": dict(os.environ)}
    _leave(folder, number, begin=begin, end=time.monotonic(), pid=os.getpid(), **told)


def meet(folder: str, number: int) -> None:
    """Be at work until the other of tasks 0 and 1 is too, or for a minute in vain; when."""
    begin = time.monotonic()
    mine, other = (Path(folder) / f"{each}.begun" for each in (number, 1 - number))
    mine.touch()
    while not other.exists() and time.monotonic() < begin + 60:
        time.sleep(0.02)
    _leave(folder, number, begin=begin, end=time.monotonic())


def alone(folder: str, number: int) -> None:
    """As `stamp`, as a run that measures: the host is its own meanwhile."""
    from harness.race.host import host_lock  # with all that it needs, which takes a second

    with host_lock(print):
        stamp(folder, number)


def leave(folder: str, number: int) -> None:
    """Exit with `number`."""
    raise SystemExit(number)


def fault(folder: str, number: int) -> None:
    raise ValueError(f"task {number} is not possible")


def die(folder: str, number: int) -> None:
    """Be killed by signal `number`."""
    os.kill(os.getpid(), number)


def last(folder: str, number: int) -> None:
    """Go on until killed, as does a child in a session of its own. The file says which signals were heard, and when."""
    begin, heard = time.monotonic(), []
    program = f"import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); time.sleep({LONG})"
    child = subprocess.Popen([sys.executable, "-c", program], start_new_session=True)

    def hear(what: int, _) -> None:
        heard.append([signal.Signals(what).name, time.monotonic() - begin])
        _leave(folder, number, pids=[os.getpid(), child.pid], heard=heard)

    for what in (signal.SIGTERM, signal.SIGUSR2):
        signal.signal(what, hear)
    time.sleep(0.5)  # in which the child has heard to ignore it
    _leave(folder, number, pids=[os.getpid(), child.pid], heard=heard)
    while time.monotonic() < begin + LONG:
        time.sleep(0.1)


def obey(folder: str, number: int) -> None:
    """Go on until told to end. The file says that it began, and by which signal it was told."""

    def hear(what: int, _) -> None:
        _leave(folder, number, pid=os.getpid(), heard=signal.Signals(what).name)
        raise SystemExit(1)

    signal.signal(signal.SIGTERM, hear)
    _leave(folder, number, pid=os.getpid(), heard="")
    time.sleep(LONG)


def _leave(folder: str, number: int, **told) -> None:
    part = Path(folder) / f"{number}.part"
    part.write_text(json.dumps(told))
    part.rename(Path(folder) / f"{number}.json")


def left(folder: Path) -> dict[int, dict]:
    """What tasks have left so far, by number."""
    return {int(path.stem): json.loads(path.read_text()) for path in Path(folder).glob("*.json")}


def overlap(told: list[dict]) -> bool:
    """Whether any two were at work at one time."""
    told = sorted(told, key=lambda each: each["begin"])
    return any(before["end"] > after["begin"] for before, after in itertools.pairwise(told))


def until(ready, seconds: float = 60.0):
    """What `ready` gives when it is true at last."""
    end = time.monotonic() + seconds
    while not (found := ready()):
        assert time.monotonic() < end, f"not within {seconds} s"
        time.sleep(0.2)
    return found
