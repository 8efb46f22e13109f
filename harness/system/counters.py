"""Counts the instructions of a program in user space: by the processor's counters through perf, else in Valgrind.

Sources: perf-stat(1), "CSV FORMAT"; Valgrind's manual, "Cachegrind".
"""

import contextlib
import re
import shutil
import subprocess
from dataclasses import dataclass
from functools import cache
from pathlib import Path

# What is counted, as perf and as a row call it. Valgrind counts instructions alone.
EVENTS = {
    "instructions": "instructions", "cycles": "cycles", "branches": "branches", "branch-misses": "branch_misses",
    "cache-misses": "cache_misses",
}  # fmt: skip
# Where a processor has kinds of cores, each counts while the program is on it, and perf puts it before the name, as in
# cpu_core/instructions:u/ or cpu_atom/instructions/u (perf-stat(1), "INTEL HYBRID SUPPORT").
EVENT = re.compile(r"(?:\w+/)?([\w-]*)")
WHOLE = 0.1  # per cent: the shares of the time in which kinds of cores counted are rounded
COUNTED = re.compile(r"==\d+== I +refs: +([\d,]+)")
TIMEOUT = 30  # s, for a tool that is asked what it can do
NO_PERF = "no program perf on the PATH (apt install linux-perf)"
NO_VALGRIND = "no program valgrind on the PATH (apt install valgrind)"


@dataclass(frozen=True)
class Tool:
    """A program that counts. name: perf or valgrind. slow: it simulates the processor, and knows no AVX-512."""

    name: str
    version: str
    slow: bool

    def words(self, folder: Path) -> list[str]:
        """The words before a command that have the tool count it, and leave the counts in a folder."""
        if self.name == "perf":
            return _perf(folder / "perf.csv")
        out = ["--tool=cachegrind", "--cache-sim=no", "--branch-sim=no", "--cachegrind-out-file=/dev/null"]
        return ["valgrind", *out, "--trace-children=yes", f"--log-file={folder}/%p.log"]

    def read(self, folder: Path) -> dict[str, int] | str:
        """The counts that a process and its descendants left in a folder, by the keys of a row, or why there are none.

        A counter that perf could not read, or only for a part of the time, is left out.
        """
        if self.name == "perf":
            return _of_perf(folder / "perf.csv")
        counts = [int(count.replace(",", "")) for path in folder.glob("*.log") for count in _counted(path)]
        return {"instructions": sum(counts)} if counts else "valgrind left no count"


def _perf(out: Path) -> list[str]:
    events = ",".join(f"{name}:u" for name in EVENTS)
    return ["perf", "stat", "--no-scale", "-x", ",", "-o", str(out), "-e", events, "--"]


def _counted(path: Path) -> list[str]:
    return COUNTED.findall(path.read_text(encoding="utf-8", errors="replace"))


def _of_perf(path: Path) -> dict[str, int] | str:
    try:
        lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return "perf left no counts"
    values, shares, why = {}, {}, "perf counted no instructions"
    for value, _, event, _, share, *_ in (line.split(",") for line in lines if line.count(",") >= 4):
        name = EVENTS.get(EVENT.match(event)[1])
        if name and value.isdigit():
            values[name] = values.get(name, 0) + int(value)
            shares[name] = shares.get(name, 0.0) + float(share)
        elif name == "instructions":
            why = f"perf: instructions {value}"
    counts = {name: value for name, value in values.items() if abs(shares[name] - 100) < WHOLE}
    if "instructions" in values:
        why = f"perf: instructions {values['instructions']}, counted {shares['instructions']:.2f} % of the time"
    return counts if "instructions" in counts else why


def find() -> Tool | str:
    """The tool that counts on this machine, perf rather than Valgrind, or why there is none."""
    tool = perf()
    if isinstance(tool, Tool):
        return tool
    other = valgrind()
    return other if isinstance(other, Tool) else f"{tool}; {other}"


def perf() -> Tool | str:
    """perf, if it can read the counters of the processor, or why not."""
    path = shutil.which("perf")
    return NO_PERF if path is None else _able(path)


@cache
def _able(path: str) -> Tool | str:
    command = [path, "stat", "-x", ",", "-e", "instructions:u", "--", "true"]
    done = _run(command)
    values = []
    for line in (done.stderr if done else "").splitlines():
        value, *rest = line.split(",")
        if "instructions" in ",".join(rest):
            values.append(value)
    if any(map(str.isdigit, values)):
        return Tool("perf", version(path), slow=False)
    if values:
        return f"perf reads no counters: instructions {values[0]}"
    said = [line.strip() for line in (done.stderr if done else "").splitlines() if line.strip() not in ("", "Error:")]
    return f"perf reads no counters: {said[0] if said else 'it does not run'}"


def valgrind() -> Tool | str:
    """Valgrind, or why it is not there."""
    path = shutil.which("valgrind")
    return NO_VALGRIND if path is None else Tool("valgrind", version(path), slow=True)


@cache
def version(path: str) -> str:
    done = _run([path, "--version"])
    match = re.search(r"\d[\w.]*", done.stdout) if done else None
    return match.group() if match else "unknown"


def _run(words: list[str]) -> subprocess.CompletedProcess | None:
    with contextlib.suppress(OSError, subprocess.TimeoutExpired):
        return subprocess.run(
            words, capture_output=True, text=True, errors="replace", timeout=TIMEOUT, stdin=subprocess.DEVNULL
        )
    return None
