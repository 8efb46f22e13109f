"""Measures what each leave-out is worth: the error that it makes and the time and memory that it saves.

Errors are distances from the truth of the full scene (ERR-1). Full and reduced pictures have the same seed, hence the
same samples wherever both draw them, and their times come from fresh processes in interleaved rounds.
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
from harness.process import repetition
from harness.process.repetition import Result
from harness.race import row
from harness.reduction.leave_out import LeaveOut, apply
from harness.renderer.job import fingerprint
from harness.renderer.parameters import Parameters
from harness.renderer.registry import Entry
from harness.scene.flatten import flatten
from harness.scene.model import Scene
from harness.scene.needs import needs
from harness.single.single import kernels
from harness.single.trial import general
from harness.statistics import change, statistics
from harness.statistics.change import Change


@dataclass
class Model:
    """A scene and its job, full or reduced, with what was measured of it.

    seconds: of a steady frame, one for each repetition; peaks: bytes, likewise. broken: "" or why it has no picture or
    time.
    """

    scene: Scene
    job: Parameters
    broken: str = ""
    picture: np.ndarray | None = None
    seconds: list[float] = field(default_factory=list)
    peaks: list[float] = field(default_factory=list)

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

    def repeat(self, entry: Entry, timeout: float) -> None:
        """Times it once more, in a fresh process, unless it has no picture."""
        if self.broken:
            return
        result = repetition.run(entry, self.arrays, self.job, self.needs, timeout, cache=kernels(entry))
        self.broken = _broken(result)
        if self.broken:
            return
        self.seconds.append(float(np.median([frame["end"] - frame["start"] for frame in result.said.frames[1:]])))
        peak = row.memory(result.said, result.outcome)["peak_bytes"]
        if peak is not None:
            self.peaks.append(peak)

    def memory_over(self, full: "Model") -> float | None:
        """Ratio of the median peaks; None if the system does not tell."""
        return float(np.median(self.peaks) / np.median(full.peaks)) if self.peaks and full.peaks else None


def _broken(result: Result) -> str:
    if result.status != "ok":
        return f"{result.status}: {result.reason}"
    return judge.broken(result) or ""


@dataclass(frozen=True)
class Worth:
    """What a leave-out changes, against the full model.

    error: judge.errors of the reduced picture. flip: between the two pictures. time: ratio of frames, reduced over
    full; faster: statistics.verdict of it. memory: ratio of median peaks; None if the system does not tell.
    unavailable: "" or why there is nothing of this. picture: the reduced one.
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
    picture: np.ndarray | None = field(default=None, compare=False, repr=False)

    @property
    def verdict(self) -> str:
        """Whether the picture needs it: what was proved is told apart from what was measured."""
        if self.unavailable:
            return f"unavailable: {self.unavailable}"
        return self.change.verdict(self.proof)

    def record(self) -> dict:
        """For JSON."""
        told = {"left_out": self.name, "verdict": self.verdict, "proof": self.proof or None}
        if self.unavailable:
            return {**told, "unavailable": self.unavailable}
        time = {"ratio": self.time.value, "low": self.time.low, "high": self.time.high, "verdict": self.faster}
        memory = {"unavailable": "the peak is not known"} if self.memory is None else self.memory
        changes = {"pixels": self.change.pixels, "largest": self.change.largest, "flip": self.flip}
        squared = {"mean_squared_error_added": self.change.added, "standard_error": self.change.doubt}
        return {**told, **changes, "error": self.error, **squared, "time": time, "memory_ratio": memory}


@dataclass(frozen=True)
class Study:
    """The full model, its error from its truth, the noise floor of the times, and the worth of each leave-out."""

    full: Model
    truth: Truth
    error: dict
    floor: statistics.Floor
    worths: list[Worth]


def truth_of(full: Model, known: dict[str, Entry], kept: Kept, run: Callable) -> Truth:
    """The truth of a full scene, from the cache or made. run: as Sessions.run. UserError if it cannot be made."""
    wanted = Wanted()
    (told,) = truth.jobs([full.job], wanted, lambda job: needs(full.scene, job)).values()
    maker = truth.choose(known, told)
    if maker is None:
        raise UserError(f"no renderer here can make the truth of this scene, of {', '.join(truth.MAKERS)}")
    key = truth.key(told.shown, wanted, maker, fingerprint(full.arrays))
    stored = kept.get(key)
    if stored and (found := Truth.restored(*stored)).serves(told):
        return found
    try:
        made = truth.make(told, maker, full.arrays, kernels(maker), run)
    except LookupError as error:
        raise UserError(str(error)) from None
    kept.put(key, *made.stored())
    return made


def measure(
    full: Model, true: Truth, entry: Entry, run: Callable, rounds: int, timeout: float, listed: list[LeaveOut]
) -> Study:
    """What each of the `listed` leave-outs of the full model is worth. run: as Sessions.run, for pictures; times are of
    fresh processes. UserError if the full model has no picture.

    In each round the full model runs twice, first and last, as the noise floor asks; every other round is reversed.
    """
    again = Model(full.scene, full.job)
    reduced = [Model(*apply([one], full.scene, full.job), one.unavailable) for one in listed]
    shoot_full(full, entry, run, timeout)
    for model in reduced:
        model.shoot(entry, run, timeout)
    interleaved([full, *reduced, again], entry, rounds, timeout)
    floor = statistics.noise_floor(full.seconds, again.seconds)
    error = judge.errors(full.picture, true.picture, true.standard_error, None, true.change)
    worths = [_worth(one, model, full, true, floor) for one, model in zip(listed, reduced, strict=True)]
    return Study(full, true, error, floor, worths)


def shoot_full(full: Model, entry: Entry, run: Callable, timeout: float) -> None:
    """Renders the picture of the full model, unless it has one. UserError if it cannot be."""
    if full.picture is None:
        full.shoot(entry, run, timeout)
    if full.broken:
        raise UserError(f"{entry.name} has no picture of the full scene: {full.broken}")


def interleaved(models: list[Model], entry: Entry, rounds: int, timeout: float) -> None:
    """Times the models in turn, every other round reversed. UserError if the first or the last, which must be there,
    breaks."""
    for number in range(rounds):
        for model in models if number % 2 == 0 else reversed(models):
            model.repeat(entry, timeout)
        if broken := models[0].broken or models[-1].broken:
            raise UserError(f"{entry.name} has no picture of the full scene: {broken}")


def _worth(one: LeaveOut, model: Model, full: Model, true: Truth, floor: statistics.Floor) -> Worth:
    if model.broken:
        return Worth(one.name, one.proof, model.broken)
    ratio = statistics.ratio(model.seconds, full.seconds, paired=True)
    return Worth(
        one.name,
        one.proof,
        change=change.between(model.picture, full.picture, true.picture, true.standard_error, true.change),
        error=judge.errors(model.picture, true.picture, true.standard_error, None, true.change),
        flip=perceive(model.picture, full.picture).flip,
        time=ratio,
        faster=statistics.verdict(ratio, floor.value),
        memory=model.memory_over(full),
        picture=model.picture,
    )
