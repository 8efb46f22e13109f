"""What disturbed a repetition: the system's own counters before it and after it.

steal_s        CPU time that the host of a virtual machine gave to others (proc(5), /proc/stat)
other_cpu_s    CPU time of all programs but rayrace and what it started
waited_s       time in which some program waited for a core (/proc/pressure/cpu)
swapped_pages  to and from the disk (/proc/vmstat)
throttled      times that a core was slowed down for heat

Each is a number, or {"unavailable": reason}. Resolution of the CPU times: one tick of the clock for each core, 10 ms.
"""

import os
from pathlib import Path

ROOT = Path("/")
LEAST_S = 0.1  # s, below which the resolution of the counters decides
SHARE = 0.05  # of the wall time of one core
CORE_FIELDS, STEAL_FIELD = (0, 1, 2, 5, 6), 7  # of /proc/stat: user, nice, system, irq, softirq; steal

DOUBTS = {
    "steal_s": "the host of this virtual machine took the processor away",
    "other_cpu_s": "other programs used the processor",
    "swapped_pages": "the system swapped memory",
    "throttled": "the processor was slowed down for heat",
}


def look(root: Path = ROOT) -> dict:
    """The counters now, each a number or the reason why there is none."""
    own = os.times()
    return {
        "steal_s": _first(root / "proc/stat", lambda line: _cpu_s(line, (STEAL_FIELD,))),
        "busy_s": _first(root / "proc/stat", lambda line: _cpu_s(line, CORE_FIELDS)),
        "own_s": own.user + own.system + own.children_user + own.children_system,
        "waited_s": _first(root / "proc/pressure/cpu", lambda line: int(line.rpartition("total=")[2]) / 1e6),
        "swapped_pages": _swapped(root / "proc/vmstat"),
        "throttled": _throttled(root / "sys/devices/system/cpu"),
    }


def between(before: dict, after: dict) -> dict:
    """What happened from one look to the next."""
    changed = {}
    for name, old in before.items():
        new = after[name]
        reason = next((value for value in (old, new) if isinstance(value, str)), None)
        changed[name] = {"unavailable": reason} if reason else max(0, new - old)
    busy, own = changed.pop("busy_s"), changed.pop("own_s")
    other = busy if isinstance(busy, dict) else max(0.0, busy - own)
    return {"steal_s": changed.pop("steal_s"), "other_cpu_s": other, **changed}


def doubts(found: dict, wall_s: float) -> list[str]:
    """Why times of a repetition of `wall_s` seconds are doubtful, in words that are the same each time."""
    limits = dict.fromkeys(("steal_s", "other_cpu_s"), max(LEAST_S, SHARE * wall_s))
    return [
        text for name, text in DOUBTS.items() if not isinstance(found[name], dict) and found[name] > limits.get(name, 0)
    ]


def _cpu_s(line: str, fields: tuple[int, ...]) -> float:
    """CPU seconds in some fields of the first line of /proc/stat."""
    ticks = [int(word) for word in line.split()[1:]]
    return sum(ticks[field] for field in fields) / os.sysconf("SC_CLK_TCK")


def _first(path: Path, read):
    """`read` of the first line of a file, or why not."""
    try:
        return read(path.read_text(encoding="utf-8").splitlines()[0])
    except (OSError, ValueError, IndexError) as error:
        return f"{path}: {getattr(error, 'strerror', None) or 'not as expected'}"


def _swapped(path: Path):
    try:
        rows = dict(line.split() for line in path.read_text(encoding="utf-8").splitlines())
        return int(rows["pswpin"]) + int(rows["pswpout"])
    except (OSError, ValueError, KeyError) as error:
        return f"{path}: {getattr(error, 'strerror', None) or 'not as expected'}"


def _throttled(cores: Path):
    try:
        counts = [int(path.read_text()) for path in cores.glob("cpu[0-9]*/thermal_throttle/core_throttle_count")]
    except (OSError, ValueError) as error:
        return f"{cores}: {getattr(error, 'strerror', None) or 'not as expected'}"
    return sum(counts) if counts else "the system counts none"
