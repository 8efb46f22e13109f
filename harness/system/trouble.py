"""Detects disturbances of a repetition, from the system's counters before and after it.

steal_s        CPU time that the host of a virtual machine gave to others (proc(5), /proc/stat)
other_cpu_s    CPU time of all programs except rayrace and its descendants
waited_s       time in which a program waited for a core (/proc/pressure/cpu)
swapped_pages  to and from the disk (/proc/vmstat)
held_back_s    time for which a CPU quota stopped this control group, or an outer one (cpu.stat)
throttled      number of times that a core was slowed down because of heat
measurer_s     CPU time of the process that watches the renderer, which `between` does not know

Each is a number, or {"unavailable": reason}. CPU times are of the cores that this process may use, and have a
resolution of one clock tick for each of them, 10 ms.

Other programs disturb a renderer where they leave it fewer cores than it has threads: on a machine with 4 cores, one
thread is not disturbed by what the others do on 3. Two threads of one physical core slow each other down, so physical
cores count.
"""

import os
from pathlib import Path

from harness.system import cgroup

ROOT = Path("/")
LEAST_S = 0.1  # s: less is within the resolution of the counters
SHARE = 0.05  # of a core, beyond those that are free: it slows one thread down by so much at most
CORE_FIELDS, STEAL_FIELD = (0, 1, 2, 5, 6), 7  # of /proc/stat: user, nice, system, irq, softirq; steal

DOUBTS = {
    "steal_s": "the host of this virtual machine took the processor away",
    "other_cpu_s": "other programs used the processor",
    "measurer_s": "the measurer used the processor: measure.interval is short",
    "swapped_pages": "the system swapped memory",
    "held_back_s": "a CPU quota (cgroup) stopped the programs of this group",
    "throttled": "the processor was slowed down for heat",
}
TAKEN = "steal_s", "other_cpu_s", "held_back_s"  # CPU time that others had


def look(root: Path = ROOT) -> dict:
    """The counters now, each a number or the reason why it is unavailable."""
    own, cores = os.times(), usable()
    return {
        "steal_s": _told(root / "proc/stat", lambda text: _cpu_s(text, cores, (STEAL_FIELD,))),
        "busy_s": _told(root / "proc/stat", lambda text: _cpu_s(text, cores, CORE_FIELDS)),
        "own_s": own.user + own.system + own.children_user + own.children_system,
        "waited_s": _told(root / "proc/pressure/cpu", _waited),
        "swapped_pages": _told(root / "proc/vmstat", _swapped),
        "held_back_s": _held_back(root),
        "throttled": _throttled(root / "sys/devices/system/cpu"),
    }


def between(before: dict, after: dict) -> dict:
    """The differences between two results of `look`, by the names above."""
    changed = {}
    for name, old in before.items():
        new = after[name]
        reason = next((value for value in (old, new) if isinstance(value, str)), None)
        changed[name] = {"unavailable": reason} if reason else max(0, new - old)
    busy, own = changed.pop("busy_s"), changed.pop("own_s")
    other = busy if isinstance(busy, dict) else max(0.0, busy - own)
    return {"steal_s": changed.pop("steal_s"), "other_cpu_s": other, **changed}


def doubts(changes: dict, seconds: float, threads: int, cores: int | None = None) -> list[str]:
    """The texts of DOUBTS for a repetition. changes: of `between`, over so many seconds. threads: of the renderer.

    cores: physical ones that it may use; None: those of this machine.
    """
    least = max(LEAST_S, SHARE * seconds)
    free = max(0, (physical() if cores is None else cores) - threads)
    values = {name: value for name, value in changes.items() if not isinstance(value, dict)}
    unused = max(0.0, free * seconds - values.get("waited_s", 0))  # who waits for a core has none free
    limits = {"steal_s": least} | dict.fromkeys(("other_cpu_s", "measurer_s"), least + unused)
    return [text for name, text in DOUBTS.items() if values.get(name, 0) > limits.get(name, 0)]


def seldom(warnings: list[list[str]]) -> set[str]:
    """The texts of DOUBTS that fewer than half of the repetitions of a cell have: so few move no median.

    warnings: of each repetition.
    """
    all_texts = [text for texts in warnings for text in texts]
    return {text for text in DOUBTS.values() if 2 * all_texts.count(text) < len(warnings)}


def taken(warnings: list[list[str]]) -> list[str]:
    """The texts of DOUBTS on CPU time that others had, of those that at least half of the repetitions of a cell have.

    warnings: of each repetition.
    """
    few, texts = seldom(warnings), {text for texts in warnings for text in texts}
    return [DOUBTS[name] for name in TAKEN if DOUBTS[name] in texts - few]


def usable() -> set[int]:
    """The numbers of the cores that this process may use."""
    return set(os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else range(os.cpu_count() or 1))


def physical(root: Path = ROOT) -> int:
    """How many physical cores the usable ones are; where the system does not tell, each is one."""
    siblings = (root / f"sys/devices/system/cpu/cpu{number}/topology/thread_siblings_list" for number in usable())
    return len({_told(path, str.strip) for path in siblings})


def _told(path: Path, read):
    """The result of `read` for a file's text, or the reason why there is none."""
    try:
        return read(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, IndexError, KeyError) as error:
        return f"{path}: {getattr(error, 'strerror', None) or 'not as expected'}"


def _cpu_s(text: str, cores: set[int], fields: tuple[int, ...]) -> float:
    """CPU seconds of these cores in these fields of /proc/stat."""
    lines = (line.split() for line in text.splitlines() if line.startswith("cpu"))
    ticks = [list(map(int, words)) for name, *words in lines if name[3:] and int(name[3:]) in cores]
    if len(ticks) < len(cores):
        raise ValueError
    return sum(line[field] for line in ticks for field in fields) / os.sysconf("SC_CLK_TCK")


def _waited(text: str) -> float:
    return int(text.splitlines()[0].rpartition("total=")[2]) / 1e6


def _swapped(text: str) -> int:
    rows = dict(line.split() for line in text.splitlines())
    return int(rows["pswpin"]) + int(rows["pswpout"])


def _held_back(root: Path):
    stopped = cgroup.held_back(root)
    return stopped[1] if stopped else "no control group counts it"


def _throttled(cores: Path):
    counts = [_told(path, int) for path in sorted(cores.glob("cpu[0-9]*/thermal_throttle/core_throttle_count"))]
    if not counts:
        return "the system counts none"
    return next((count for count in counts if isinstance(count, str)), None) or sum(counts)
