"""Watches one renderer from a process of its own: CPU time, memory and GPU at absolute deadlines.

`python -m harness.measurer SERIES.csv INTERVAL`. Prints "ready", reads one JSON line {"pid", "spawned"} from standard
input, samples until that process is gone or standard input closes, then prints its audit of itself as one JSON line.

The series has one row a tick: t (s since the start of the renderer), cpu_s (CPU time used so far by the process and
its descendants, the ended ones included), rss_bytes, vms_bytes, threads (sums over the living), and the columns of
gpu.SERIES. An empty field is a value that the system does not tell; the audit's `gpu` says why of each column of the
GPU, and its `gpu_sources` which call of NVML the others are from.
"""

import csv
import itertools
import json
import select
import sys
import time

import psutil

from harness.gpu import SERIES, Gpu

COLUMNS = ("t", "cpu_s", "rss_bytes", "vms_bytes", "threads", *SERIES)
FAMILY_INTERVAL = 0.5  # s between looks for new descendants: a walk over all of /proc


class Family:
    """A process and its descendants. The Process objects are kept: a new one would forget what it has seen."""

    def __init__(self, pid):
        self.root = psutil.Process(pid)
        self.descendants = {}
        self.looked = 0.0

    @property
    def pids(self):
        return frozenset((self.root.pid, *self.descendants))

    def sample(self, now):
        """cpu_s, rss, vms, threads; None once the root has ended."""
        if now - self.looked >= FAMILY_INTERVAL:
            self.looked = now
            try:
                for child in self.root.children(recursive=True):
                    self.descendants.setdefault(child.pid, child)
            except psutil.NoSuchProcess:
                return None
        cpu = rss = vms = threads = 0
        for process in (self.root, *self.descendants.values()):
            try:
                with process.oneshot():
                    if process.status() == psutil.STATUS_ZOMBIE:
                        raise psutil.ZombieProcess(process.pid)
                    times, memory = process.cpu_times(), process.memory_info()
                    threads += process.num_threads()
            except psutil.NoSuchProcess:
                if process is self.root:
                    return None
                self.descendants.pop(process.pid, None)
                continue
            # the children_ times are of descendants that have ended and been waited for
            cpu += times.user + times.system + times.children_user + times.children_system
            rss += memory.rss
            vms += memory.vms
        return cpu, rss, vms, threads


def watch(pid, spawned, interval, writer, gpu):
    """Sample until the end; return the ticks' lateness and intervals."""
    try:
        family = Family(pid)
    except psutil.NoSuchProcess:
        return [], 0
    start = time.monotonic()
    ticks, missed, tick = [], 0, 0
    while True:
        now = time.monotonic()
        sample = family.sample(now)
        if sample is None:
            return ticks, missed
        ticks.append(now)
        row = (f"{now - spawned:.6f}", *sample, *gpu.sample(family.pids, now))
        writer.writerow("" if value is None else value for value in row)
        tick += 1
        late = int((time.monotonic() - start) / interval) - tick + 1
        if late > 0:
            missed += late
            tick += late
        pause = start + tick * interval - time.monotonic()
        if select.select([sys.stdin], [], [], max(0, pause))[0]:
            return ticks, missed


def main(path, interval):
    gpu = Gpu()
    print("ready", flush=True)
    line = sys.stdin.readline()
    if not line:
        return
    target = json.loads(line)
    used_before = sum(psutil.Process().cpu_times()[:2])
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        ticks, missed = watch(target["pid"], target["spawned"], interval, writer, gpu)
    gaps = sorted(b - a for a, b in itertools.pairwise(ticks))
    audit = {
        "ticks": len(ticks),
        "missed": missed,
        "interval_s": interval,
        "interval_p50_s": gaps[len(gaps) // 2] if gaps else None,
        "interval_p99_s": gaps[min(len(gaps) - 1, int(0.99 * len(gaps)))] if gaps else None,
        "cpu_s": sum(psutil.Process().cpu_times()[:2]) - used_before,
        "gpu": gpu.states(),
        "gpu_sources": gpu.sources(),
    }
    print(json.dumps(audit), flush=True)


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]))
