"""Reads the control groups of this process: CPU quota, time stopped by it, and memory limit (cgroups(7)).

Version 2 has one tree for all controllers, version 1 one for each; a limit holds for all groups below it. In a
container the path of the group may be hidden; then only the top of the visible tree counts.
"""

from pathlib import Path

from harness.system.finding import read

ROOT = Path("/")
TREES = "sys/fs/cgroup"


def version(root: Path = ROOT) -> int | None:
    """The version of control groups: 2, 1 (also if version 2 exists without controllers), or None without groups."""
    if (root / TREES / "cgroup.controllers").exists():
        return 2
    return 1 if any((root / TREES / name).is_dir() for name in ("cpu", "memory")) else None


def folders(controller: str, root: Path = ROOT) -> list[Path]:
    """The folders of this process's group and its ancestors, its own first. controller: cpu or memory."""
    number = version(root)
    tree = root / TREES if number == 2 else root / TREES / controller
    if number is None or not tree.is_dir():
        return []
    for line in (read(root / "proc/self/cgroup") or "").splitlines():
        _, controllers, path = line.split(":", 2)
        if controller in controllers.split(",") if number == 1 else controllers == "":
            own = tree / path.strip("/")
            return [place for place in (own, *own.parents) if place.is_dir() and place.is_relative_to(tree)]
    return [tree]


def quota(root: Path = ROOT) -> float | None:
    """The CPU quota of the tightest group, in cores; None if none has a limit."""
    cores = []
    for place in folders("cpu", root):
        words = (read(place / "cpu.max") or "").split()
        words = words or [read(place / f"cpu.cfs_{name}_us") or "-1" for name in ("quota", "period")]
        if words[0] not in ("max", "-1"):
            cores.append(int(words[0]) / int(words[1]))
    return min(cores, default=None)


def held_back(root: Path = ROOT) -> tuple[int, float] | None:
    """How often, and for how many seconds, a quota has stopped the groups so far; None if no group counts that."""
    counts = []
    for place in folders("cpu", root):
        rows = dict(line.split() for line in (read(place / "cpu.stat") or "").splitlines())
        if "nr_throttled" in rows:
            seconds = int(rows.get("throttled_usec", 0)) / 1e6 or int(rows.get("throttled_time", 0)) / 1e9
            counts.append((int(rows["nr_throttled"]), seconds))
    return tuple(map(sum, zip(*counts, strict=True))) if counts else None


def memory_limit(root: Path = ROOT) -> int | None:
    """The memory limit of the tightest group in bytes; None if none has a limit."""
    texts = [
        read(place / name) for place in folders("memory", root) for name in ("memory.max", "memory.limit_in_bytes")
    ]
    limits = [int(text) for text in texts if text not in (None, "max")]
    return min((limit for limit in limits if limit < 2**62), default=None)  # version 1's "none" is near 2^63


def memory_peak(root: Path = ROOT) -> str | None:
    """The name of the file with the memory peak of this process's group; None if there is none."""
    names = ("memory.peak", "memory.max_usage_in_bytes")
    return next((name for place in folders("memory", root)[:1] for name in names if (place / name).exists()), None)
