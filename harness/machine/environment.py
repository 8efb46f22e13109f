"""Describes the machine and its software: the study's table 2.1, and more that a reader needs.

Every value is text or a number, or "unavailable: " and the reason.
"""

import importlib.metadata
import os
import platform
import socket
from pathlib import Path

import psutil

from harness.renderer import builder
from harness.renderer.registry import usable_cores
from harness.system import cgroup, git
from harness.system.gpu import Gpu

PACKAGES = ("numpy", "numba", "numba-cuda", "llvmlite", "psutil", "mpmath", "scipy", "rayrace")


def capture() -> dict:
    """The identity of this machine and its software, and its present state."""
    return {
        "host": socket.gethostname(),
        "os": _os(),
        "kernel": platform.release(),
        "cpu": _cpu_model(),
        "architecture": platform.machine(),
        "cores": {
            "usable": usable_cores(),
            "logical": psutil.cpu_count(),
            "physical": psutil.cpu_count(logical=False) or _no("not told by the system"),
        },
        "frequency": _frequency(),
        "caches": _caches(),
        "virtual_machine": _virtual(),
        "memory_bytes": psutil.virtual_memory().total,
        "swap_bytes": psutil.swap_memory().total,
        "disk": _disk(),
        "gpu": _gpu(),
        "governor": _read("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor"),
        "turbo": _turbo(),
        "clock_source": _read("/sys/devices/system/clocksource/clocksource0/current_clocksource"),
        "cpu_quota": cgroup.quota() or ("none" if cgroup.version() else _no("no cgroups here")),
        "address_randomisation": _read("/proc/sys/kernel/randomize_va_space"),
        "load": list(os.getloadavg()) if hasattr(os, "getloadavg") else _no("not told by the system"),
        "pressure": _read("/proc/pressure/cpu"),
        "python": python(),
        "compilers": {kind: _compiler(kind) for kind in builder.CANDIDATES},
        "packages": packages(),
        "commit": _commit(),
    }


def python() -> str:
    """Name and version of the Python implementation."""
    return f"{platform.python_implementation()} {platform.python_version()}"


def packages() -> dict[str, str]:
    """The versions of PACKAGES by name."""
    return {name: _version(name) for name in PACKAGES}


def _no(reason: str) -> str:
    return f"unavailable: {reason}"


def _read(path: str) -> str:
    try:
        return Path(path).read_text(encoding="utf-8", errors="replace").strip()
    except OSError as error:
        return _no(f"{path}: {error.strerror}")


def _os() -> str:
    try:
        return platform.freedesktop_os_release()["PRETTY_NAME"]
    except (OSError, KeyError):
        return f"{platform.system()} {platform.version()}"


def _cpu_model() -> str:
    for line in _read("/proc/cpuinfo").splitlines():
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return platform.processor() or _no("not told by the system")


def _frequency() -> str | dict:
    try:
        frequency = psutil.cpu_freq()
    except (OSError, NotImplementedError, ValueError) as error:  # of a processor that tells its limits alone
        return _no(str(error))
    if frequency is None:
        return _no("no cpufreq here")
    now, most = frequency.current, frequency.max
    return {"now_mhz": now or _no("not told by the system"), "max_mhz": most or _no("no cpufreq here")}


def _caches() -> dict | str:
    caches = {}
    for index in sorted(Path("/sys/devices/system/cpu/cpu0/cache").glob("index*")):
        name = f"L{_read(str(index / 'level'))} {_read(str(index / 'type')).lower()}"
        caches[name] = _read(str(index / "size"))
    return caches or _no("no /sys/devices/system/cpu/cpu0/cache")


def _virtual() -> str:
    lines = [line for line in _read("/proc/cpuinfo").splitlines() if line.startswith("flags")]
    if not lines:
        return _no("no flags in /proc/cpuinfo")
    return "yes" if " hypervisor" in lines[0] else "no sign of one"


def _disk() -> str:
    """The kind of disk that has the current directory."""
    try:
        device = os.stat(".").st_dev
        block = Path(f"/sys/dev/block/{os.major(device)}:{os.minor(device)}").resolve(strict=True)
    except (OSError, AttributeError):
        return _no("the folder is on no block device")
    for place in (block, block.parent):
        if (place / "queue" / "rotational").exists():
            turning = _read(str(place / "queue" / "rotational")) == "1"
            model = _read(str(place / "device" / "model"))
            kind = "rotating disk" if turning else "solid-state or virtual disk"
            return kind if model.startswith("unavailable") else f"{model} ({kind})"
    return _no("no queue of the block device")


def _gpu() -> dict | str:
    gpu = Gpu()
    return gpu.identity() if gpu.unavailable is None else _no(gpu.unavailable)


def _turbo() -> str:
    for path, on in (
        ("/sys/devices/system/cpu/intel_pstate/no_turbo", "0"),
        ("/sys/devices/system/cpu/cpufreq/boost", "1"),
    ):
        value = _read(path)
        if not value.startswith("unavailable"):
            return "on" if value == on else "off"
    return _no("no intel_pstate or cpufreq boost here")


def _compiler(kind: str) -> str:
    words = builder.compiler(kind)
    return builder.compiler_version(*words) if words else _no(builder.missing(kind))


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return _no("not installed")


def _commit() -> str:
    """The commit of the checkout with this file, and "-dirty" if files differ from it."""
    here = Path(__file__).resolve()
    try:
        if (
            git.ask(here.parent, "ls-files", "--error-unmatch", here.name) is None
        ):  # a repository around an installed one
            return _no("not in a git checkout")
        return git.ask(here.parent, "describe", "--always", "--dirty", "--exclude=*") or _no("git does not tell")
    except git.Distrusted as error:
        return _no(str(error))
