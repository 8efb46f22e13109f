"""Checks whether the processor and the clock are fit to measure: findings for the doctor."""

import os
import re
import subprocess
import sys
import time
from pathlib import Path

import psutil

from harness.renderer.registry import usable_cores
from harness.system import cgroup, trouble
from harness.system.finding import UNAVAILABLE, Finding, judged, read, unknown

ROOT = Path("/")
# Clocks that are read without a system call; the others need one, or a slow device.
QUICK_CLOCKS = ("tsc", "kvm-clock", "hyperv_clocksource_tsc_page", "arch_sys_counter")
SLOW_READ = 200e-9  # s
OF_THE_HOST = "in a virtual machine only the host knows"
CORE = "sys/devices/system/cpu"

PIN = """import os
cores = os.sched_getaffinity(0)
os.sched_setaffinity(0, {min(cores)})
print(os.sched_getaffinity(0) == {min(cores)})"""


def findings(facts: dict, root: Path = ROOT) -> list[Finding]:
    """All findings. facts: from environment.capture()."""
    return [
        governor(facts["governor"]),
        turbo(facts["turbo"]),
        throttled(root),
        load(),
        pressure(facts["pressure"]),
        virtual(facts["virtual_machine"]),
        pinning(),
        siblings(facts["virtual_machine"], root),
        quota(root),
        clock(root),
    ]


def governor(value: str) -> Finding:
    what = "frequency governor"
    if value.startswith(UNAVAILABLE):
        return unknown(what, "no cpufreq here", OF_THE_HOST)
    return judged(value == "performance", what, value, "sudo cpupower frequency-set -g performance")


def turbo(value: str) -> Finding:
    if value.startswith(UNAVAILABLE):
        return unknown("turbo", value, OF_THE_HOST)
    remedy = "the clock rate depends on heat and on other cores; turn turbo off in the firmware for steady times"
    return judged(value != "on", "turbo", value, remedy)


def throttled(root: Path = ROOT) -> Finding:
    what, count = "slowed down by heat", trouble.look(root)["throttled"]
    if isinstance(count, str):
        return unknown(what, count, OF_THE_HOST)
    remedy = "better cooling, or fewer threads; each repetition records whether it happened"
    return judged(count == 0, what, f"{count} times since the system started", remedy)


def load() -> Finding:
    busy = psutil.cpu_percent(interval=0.5) / 100 * (psutil.cpu_count() or 1)
    usage = f"{busy:.2f} of {usable_cores()} usable cores busy over half a second"
    return judged(busy <= 0.1, "other load", usage, "end other programs; `top` shows them")


def pressure(value: str) -> Finding:
    what = "waiting for a core (pressure)"
    if value.startswith(UNAVAILABLE):
        return unknown(what, value)
    averages = dict(re.findall(r"\b(avg10|avg300)=(\d+(?:\.\d+)?)(?!\S)", value.partition("\n")[0]))
    if len(averages) < 2:
        return unknown(what, f"{UNAVAILABLE}/proc/pressure/cpu has no avg10 and avg300")
    shares = f"{averages['avg10']} % of the last 10 s, {averages['avg300']} % of the last 5 min"
    return judged(float(averages["avg10"]) < 1, what, shares, "something else wants the cores: see other load")


def virtual(value: str) -> Finding:
    if value == "yes":
        remedy = "cores may vanish for seconds; trust ratios of interleaved runs, not single times"
        return Finding("doubtful", "virtual machine", value, remedy)
    return Finding("good" if value.startswith("no") else "unknown", "virtual machine", value)


def pinning() -> Finding:
    """Tries it in a process of its own, so that nothing changes here."""
    what = "pinning to a core"
    if not hasattr(os, "sched_setaffinity"):
        return unknown(what, "this system has no call for it")
    allowed = sorted(os.sched_getaffinity(0))
    tried = subprocess.run([sys.executable, "-I", "-S", "-c", PIN], capture_output=True, text=True, timeout=20)
    can = tried.stdout.strip() == "True"
    state = f"{'possible' if can else 'refused'}, on {ranges(allowed)} of {os.cpu_count()} cores"
    return judged(can, what, state, "the container or its seccomp profile forbids it: allow sched_setaffinity")


def siblings(virtual_machine: str, root: Path = ROOT) -> Finding:
    """Checks whether two usable cores share a physical core."""
    what = "hyper-threads (SMT)"
    allowed = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set(range(os.cpu_count() or 1))
    groups = {read(root / CORE / f"cpu{core}/topology/thread_siblings_list"): core for core in sorted(allowed)}
    if None in groups:
        return unknown(what, "the system does not list the siblings of a core")
    pick = ",".join(map(str, sorted(groups.values())))
    remedy = f"two threads on one core slow each other down; use one of each pair: taskset -c {pick} rayrace run .."
    count = f"{len(allowed)} usable on {len(groups)} physical cores"
    if virtual_machine == "yes" and len(groups) == len(allowed):
        return Finding("unknown", what, f"{count}, as the virtual machine shows them", OF_THE_HOST)
    return judged(len(groups) == len(allowed), what, count, remedy)


def quota(root: Path = ROOT) -> Finding:
    what = "CPU quota (cgroup)"
    version, cores, stopped = cgroup.version(root), cgroup.quota(root), cgroup.held_back(root)
    if version is None:
        return unknown(what, "no cgroups here")
    if cores is None:
        return Finding("good", what, f"none (version {version})")
    limit = f"{cores:g} cores (version {version})"
    limit += f", which stopped it {stopped[0]} times for {stopped[1]:.3g} s" if stopped else ""
    remedy = f"programs stop for parts of 0.1 s when it is used up: raise cpu.max, or use at most {int(cores)} threads"
    return judged(cores >= usable_cores() and not (stopped and stopped[0]), what, limit, remedy)


def clock(root: Path = ROOT) -> Finding:
    """Checks the clock's source, its resolution, and the time to read it."""
    info = time.get_clock_info("monotonic")
    readings = [time.monotonic_ns() for _ in range(20001)]
    cost = min(b - a for a, b in zip(readings[::1000], readings[1000::1000], strict=False)) / 1000 * 1e-9
    places = root / "sys/devices/system/clocksource/clocksource0"
    source = read(places / "current_clocksource")
    facts = f"{source or 'source unknown'}, resolution {info.resolution:.0e} s, read in {cost * 1e9:.0f} ns"
    good = info.resolution <= 1e-6 and cost <= SLOW_READ and (source is None or source in QUICK_CLOCKS)
    available = (read(places / "available_clocksource") or "").split()
    better = [f"start the system with clocksource={name}" for name in QUICK_CLOCKS if name in available]
    remedy = better[0] if better else "frames must be much longer: see least_frame"
    return judged(good, "clock", facts, remedy)


def ranges(numbers: list[int]) -> str:
    """Formats sorted numbers as ranges: 0, 1, 2, 5 as "0-2,5"."""
    runs = []
    for number in numbers:
        if runs and number == runs[-1][1] + 1:
            runs[-1][1] = number
        else:
            runs.append([number, number])
    return ",".join(str(a) if a == b else f"{a}-{b}" for a, b in runs)
