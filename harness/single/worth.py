"""Measures what each leave-out is worth: the error that it makes and the time and memory that it saves.

Errors are distances from the truth of the full scene (ERR-1). Full and reduced pictures have the same seed, hence the
same samples wherever both draw them, and their times are measured as those of a run (harness/race/turns.py).
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from harness.errors import UserError
from harness.experiment.experiment import Reference as Wanted
from harness.judge import judge, truth
from harness.judge.cache import Kept
from harness.judge.truth import Truth
from harness.picture.perception import perceive
from harness.process.repetition import Result
from harness.race import turns
from harness.race.audit import Audit, Task
from harness.race.turns import Times, kernels
from harness.reduction.leave_out import LeaveOut, apply
from harness.renderer.job import fingerprint
from harness.renderer.parameters import Parameters
from harness.renderer.registry import Entry
from harness.scene.flatten import flatten
from harness.scene.model import Scene
from harness.scene.needs import needs
from harness.single.single import general
from harness.statistics import change, statistics
from harness.statistics.change import Change


@dataclass
class Model:
    """A scene and its job, full or reduced, with what was measured of it: its times, and why it has no picture or time
    (broken, else "")."""

    scene: Scene
    job: Parameters
    broken: str = ""
    picture: np.ndarray | None = None
    times: Times | None = None

    def __post_init__(self):
        self.arrays, self.needs = flatten(self.scene), needs(self.scene, self.job)

    def shoot(self, entry: Entry, run: Callable, timeout: float) -> None:
        """Renders its picture, untimed, unless it is broken already. run: as Sessions.run.

        Pictures of a program that is built before it runs share the one that can do any job, which takes hardly longer
        to build than one for a single model. Times are of each model's own.
        """
        if self.broken:
            return
        job = replace(self.job, frames=0)
        if entry.renderer.manifest.build:
            job = general(entry, job)
        result = run(entry, self.arrays, job, self.needs, timeout=timeout, cache=kernels(entry))
        self.broken = _broken(result)
        self.picture = None if self.broken else result.array.astype(np.float64)

    def memory_over(self, full: "Model") -> float | None:
        """Ratio of the median peaks; None if the system does not tell."""
        peaks, its = self.times.peaks, full.times.peaks
        return float(np.median(peaks) / np.median(its)) if peaks and its else None


def _broken(result: Result) -> str:
    if result.status != "ok":
        return f"{result.status}: {result.reason}"
    return judge.broken(result) or ""


@dataclass(frozen=True)
class Worth:
    """What a leave-out changes, against the full model.

    error: judge.errors of the reduced picture. flip: between the two pictures. time: ratio of frames, reduced over
    full; faster: statistics.verdict of it. memory: ratio of median peaks; None if the system does not tell.
    doubts: about the time, in the words of a run. unavailable: "" or why there is nothing of this. picture: the reduced
    one.
    """

    name: str
    proof: str
    unavailable: str = ""
    change: Change | None = None
    error: dict = field(default_factory=dict)
    flip: float = 0.0
    time: statistics.Estimate | None = None
    faster: str = ""
    memory: float | None = None
    doubts: list[str] = field(default_factory=list)
    picture: np.ndarray | None = field(default=None, compare=False, repr=False)

    @property
    def verdict(self) -> str:
        """Whether the picture needs it: what was proved is told apart from what was measured."""
        if self.unavailable:
            return f"unavailable: {self.unavailable}"
        return self.change.verdict(self.proof)

    def record(self) -> dict:
        """For JSON."""
        facts = {"left_out": self.name, "verdict": self.verdict, "proof": self.proof or None}
        if self.unavailable:
            return {**facts, "unavailable": self.unavailable}
        time = {"ratio": self.time.value, "low": self.time.low, "high": self.time.high, "verdict": self.faster}
        time |= {"doubts": self.doubts}
        memory = {"unavailable": "the peak is not known"} if self.memory is None else self.memory
        changes = {"pixels": self.change.pixels, "largest": self.change.largest, "flip": self.flip}
        squared = {"mean_squared_error_added": self.change.added, "standard_error": self.change.doubt}
        return {**facts, **changes, "error": self.error, **squared, "time": time, "memory_ratio": memory}


@dataclass(frozen=True)
class Study:
    """The full model, its error from its truth, the noise floor of the times, and the worth of each leave-out.

    times: of all models, the full one twice."""

    full: Model
    truth: Truth
    error: dict
    floor: statistics.Floor
    worths: list[Worth]
    times: list[Times]


def truth_of(full: Model, entries: dict[str, Entry], kept: Kept, run: Callable) -> Truth:
    """The truth of a full scene, from the cache or made. run: as Sessions.run. UserError if it cannot be made."""
    wanted = Wanted()
    (truth_job,) = truth.jobs([full.job], wanted, lambda job: needs(full.scene, job)).values()
    maker = truth.choose(entries, truth_job)
    if maker is None:
        raise UserError(f"no renderer here can make the truth of this scene, of {', '.join(truth.MAKERS)}")
    key = truth.key(truth_job.shown, wanted, maker, fingerprint(full.arrays))
    stored = kept.get(key)
    if stored and (stored_truth := Truth.restored(*stored)).serves(truth_job):
        return stored_truth
    try:
        made = truth.make(truth_job, maker, full.arrays, kernels(maker), run)
    except LookupError as error:
        raise UserError(str(error)) from None
    kept.put(key, *made.stored())
    return made


@dataclass(frozen=True, eq=False)
class Way:
    """Who renders, and how pictures and times are made. run: as Sessions.run, for pictures; timeout: s, of each job;
    audit: times processes, so many of each model. Host.exclusive is held."""

    entry: Entry
    run: Callable
    timeout: float
    audit: Audit
    processes: int


def measure(full: Model, true: Truth, way: Way, listed: list[LeaveOut]) -> Study:
    """What each of the `listed` leave-outs of the full model is worth. UserError if the full model has no picture.

    In each round the full model runs twice, as the noise floor asks.
    """
    again = Model(full.scene, full.job)
    reduced = [Model(*apply([leave_out], full.scene, full.job), leave_out.unavailable) for leave_out in listed]
    shoot_full(full, way)
    for model in reduced:
        model.shoot(way.entry, way.run, way.timeout)
    times = take([full, *reduced, again], way)
    must_have(way, full, again)
    floor = turns.floor(full.times, again.times)
    error = judge.errors(full.picture, true.picture, true.standard_error, None, true.doubt)
    worths = [_worth(leave_out, model, full, true, floor) for leave_out, model in zip(listed, reduced, strict=True)]
    return Study(full, true, error, floor, worths, times)


def shoot_full(full: Model, way: Way) -> None:
    """Renders the picture of the full model, unless it has one. UserError if it cannot be."""
    if full.picture is None:
        full.shoot(way.entry, way.run, way.timeout)
    if full.broken:
        raise UserError(f"{way.entry.name} has no picture of the full scene: {full.broken}")


def take(models: list[Model], way: Way, processes: int | None = None) -> list[Times]:
    """Times the models that have a picture, in turn (turns.py), and returns their times. processes: in place of the
    way's."""
    whole = [model for model in models if not model.broken]
    tasks = []
    for model in whole:
        scene, name = fingerprint(model.arrays), fingerprint(model.arrays, model.job)
        tasks.append(Task(way.entry, model.arrays, model.job, model.needs, scene, name, way.timeout))
    timings = turns.take(tasks, processes or way.processes, way.audit)
    for model, times in zip(whole, timings, strict=True):
        model.times, model.broken = times, times.broken
    return timings


def must_have(way: Way, *models: Model) -> None:
    """UserError if one of these models, which must be there, has no time."""
    if broken := next((model.broken for model in models if model.broken), ""):
        raise UserError(f"{way.entry.name} has no time of a frame to compare with: {broken}")


def _worth(leave_out: LeaveOut, model: Model, full: Model, true: Truth, floor: statistics.Floor) -> Worth:
    if model.broken:
        return Worth(leave_out.name, leave_out.proof, model.broken)
    try:
        ratio = turns.ratio(model.times, full.times)
    except UserError as error:
        return Worth(leave_out.name, leave_out.proof, str(error))
    return Worth(
        leave_out.name,
        leave_out.proof,
        change=change.between(model.picture, full.picture, true.picture, true.standard_error, true.doubt),
        error=judge.errors(model.picture, true.picture, true.standard_error, None, true.doubt),
        flip=perceive(model.picture, full.picture).flip,
        time=ratio,
        faster=statistics.verdict(ratio, floor.value),
        memory=model.memory_over(full),
        doubts=model.times.doubts,
        picture=model.picture,
    )
