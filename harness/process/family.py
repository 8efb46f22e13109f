"""CPU time, memory and threads of a renderer and its descendants, as the system reports them.

The renderer's parent, the launcher, gets its orphans and reaps nothing before it is told to. So whoever is below the
launcher is of the family, and the dead whom nobody has waited for are there to be counted, the renderer among them.
"""

import contextlib
import math
import os
import time
from typing import NamedTuple

import psutil

from harness.process.launcher import MemoryFiles, shared_once, sizes

TICK = 1 / os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 0.01  # s: resolution of CPU times in /proc/PID/stat
WALK_INTERVAL = 0.5  # s between looks for descendants where only a walk over all processes finds them
PSS_SHARE = 0.05  # of the time; to sum the pages of a process up takes 1 ms for some 100 MB, while it may not map more


class Sample(NamedTuple):
    """Sums over a family. Memory in bytes."""

    cpu_s: float  # since the start, the dead included
    rss: int  # of the living, as all that follow
    vms: int
    threads: int
    pss: int | None  # resident memory, shared pages counted once, and files in memory; None if it is rss, or unknown


class Family:
    def __init__(self, pid: int, launcher: int):
        """psutil.NoSuchProcess if there is no such process."""
        self.root, self.launcher = psutil.Process(pid), launcher
        self.lists_children = os.path.exists(f"/proc/{launcher}/task/{launcher}/children")
        self.members = {pid: self.root}  # the root first
        self.looked = self.pss_due = -math.inf
        self.cpu_s = 0.0
        self.most = 0  # processes living at once
        self.mark = None  # bytes: the largest VmHWM of the root, None if never seen
        self.pss = self.vms = None  # bytes: the largest sums
        self.files, self.files_due, self.files_size, self.files_peak = MemoryFiles(), -math.inf, 0, 0

    @property
    def pids(self) -> frozenset[int]:
        return frozenset(self.members)

    @property
    def resolution(self) -> float:
        """s that cpu_s may be wrong by: two counters of the dead children of each member are cut to ticks."""
        return 2 * TICK * len(self.members)

    def sample(self, now: float) -> Sample | None:
        """The family at `now` s on the monotonic clock; None once the root has ended."""
        self._look(now)
        cpu, rss, vms, threads, living = 0.0, 0, 0, 0, []
        for process in self.members.values():  # parents first: a death meanwhile must not be counted twice
            try:
                with process.oneshot():
                    cpu += _cpu(process)
                    if process.status() == psutil.STATUS_ZOMBIE:
                        raise psutil.ZombieProcess(process.pid)
                    memory, count = process.memory_info(), process.num_threads()
            except psutil.NoSuchProcess:
                if process is self.root:
                    return None
                continue
            rss, vms, threads = rss + memory.rss, vms + memory.vms, threads + count
            living.append(process.pid)
        self.cpu_s = max(self.cpu_s, cpu)  # a death may be seen late, and cuts its time to ticks
        self.most = max(self.most, len(living))
        self.vms = max(self.vms or 0, vms)
        mark = sizes(self.root.pid, "status", "VmHWM:")[0]
        self.mark = max(filter(None, (self.mark, mark)), default=None)
        return Sample(self.cpu_s, rss, vms, threads, self._shared_once(living, rss, now))

    def last(self) -> float | None:
        """CPU time (s) of the family when all have ended and none is reaped; None if the root is gone."""
        self._look(math.inf)
        if not psutil.pid_exists(self.root.pid):
            return None
        cpu = 0.0
        for process in self.members.values():
            with contextlib.suppress(psutil.NoSuchProcess):
                cpu += _cpu(process)
        self.cpu_s = max(self.cpu_s, cpu)
        return self.cpu_s

    def _shared_once(self, living: list[int], rss: int, now: float) -> int | None:
        files = self._files(living, now)
        if len(living) == 1 and files:
            pss = rss + max(0, files - sizes(living[0], "status", "RssShmem:")[0])
            self.pss = max(self.pss or 0, pss)
            return pss
        if len(living) < 2 or now < self.pss_due:
            return None
        start = time.process_time()
        pss = shared_once(living, files) or None  # None: the system does not tell
        self.pss_due = now + (time.process_time() - start) / PSS_SHARE
        self.pss = max(self.pss or 0, pss or 0) or None
        return pss

    def _files(self, living: list[int], now: float) -> int:
        """Bytes of the family's files in memory, as they were at most 20 times as long ago as looking takes."""
        if now >= self.files_due:
            start = time.process_time()
            self.files_size = self.files.size(living)
            self.files_peak = max(self.files_peak, self.files_size)
            self.files_due = now + (time.process_time() - start) / PSS_SHARE
        return self.files_size

    def _look(self, now: float) -> None:
        """Bring `members` up to date."""
        if self.lists_children:
            pids = [self.root.pid, *(child for child in _children(self.launcher) if child != self.root.pid)]
            for pid in pids:  # which grows meanwhile
                pids += _children(pid)
        elif now - self.looked >= WALK_INTERVAL:
            self.looked = now
            pids = [self.root.pid]
            with contextlib.suppress(psutil.NoSuchProcess):
                pids += (child.pid for child in psutil.Process(self.launcher).children(recursive=True))
        else:
            return
        previous, self.members = self.members, {}
        for pid in pids:
            with contextlib.suppress(psutil.NoSuchProcess):
                self.members[pid] = previous.get(pid) or psutil.Process(pid)


def _cpu(process: psutil.Process) -> float:
    """CPU time (s) of a process and the children it has waited for, its own to the nanosecond where it has a clock."""
    times = process.cpu_times()
    try:
        own = time.clock_gettime(~process.pid << 3 | 2)  # clock_getcpuclockid(3): CPUCLOCK_SCHED of all threads
    except (OSError, AttributeError):
        own = times.user + times.system
    return own + times.children_user + times.children_system


def _children(pid: int) -> list[int]:
    """Returns the children of all threads of a process, including dead ones that nobody has waited for."""
    children = []
    with contextlib.suppress(OSError):
        for thread in os.listdir(f"/proc/{pid}/task"):
            with contextlib.suppress(OSError), open(f"/proc/{pid}/task/{thread}/children", "rb") as listed:
                children += map(int, listed.read().split())
    return children
