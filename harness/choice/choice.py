"""Renders a picture within an error: finds the quickest method, renders with it, and compares the picture with a truth.

What a method promises and what its picture keeps are measured apart, against truths with other seeds.
"""

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from harness.choice import search, trial
from harness.judge import judge
from harness.judge.truth import Truth
from harness.picture import picture
from harness.process import repetition
from harness.race import turns
from harness.race.audit import LEAST_FRAME, Audit, Task
from harness.renderer.job import fingerprint
from harness.renderer.parameters import NAMES
from harness.single import single
from harness.store import record

FAR = 2.0  # times the limit: from such a miss on, tiles are no longer trusted
MEASURING = 0.4  # of the time that is left is for measuring methods, the rest for the picture and its truth
COMPILED = 10.0  # s that a picture must take for a program that is compiled for it alone
PROCESSES = 5  # that time a method which is told at the end: the least that an interval needs
TIMING = 4.0  # s that the processes beside the one that made the picture may take; else there is no interval
BRIEF, FRAMES = 0.1, 5  # s of a frame of which a process renders so many more
START = 0.3  # s that a process takes to begin and end, about


@dataclass(frozen=True)
class Made:
    """A picture that was made: its method, Result, facts for JSON, `error` of a record, and its times."""

    method: trial.Method
    result: repetition.Result
    facts: dict
    error: dict
    times: turns.Times

    @property
    def most(self) -> float:
        """What its error is at most, as far as the truth is known."""
        return self.error["rmse"] + self.error["rmse_standard_error"] + record.doubt(self.error)


class Choice:
    """The pictures that are made until one is within the error. measured: methods that a run has measured, the quickest
    first (reports/accuracy/advice.py). variant, fixed: as of Search. folder: for series.
    """

    def __init__(
        self, test: trial.Trial, variant: str, fixed: frozenset, out: Path, frames: int, measured: list, audit: Audit,
        folder: Path,
    ):  # fmt: skip
        self.test, self.variant, self.fixed, self.out = test, variant, fixed, out
        self.frames, self.audit, self.folder = frames, audit, folder
        self.measured, self.search, self.made, self.said = measured, None, [], []
        self.whole: Truth | None = None

    @property
    def best(self) -> Made | None:
        return min(self.made, key=lambda made: made.error.get("rmse", math.inf), default=None)

    def work(self) -> str:
        """Makes pictures until one is within the limit; "" or what is wrong with the best."""
        try:
            for method in self.methods():
                self._make(method)
                if self.made[-1].most <= self.test.limit:
                    return ""
            return self._missed() if self.made else self._none()
        except trial.CannotTell as why:
            return f"cannot tell whether an RMSE of {self.test.limit:.3g} is kept: {why}"
        except trial.TimeUp:
            if not self.made:
                return "the time is up before a picture was made; give more of it (--max-seconds, --timeout)"
            if "rmse" not in self.made[-1].error:
                return "cannot tell: the time is up before the truth of the picture was known; give more of it"
            return f"the time is up; {self._missed()}"

    def methods(self) -> Iterator[trial.Method]:
        """Methods to try, one after the other: what a run measured, then what is measured here."""
        yield from self._of_run()
        tried = set()
        while True:
            began, shots, end = time.monotonic(), self.test.shots, self.test.end
            self.test.end = began + self.test.left * MEASURING
            far = self.made and self.made[-1].most > FAR * self.test.limit
            try:
                if self.search is None or (far and len(self.search.places) > 1):
                    self.search = search.Search(self.test, self.variant, self.fixed, whole=bool(far))
                    tried.clear()
                method = self.search.choose()
            except trial.TimeUp:
                method = self.search and self.search.guess
                if method is None:
                    raise
            finally:
                self.test.end = end
            places = self.search.places
            where = f"{len(places)} tiles" if len(places) > 1 else "the whole picture"
            count, took = len(self.search.tried), time.monotonic() - began
            self.said.append(f"measured {count} methods on {where} in {took:.1f} s ({self.test.shots - shots} jobs)")
            if method is None or method in tried:
                return
            tried.add(method)
            yield method
            last = self.made[-1].error
            self.search.learn(method, last["rmse"] + last["rmse_standard_error"])

    def _of_run(self) -> Iterator[trial.Method]:
        for row in self.measured:
            if row.rmse + search.SURE * row.standard_error > self.test.limit or row.variant not in self.test.entries:
                continue
            values = {name: value for name, value in row.parameters.items() if name in NAMES}
            job, entry = replace(self.test.parameters, **values), self.test.entries[row.variant]
            if entry.unavailable or repetition.unsupported(entry, job, self.test.needs_of(job)):
                continue
            self.said.append(f"{row.run} has measured {len(self.measured)} methods of this picture")
            yield trial.Method(entry, job, row.rmse, row.standard_error, row.seconds)

    def _make(self, method: trial.Method) -> None:
        """Renders with a method, and compares the picture with the truth. The best picture is the one that is saved."""
        test, entry = self.test, method.entry
        if test.left <= 0:
            raise trial.TimeUp
        alone = "kernel" in self.fixed or method.seconds > COMPILED
        kernel = test.parameters.kernel if alone else method.parameters.kernel
        frames = max(self.frames, FRAMES if method.seconds < BRIEF else 1)  # without a second one there is no time
        job = replace(method.parameters, kernel=kernel, threads=test.threads or entry.threads())
        job = replace(job, frames=frames, least_frame=LEAST_FRAME)
        before = self.best
        scene = fingerprint(test.arrays)
        task = Task(entry, test.arrays, job, test.needs_of(job), scene, fingerprint({}, scene, job), test.left)
        times = turns.Times(task)
        result = times.repeat(self.audit, self.folder / f"{len(self.made)}.csv")
        facts = single.save(entry, test.arrays, job, result, self.out)
        self.made.append(Made(method, result, facts, {"unavailable": "not known in time"}, times))
        if broken := judge.broken(result):
            raise trial.CannotTell(f"its picture is broken: {broken}")
        bounds = [test.parameters.bounds()]
        if self.whole is None or not test.is_clear(result.array, self.whole):
            side = self.search.side_for(test.limit / trial.FIRST) if self.search else 4
            self.whole, _ = test.truth(bounds, side, trial.LATER, of=result.array)
        truth_facts = {"truth": self.whole.maker, "against": test.against, **self.whole.facts()}
        error = {**truth_facts, **test.error(result.array, self.whole, bounds)}
        self.made[-1] = replace(self.made[-1], error=error)
        if before and self.best is before:
            picture.save(self.out, before.result.array, test.parameters.arithmetic)

    def time(self) -> None:
        """Times the methods of the pictures that were made in further processes, in turn, if that takes little."""
        expected = sum(made.result.outcome.wall_s + START for made in self.made) * (PROCESSES - 1)
        if expected <= min(TIMING, self.test.left):
            turns.more([made.times for made in self.made], PROCESSES - 1, self.audit)

    def facts(self, wrong: str) -> dict:
        """Returns what was done, for JSON. wrong: as `work` returns it."""
        best = self.best
        tried = {
            method.name: method.record() for method in (self.search.tried.values() if self.search else ()) if method
        }
        pictures = [{**made.method.record(), "error": made.error, "time": made.times.record()} for made in self.made]
        expected = best and {"rmse": best.method.rmse, "standard_error": best.method.standard_error}
        return {
            **(best.facts if best else {"picture": None}),
            "method": best and best.method.name,
            "expected": expected,
            "job": best and best.method.parameters.values(),
            "error": best.error if best else {"unavailable": wrong},
            "time": best.times.record() if best else {"unavailable": wrong},
            "tried": list(tried.values()),
            "pictures": pictures,
            "said": self.said,
        }

    def _missed(self) -> str:
        """By how much the best picture misses, and what is in the way."""
        over = self.best.most - self.test.limit
        missed = f"no method is known to be within {self.test.limit:.3g}; the picture kept misses it by {over:.2g}"
        return missed + self._in_the_way()

    def _none(self) -> str:
        """Why there is nothing to try; the most accurate method makes the picture that is kept."""
        best = min(self.search.measured, key=lambda method: method.rmse, default=None)
        if best is None:
            return "nothing could be measured" + self._in_the_way()
        self._make(best)
        return "" if self.best.most <= self.test.limit else self._missed()

    def _in_the_way(self) -> str:
        try:
            names = self.search.in_the_way() if self.search else []
        except trial.TimeUp:
            names = []
        options = ", ".join(f"--{name.replace('_', '-')}" for name in names)
        return f"; in the way: {options}" if options else ""
