"""Is this machine fit to measure? Looks at what disturbs timings, says what to do, changes nothing."""

import os
import shutil
import time
from dataclasses import dataclass

import psutil

from harness import builder, environment
from harness.registry import usable_cores


@dataclass(frozen=True)
class Finding:
    """verdict: good, doubtful (it may spoil a measurement) or unknown (the system does not tell)."""

    verdict: str
    what: str
    found: str
    remedy: str = ""


def examine() -> list[Finding]:
    facts = environment.capture()
    return [
        _governor(facts["governor"]),
        _turbo(facts["turbo"]),
        _load(),
        _pressure(facts["pressure"]),
        _virtual(facts["virtual_machine"]),
        _swap(),
        _memory_peak(),
        _tick(),
        _compiler(facts["compilers"]["c++"]),
        _gpu(facts["gpu"]),
    ]


def _unknown(what: str, value: str, remedy: str = "") -> Finding:
    return Finding("unknown", what, value, remedy)


def _governor(value: str) -> Finding:
    if value.startswith("unavailable"):
        return _unknown("frequency governor", value)
    if value == "performance":
        return Finding("good", "frequency governor", value)
    return Finding("doubtful", "frequency governor", value, "sudo cpupower frequency-set -g performance")


def _turbo(value: str) -> Finding:
    if value.startswith("unavailable"):
        return _unknown("turbo", value)
    remedy = "clock and so times depend on heat and on the other cores; turn it off in the firmware for steady times"
    return Finding("doubtful", "turbo", value, remedy) if value == "on" else Finding("good", "turbo", value)


def _load() -> Finding:
    busy = psutil.cpu_percent(interval=0.5) / 100 * (psutil.cpu_count() or 1)
    found = f"{busy:.2f} of {usable_cores()} usable cores busy over half a second"
    if busy <= 0.1:
        return Finding("good", "other load", found)
    return Finding("doubtful", "other load", found, "end other programs; `top` shows them")


def _pressure(value: str) -> Finding:
    if value.startswith("unavailable"):
        return _unknown("waiting for a core (pressure)", value)
    averages = dict(part.split("=") for part in value.splitlines()[0].split()[1:])
    found = f"{averages['avg10']} % of the last 10 s, {averages['avg300']} % of the last 5 min"
    if float(averages["avg10"]) < 1:
        return Finding("good", "waiting for a core (pressure)", found)
    return Finding("doubtful", "waiting for a core (pressure)", found, "something else wants the cores: see other load")


def _virtual(value: str) -> Finding:
    if value == "yes":
        remedy = "cores may vanish for seconds; trust ratios of interleaved runs, not single times"
        return Finding("doubtful", "virtual machine", value, remedy)
    return Finding("good" if value.startswith("no") else "unknown", "virtual machine", value)


def _swap() -> Finding:
    swap = psutil.swap_memory()
    found = f"{swap.used / 2**20:.0f} of {swap.total / 2**20:.0f} MiB used"
    used = swap.used > 2**20
    return Finding("doubtful" if used else "good", "swap", found, "sudo swapoff -a" if used else "")


def _memory_peak() -> Finding:
    what = "peak memory of rendering alone"
    if not os.path.exists("/proc/self/clear_refs"):
        return _unknown(what, "unavailable: no /proc here", "peaks come from wait4 and include start-up")
    if os.access("/proc/self/clear_refs", os.W_OK):
        return Finding("good", what, "VmHWM, reset before rendering")
    return Finding("doubtful", what, "the peak cannot be reset", "peaks include start-up and compilation")


def _tick() -> Finding:
    clock = time.get_clock_info("monotonic")
    found = f"{clock.implementation}, resolution {clock.resolution:.0e} s"
    return Finding("good" if clock.resolution <= 1e-6 else "doubtful", "clock", found)


def _compiler(value: str) -> Finding:
    if value.startswith("unavailable"):
        return Finding("doubtful", "C++ compiler", value, "apt install g++")
    return Finding("good", "C++ compiler", f"{value} ({shutil.which(builder.find_compiler('c++') or '')})")


def _gpu(value) -> Finding:
    if isinstance(value, str):
        return _unknown("GPU", value, "without an NVIDIA driver the GPU columns stay empty")
    return Finding("good", "GPU", f"{value['name']}, driver {value['driver']}")
