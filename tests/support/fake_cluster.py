"""A cluster without a scheduler: jobs are done in this process when their State is asked for, on made-up hosts."""

import time

from harness.cluster import part
from harness.executors import State
from harness.machine import environment

REAL = environment.capture


class Cluster:
    """An Executor (harness/executors). hosts: names, one for each job in turn; None: this one.

    `stop_after`: {number of a batch: repetitions after which its job is stopped, as by scancel}. `dead`: numbers of
    batches whose jobs die without a word. `held`: jobs wait. `done`: numbers of the batches that were worked on.
    """

    def __init__(self, monkeypatch, hosts=(None,), most=None):
        self.patch, self.hosts, self.most = monkeypatch, list(hosts), most
        self.jobs, self.ends = {}, {}
        self.stop_after, self.dead, self.held = {}, set(), False
        self.done, self.cancelled = [], []

    def submit(self, work, folder, numbers):
        for number in numbers:
            name = f"{100 + len(self.jobs)}"
            self.jobs[name] = work, folder, number
            yield number, name

    def states(self, jobs):
        if not self.held:
            for name in jobs:
                if name not in self.ends:
                    self.ends[name] = self._do(name)
        return {name: self.ends.get(name, State("waiting", reason="Priority")) for name in jobs}

    def cancel(self, jobs):
        self.cancelled += jobs
        self.ends |= dict.fromkeys(jobs, State("ended", "", "CANCELLED", "was cancelled (scancel)"))

    def _do(self, name):
        work, folder, number = self.jobs[name]
        self.done.append(number)
        host = self.hosts[(int(name) - 100) % len(self.hosts)]
        with self.patch.context() as patch:
            if host:
                patch.setattr(environment, "capture", lambda: {**REAL(), "host": host})
                patch.setattr(part.socket, "gethostname", lambda: host)
            patch.setattr(part, "job_name", lambda: name)
            patch.setattr(part, "STARTED", time.monotonic())  # these tests may have run for longer than a job may
            patch.setattr(part, "heed", lambda *_: None)
            told = 0

            def count(*_):
                nonlocal told
                told += 1
                if told == self.stop_after.get(number):
                    raise part.Stopped("SIGTERM: cancelled, pre-empted, or at the end of its time")

            patch.setattr(part, "_print", count)
            if number in self.dead:
                return State("ended", host or "", "NODE_FAIL", "lost its host")
            try:
                work(str(folder), number)
            except SystemExit:
                if number in self.stop_after:
                    return State("ended", host or "", "CANCELLED", "was cancelled (scancel)")
                return State("ended", host or "", "FAILED", "failed (exit 1)")
        return State("ended", host or "", "COMPLETED")
