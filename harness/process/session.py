"""Keeps the processes of renderers for further jobs (`--jobs` of renderers/README.md), where nothing is timed.

Starting an interpreter, importing and compiling take most of the time of a small job. A renderer whose manifest says
`jobs` does one job after the other in one process; any other gets a process for each job.
"""

import contextlib
import dataclasses
import os
import time
from collections import OrderedDict
from collections.abc import Callable
from pathlib import Path

import numpy as np

from harness.process import process, repetition
from harness.process.repetition import Result
from harness.process.scratch import remove, scratch
from harness.renderer import events, job
from harness.renderer.builder import BuildError, Built
from harness.renderer.job import fingerprint
from harness.renderer.limits import DEFAULT, Limits
from harness.renderer.parameters import Parameters
from harness.renderer.registry import Entry
from harness.system import output, ownership

APART = 4  # status of a job of a list that needs a process of its own
MOST = 6  # processes that are kept, of all renderers
WITHOUT_END = 1e9  # s
PAUSES = 0.0002, 0.005  # s between looks at the output, the first and the longest


class Session:
    """A process of one variant and one build that does a job at a time, until it is closed."""

    def __init__(self, entry: Entry, built: Built | None, cache: Path | None, limits: Limits):
        self.entry, self.cache, self.limits = entry, cache, limits
        self.jobs = self.read = self.lines = 0
        self.scene, self.place = "", None  # of the last job: its arrays, and where they are
        self.stack = contextlib.ExitStack()
        try:
            self.here = here = self.stack.enter_context(scratch())
            (here / "neutral").mkdir()
            os.mkfifo(here / "jobs")
            self.pipe = os.open(here / "jobs", os.O_RDWR)  # with O_WRONLY it would wait for the renderer
            self.stack.callback(os.close, self.pipe)
            self.stdout, self.stderr = here / "stdout", here / "stderr"
            command = [*repetition.command_of(entry, built), f"--jobs={here / 'jobs'}"]
            files = here / "neutral", self.stdout, self.stderr
            self.process = self.stack.enter_context(
                process.Process(command, *files, WITHOUT_END, limits=limits, cache=cache, home=entry.renderer.home)
            )
            self.failed = self.process.begin()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """End the process, and remove its folder."""
        self.stack.close()

    def run(
        self,
        arrays: dict[str, np.ndarray],
        parameters: Parameters,
        needs: tuple[str, ...],
        timeout: float,
        log: Path | None,
    ) -> Result | None:
        """The Result of one job; None if the renderer wants another process for it. `failed` is set if this one ended.

        Its Outcome has the times of the job and no processor time or memory, which are those of all jobs together.
        """
        here = self._place(arrays)
        self.jobs += 1
        given = repetition.write_job(self.entry, here, arrays, parameters, needs)
        sealed = job.seal(here / "job")
        own = self.cache or self.here / "cache"
        ownership.make(own)
        words = job.flags(here / "job", here / "out", self.entry.variant.name, own, parameters, given)
        read, errors = self.read, self.stderr.stat().st_size
        start = time.monotonic() if self.jobs > 1 else self.process.started["spawned"]  # its import is of the first
        deadline = time.monotonic() + timeout
        os.write(self.pipe, "".join(f"{word}\n" for word in [*words, ""]).encode())
        said, outcome = self._wait(start, deadline)
        if outcome is None and said.end == APART:
            result, self.scene = None, ""
        else:
            outcome = outcome or _outcome(start, time.monotonic(), said.end)
            fault, text = repetition.tampered(here, sealed), repetition.end_of(self.stderr, errors)
            self.scene = self.scene if fault is None else ""
            result = repetition.collect(outcome, said, text, fault, here / "out", parameters, needs, arrays)
            printed = self.read - read + self.stderr.stat().st_size - errors
            if printed > self.limits.output:  # the launcher looks now and then
                why = self.limits.excess("output", printed, self.limits.output)
                result = Result("failed", why, outcome, said)
            for path, first in ((self.stdout, read), (self.stderr, errors)) if log else ():
                with open(path, "rb") as source:
                    source.seek(first)
                    output.data(Path(f"{log}.{path.name}"), source.read(self.limits.output))
        remove(here / "out")
        return result

    def _place(self, arrays: dict[str, np.ndarray]) -> Path:
        """The folder for a job. Its arrays stay for the next job of the scene, if this one leaves them as they were: to
        write them takes longer than to render a small picture."""
        scene = fingerprint(arrays)
        if scene != self.scene:
            if self.place:
                remove(self.place)
            self.scene, self.place = scene, self.here / str(self.jobs)
            self.place.mkdir()
        elif (self.place / "out").exists():  # of a job that was interrupted
            remove(self.place / "out")
        return self.place

    def _wait(self, start: float, deadline: float):
        """What the renderer says until the end of a job, and the Outcome of the process if that ended first."""
        said, rest, pause = events.Said(), b"", PAUSES[0]
        while True:
            over = self.process.ended(pause) or time.monotonic() > deadline  # what it said before is read now
            *lines, rest = (rest + self._output()).split(b"\n")
            for line in lines:
                self.lines += 1
                events.take(said, line, self.lines)
            if said.end is not None:
                return said, None
            if over:
                late = not self.process.ended(0)
                self.process.stop()
                outcome = self.process.end()
                self.failed = outcome.failed or "it has ended"
                return said, dataclasses.replace(outcome, spawned=start, timed_out=late)
            pause = min(2 * pause, PAUSES[1])

    def _output(self) -> bytes:
        with open(self.stdout, "rb") as file:
            file.seek(self.read)
            data = file.read()
        self.read += len(data)
        return data


def _outcome(start: float, end: float, status: int) -> process.Outcome:
    return process.Outcome(
        failed=None, spawned=start, exited=end, code=status, signal=None, timed_out=False, user_s=None, system_s=None,
        wait4_peak_bytes=None, wait4_floor_bytes=None, measurer=None,
    )  # fmt: skip


class Sessions:
    """Runs jobs as repetition.run does, in processes that are kept for further jobs. Close it at the end (a context).

    Not for what is timed: a process that has done other jobs is warm.
    """

    def __init__(self):
        self.kept: OrderedDict[tuple, Session] = OrderedDict()  # the last used last

    def __enter__(self) -> "Sessions":
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def close(self) -> None:
        """End all processes."""
        while self.kept:
            self.kept.popitem()[1].close()

    def run(
        self,
        entry: Entry,
        arrays: dict[str, np.ndarray],
        parameters: Parameters,
        needs: tuple[str, ...],
        timeout: float = 600.0,
        cache: Path | None = None,
        log: Path | None = None,
        limits: Limits = DEFAULT,
    ) -> Result:
        """The Result of a job, as of repetition.run; without processor time and memory where its process did others."""
        if entry.unavailable or repetition.unsupported(entry, parameters, needs):
            return repetition.run(entry, arrays, parameters, needs)
        return self.start(entry, arrays, parameters, needs, timeout, cache, log, limits)

    def start(self, entry, arrays, parameters, needs, timeout=600.0, cache=None, log=None, limits=DEFAULT) -> Result:
        """`run` without asking the manifest first whether the renderer can do the job."""
        job, result = (arrays, parameters, needs, timeout), None
        if entry.renderer.manifest.jobs and hasattr(os, "mkfifo"):
            with contextlib.suppress(BuildError):  # which repetition.start reports
                built = entry.renderer.build(parameters, needs)
                key = entry.renderer.folder, entry.name, built and built.folder, cache, repr(limits)
                result = self._kept(key, lambda: Session(entry, built, cache, limits), *job, log)
        return result or repetition.start(entry, *job, cache=cache, log=log, limits=limits)

    def _kept(self, key: tuple, make: Callable[[], Session], *job) -> Result | None:
        """The Result of a job in a process that is kept, or that `make` starts; None if it must have one of its own.

        A job that fails after others is done again alone: they may be why.
        """
        for own in reversed([own for own in self.kept if own[:-1] == key]):
            session, result = self._try(own, job)
            if result:
                return result if result.status in ("ok", "unsupported") else None
            if session.failed:
                return None
        while len(self.kept) >= MOST:
            self.kept.popitem(last=False)[1].close()
        own = *key, object()
        self.kept[own] = make()
        return self._try(own, job)[1]

    def _try(self, own: tuple, job: tuple) -> tuple[Session, Result | None]:
        session = self.kept[own]
        self.kept.move_to_end(own)
        result = None if session.failed else session.run(*job)
        if session.failed:
            self.kept.pop(own).close()
        return session, result
