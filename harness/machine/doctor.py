"""Checks whether this machine is fit to measure: names disturbances and remedies, changes nothing."""

import os
from pathlib import Path

import psutil

from harness.machine import environment, fitness_cores, fitness_gpu
from harness.renderer import builder
from harness.system import cgroup, counters
from harness.system.finding import UNAVAILABLE, Finding, judged, read, unknown
from harness.system.rapl import Rapl

ROOT = Path("/")


def examine(left: dict[Path, str] | None = None) -> list[Finding]:
    """All findings. left: temporary folders that may be rayrace's, each with the reason why there is no proof."""
    facts = environment.capture()
    return [
        *fitness_cores.findings(facts),
        swap(),
        memory_limit(),
        memory_peak(),
        descendants(),
        randomisation(facts["address_randomisation"]),
        compiler(facts["compilers"]["c++"]),
        *counts(),
        energy(),
        *fitness_gpu.findings(),
        temporary(left or {}),
    ]


def swap() -> Finding:
    used = psutil.swap_memory()
    usage = f"{used.used / 2**20:.0f} of {used.total / 2**20:.0f} MiB used"
    return judged(used.used <= 2**20, "swap", usage, "sudo swapoff -a")


def memory_limit(root: Path = ROOT) -> Finding:
    what, limit, total = "memory limit (cgroup)", cgroup.memory_limit(root), psutil.virtual_memory().total
    if cgroup.version(root) is None:
        return unknown(what, "no cgroups here")
    if limit is None:
        return Finding("good", what, "none")
    remedy = "a renderer that needs more swaps or is killed: raise memory.max"
    return judged(limit >= total, what, f"{limit / 1e9:.3g} GB of {total / 1e9:.3g} GB", remedy)


def memory_peak() -> Finding:
    what = "peak memory of rendering alone"
    if not os.path.exists("/proc/self/clear_refs"):
        return unknown(what, "no /proc here", "peaks come from wait4 and include start-up")
    source = f"VmHWM, reset before rendering; the cgroup counts {'one too' if cgroup.memory_peak() else 'none'}"
    if os.access("/proc/self/clear_refs", os.W_OK):
        return Finding("good", what, source)
    return Finding("doubtful", what, "the peak cannot be reset", "peaks include start-up and compilation")


def descendants(root: Path = ROOT) -> Finding:
    what, own = "processes that a renderer starts", os.getpid()
    if read(root / f"proc/{own}/task/{own}/children") is not None:
        return Finding("good", what, "listed at every tick; orphans are counted")
    return unknown(what, "the system does not list children", "searched for twice a second; orphans may be missed")


def randomisation(value: str) -> Finding:
    """The layout in memory changes times by some per cent; if it is fixed, repetitions do not average that out."""
    what = "address randomisation"
    if value.startswith(UNAVAILABLE):
        return unknown(what, value)
    remedy = "each process has the same layout, which favours one renderer: sudo sysctl kernel.randomize_va_space=2"
    return judged(value == "2", what, {"0": "off", "1": "of a part", "2": "full"}.get(value, value), remedy)


def temporary(left: dict[Path, str]) -> Finding:
    listing = "; ".join(f"{place}: {why}" for place, why in left.items())
    remedy = "rayrace removes only what it can prove to be its own; remove these yourself if they are not needed"
    return judged(not left, "temporary folders", listing or "none left by rayrace", remedy)


def counts() -> list[Finding]:
    """What can count instructions (`count` of an experiment's [measure]); nothing that times depend on."""
    what = "counts of instructions"
    tools = counters.perf(), counters.valgrind()
    counter = next((tool for tool in tools if isinstance(tool, counters.Tool)), None)
    if counter is None:
        return [unknown(what, "; ".join(map(str, tools)))]
    why = f"; {tools[0]}" if counter is tools[1] else ""
    return [Finding("good", what, f"by {counter.name} {counter.version}{why}")]


def energy() -> Finding:
    """Whether the energy of the processor can be read; nothing that times depend on."""
    what, reason = "energy of the processor", Rapl().unavailable
    return Finding("good", what, "by RAPL, of whole packages") if reason is None else unknown(what, reason)


def compiler(value: str) -> Finding:
    if value.startswith(UNAVAILABLE):
        remedy = "correct CXX, or unset it" if os.environ.get("CXX") else "apt install g++"
        return Finding("doubtful", "C++ compiler", value, remedy)
    return Finding("good", "C++ compiler", f"{value} ({' '.join(builder.compiler('c++'))})")
