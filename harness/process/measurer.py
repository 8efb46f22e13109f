"""Watches one renderer from a process of its own: CPU time, memory and GPU at absolute deadlines.

`python -m harness.process.measurer SERIES.csv INTERVAL [WHY]`; WHY: the reason why no GPU is asked. Prints "ready",
reads one JSON line {"pid", "spawned", "launcher"} from standard input, and samples until a second line comes,
{"exited"}: the renderer has ended and is not reaped. It then looks at the dead once more and prints its audit of itself
as one JSON line. It also stops, without that last look, if the renderer is gone or standard input closes.

The series has one row a tick: t (s since the start of the renderer), cpu_s (CPU time used so far by the process and
its descendants, the ended ones included), rss_bytes, vms_bytes, threads (sums over the living), pss_bytes (their
resident memory with shared pages counted once, and its files in memory; while there is more than one process, or such
a file: launcher.MemoryFiles), package_energy_j (that the processor's
packages have used, whoever used it: rapl.py), and the columns of gpu.SERIES. An empty
field is a value that the system does not tell; the audit's `gpu` says why of each column of the GPU, and its
`gpu_sources` which call of NVML the others are from. The last row is of the end itself: the CPU time of the dead.

The audit: ticks, missed (deadlines), interval_s (asked for), interval_p50_s, interval_p99_s (realised), cpu_s (used by
the measurer itself), saw_end, resolution_s (of the last cpu_s), processes (the most that lived at once), mark_bytes
(the largest VmHWM of the renderer that it saw; null if none), pss_peak_bytes and vms_peak_bytes (the largest pss_bytes
and vms_bytes; null if none), files_peak_bytes (of its files in memory, the most at once), package_energy (null, or why
there is none).
"""

import csv
import itertools
import json
import os
import select
import sys
import time
from dataclasses import dataclass, field

import psutil

from harness.process.family import Family
from harness.system.gpu import SERIES, Gpu
from harness.system.rapl import Rapl

COLUMNS = ("t", "cpu_s", "rss_bytes", "vms_bytes", "threads", "pss_bytes", "package_energy_j", *SERIES)


@dataclass
class Watch:
    """The result of watching a renderer. Times in s on the monotonic clock."""

    ticks: list[float] = field(default_factory=list)
    missed: int = 0
    saw_end: bool = False
    family: Family | None = None


def watch(target: dict, interval: float, writer, gpu: Gpu, rapl: Rapl, words) -> Watch:
    """Sample `target` into the rows of `writer` until the end. words: the file, unbuffered, that tells of it."""
    seen = Watch()
    try:
        seen.family = family = Family(target["pid"], target["launcher"])
    except psutil.NoSuchProcess:
        return seen
    start, tick, pause = time.monotonic(), 0, 0.0
    while not select.select([words], [], [], max(0.0, pause))[0]:
        now = time.monotonic()
        sample = family.sample(now)
        if sample is None:
            break
        seen.ticks.append(now)
        _write(writer, now - target["spawned"], *sample, rapl.joules(), *gpu.sample(family.pids, now))
        tick += 1
        late = int((time.monotonic() - start) / interval) - tick + 1
        if late > 0:
            seen.missed += late
            tick += late
        pause = start + tick * interval - time.monotonic()
    line = words.readline()
    cpu = family.last() if line else None
    if cpu is not None:
        seen.saw_end = True
        _write(writer, json.loads(line)["exited"] - target["spawned"], cpu, *[None] * (len(COLUMNS) - 2))
    return seen


def _write(writer, t: float, *values) -> None:
    writer.writerow([f"{t:.6f}", *("" if value is None else value for value in values)])


def main(path: str, interval: float, without_gpu: str = "") -> None:
    gpu, rapl = Gpu(without_gpu), Rapl()
    words = open(0, "rb", buffering=0, closefd=False)  # noqa: SIM115  what a buffer holds, select does not see
    print("ready", flush=True)
    line = words.readline()
    if not line:
        return
    used_before = time.process_time()
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        seen = watch(json.loads(line), interval, writer, gpu, rapl, words)
    gaps = sorted(b - a for a, b in itertools.pairwise(seen.ticks))
    audit = {
        "ticks": len(seen.ticks),
        "missed": seen.missed,
        "interval_s": interval,
        "interval_p50_s": gaps[len(gaps) // 2] if gaps else None,
        "interval_p99_s": gaps[min(len(gaps) - 1, int(0.99 * len(gaps)))] if gaps else None,
        "cpu_s": time.process_time() - used_before,
        "saw_end": seen.saw_end,
        "resolution_s": seen.family.resolution if seen.family else None,
        "processes": seen.family.most if seen.family else None,
        "mark_bytes": seen.family.mark if seen.family else None,
        "pss_peak_bytes": seen.family.pss if seen.family else None,
        "vms_peak_bytes": seen.family.vms if seen.family else None,
        "files_peak_bytes": seen.family.files_peak if seen.family else None,
        "package_energy": rapl.unavailable,
        "gpu": gpu.states(),
        "gpu_sources": gpu.sources(),
    }
    print(json.dumps(audit), flush=True)


if __name__ == "__main__":
    try:
        main(sys.argv[1], float(sys.argv[2]), *sys.argv[3:])
    except BrokenPipeError:  # the harness is gone
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # else Python tries again when it ends, and complains
        sys.exit(1)
    except OSError as error:
        sys.exit(f"measurer: {sys.argv[1]}: {error.strerror}")
