"""Renders a picture within an error: finds the quickest method, renders with it, and compares the picture with a truth.

What a method promises and what its picture keeps are measured apart, against truths with other seeds.
"""

import json
import math
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

from harness.errors import UserError
from harness.experiment import image
from harness.judge import judge
from harness.judge.truth import Truth
from harness.machine import environment
from harness.picture import picture
from harness.process import repetition
from harness.process.scratch import scratch
from harness.process.session import Sessions
from harness.race import turns
from harness.race.audit import LEAST_FRAME, Audit, Task
from harness.race.host import ThisHost
from harness.renderer import registry
from harness.renderer.job import fingerprint
from harness.renderer.parameters import Parameters
from harness.scene import load, warnings
from harness.scene.flatten import flatten
from harness.scene.needs import needs as needs_of
from harness.single import single, trial, within
from harness.store import record
from rayrace.terminal import show_reasons
from reports.paper import quantity

SEEN = ("width", "height", "region", "shadows", "lens_radius", "focal_distance", "arithmetic")  # what is in a picture
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
        return self.error["rmse"] + self.error["rmse_standard_error"] + (self.error["change"] or 0.0)


def render(scene, variant, out, asked, most, against, seconds, given, frames, timeout, folders, as_json) -> None:
    """Render `scene` to `out` with the quickest method whose RMSE is `most` or less, and print what it promised and
    what the picture keeps.

    asked: the Image of the options; given: names of those that the user gave. against: "scene" or "centres".
    seconds: in which all is to be done; 0: as many as a job may take (timeout). SystemExit(1) if no picture is within
    the limit, or nobody can tell; the best is kept.
    """
    from rayrace.run import results_folder
    from reports.accuracy import advice

    limit = error_limit("--max-error", most)
    if against not in ("scene", "centres"):
        raise UserError(f"--against {against}: expected scene or centres")
    picture.check_suffix(out)
    read, known = load(scene), registry.entries(folders)
    if variant:
        registry.find(variant, known)
    arrays, parameters = flatten(read, asked.arithmetic), asked.parameters(1, 0)
    fixed = frozenset(given & {*Parameters.__annotations__} - {*SEEN, "seed", "frames", "threads"})
    if against == "centres":
        if "sampler" in fixed and parameters.sampler != "one":
            raise UserError(f"--sampler {parameters.sampler}: not with --against centres, which have one sample")
        fixed |= {"feelers", "glossy_rays", "glossy_weight"}
    here, values = environment.capture(), parameters.values()
    wanted = advice.Wanted(
        scene=fingerprint(arrays),
        picture={name: values[name] for name in SEEN},
        against=against,
        given={name: values[name] for name in fixed if name in values},
        variant=variant,
        here={name: here[name] for name in ("host", "cpu")},
    )
    host = ThisHost()
    with host.exclusive(), Sessions() as sessions, scratch() as folder:
        began = time.monotonic()  # it may have waited for another measurement to end
        test = trial.Trial(
            arrays, lambda job: needs_of(read, job), parameters, known, limit, against, sessions.run,
            began + (seconds or timeout), None if asked.threads == "default" else asked.threads,
        )  # fmt: skip
        known_methods = advice.find(results_folder(), wanted)
        front = Front(test, variant, fixed, out, frames, known_methods, Audit(host), folder)
        wrong = front.work()
        front.time()
    front.tell(wrong, warnings(read), time.monotonic() - began, as_json)
    if wrong:
        raise SystemExit(1)


class Front:
    """The pictures of one command. found: what a run has measured, the quickest first. folder: for series."""

    def __init__(self, test: trial.Trial, variant: str, fixed, out, frames: int, found: list, audit, folder):
        self.test, self.variant, self.fixed, self.out = test, variant, fixed, out
        self.frames, self.audit, self.folder = frames, audit, folder
        self.found, self.search, self.made, self.said = found, None, [], []
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
        except trial.CannotTell as why:
            return f"cannot tell whether an RMSE of {self.test.limit:.3g} is kept: {why}"
        except trial.TimeUp:
            if not self.made:
                return "the time is up before a picture was made; give more of it (--max-seconds, --timeout)"
            if "rmse" not in self.made[-1].error:
                return "cannot tell: the time is up before the truth of the picture was known; give more of it"
            return f"the time is up; {self._missed()}"
        return self._missed() if self.made else self._none()

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
                    self.search = within.Search(self.test, self.variant, self.fixed, whole=bool(far))
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
        for one in self.found:
            if one.rmse + within.SURE * one.standard_error > self.test.limit or one.variant not in self.test.known:
                continue
            values = {name: value for name, value in one.parameters.items() if name in Parameters.__annotations__}
            job, entry = replace(self.test.asked, **values), self.test.known[one.variant]
            if entry.unavailable or repetition.unsupported(entry, job, self.test.needs_of(job)):
                continue
            self.said.append(f"{one.run} has measured {len(self.found)} methods of this picture")
            yield trial.Method(entry, job, one.rmse, one.standard_error, one.seconds)

    def _make(self, method: trial.Method) -> None:
        """Renders with a method, and compares the picture with the truth. The best picture is the one that is saved."""
        test, entry = self.test, method.entry
        if test.left <= 0:
            raise trial.TimeUp
        alone = "kernel" in self.fixed or method.seconds > COMPILED
        kernel = test.asked.kernel if alone else method.parameters.kernel
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
        bounds = [test.asked.bounds()]
        if self.whole is None or not test.is_clear(result.array, self.whole):
            side = self.search.side_for(test.limit / trial.FIRST) if self.search else 4
            self.whole, _ = test.truth(bounds, side, trial.LATER, of=result.array)
        told = {"truth": self.whole.maker, "against": test.against, **self.whole.facts()}
        error = {**told, **test.error(result.array, self.whole, bounds)}
        self.made[-1] = replace(self.made[-1], error=error)
        if before and self.best is before:
            picture.save(self.out, before.result.array, test.asked.arithmetic)

    def time(self) -> None:
        """Times the methods of the pictures that were made in further processes, in turn, if that takes little."""
        expected = sum(made.result.outcome.wall_s + START for made in self.made) * (PROCESSES - 1)
        if expected <= min(TIMING, self.test.left):
            turns.more([made.times for made in self.made], PROCESSES - 1, self.audit)

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

    def tell(self, wrong: str, warned: list[str], seconds: float, as_json: bool) -> None:
        """Prints what was done."""
        best = self.best
        tried = {
            method.name: method.record() for method in (self.search.tried.values() if self.search else ()) if method
        }
        pictures = [{**made.method.record(), "error": made.error, "time": made.times.record()} for made in self.made]
        if as_json:
            expected = best and {"rmse": best.method.rmse, "standard_error": best.method.standard_error}
            facts = best.facts if best else {"picture": None}
            told = {"method": best and best.method.name, "expected": expected}
            told["job"] = best and best.method.parameters.values()
            told["error"] = best.error if best else {"unavailable": wrong}
            told["time"] = best.times.record() if best else {"unavailable": wrong}
            told |= {"tried": list(tried.values()), "pictures": pictures, "seconds": seconds, "said": self.said}
            print(json.dumps({**facts, **told, "warnings": single.warn(warned)}))
        else:
            for line in self.said:
                print(line)
            for made in self.made:
                m = made.method
                print(f"{m.name}: RMSE {m.rmse:.2g} ± {m.standard_error:.1g} expected, about {m.seconds:.2g} s a frame")
                took = f"; {_time(made.times)}" if made is not best else ""
                print(f"{made.facts['picture']}: {record.error_of(made.error)}{_truth(made.error)}{took}")
            if best:
                single.tell(best.facts, best.method.parameters, _time(best.times))
            show_reasons([row for made in self.made for row in made.times.records])
            single.warn(warned)
        if wrong:
            print(f"error: {wrong}", file=sys.stderr)


def _time(times: turns.Times) -> str:
    """The time of a frame for people, with its interval, or why there is none."""
    broken = times.broken
    return f"time of a frame unavailable: {broken}" if broken else f"{quantity.seconds(times.seconds)} a frame"


def _truth(error: dict) -> str:
    if "unavailable" in error:
        return ""
    known = f", known to {error['uncertainty']:.2g}" if error["uncertainty"] else ""
    return f"; its truth is by {error['truth']}, {error['samples']} samples a pixel{known}"


def error_limit(option: str, most: str) -> float:
    """An error from 1/255, 0.001, .. as an option has it. UserError, with the option."""
    try:
        limit = image.number(most)
    except ValueError as fault:
        raise UserError(f"{option} {most}: {fault}") from None
    if not 0 < limit < math.inf:
        raise UserError(f"{option} {most}: expected more than 0")
    return limit
