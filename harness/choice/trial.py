"""Renders a picture, or tiles of it, by different methods and compares them with a truth. Nothing here is saved."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import count, islice

import numpy as np

from harness.experiment.experiment import Reference as Wanted
from harness.judge import depth, judge, truth
from harness.judge.truth import Truth
from harness.process.repetition import Result
from harness.race.turns import kernels
from harness.renderer.parameters import Parameters
from harness.renderer.registry import Entry
from harness.single.single import general
from harness.statistics import steady
from harness.store import record

ACROSS = 4  # tiles in a row, and in a column
SMALL = 4  # times the pixels of all tiles: of a picture with fewer the whole takes no longer, as it is one job
SIDES = 16, 64  # pixels of a tile's side, least and most
SHARE = 16  # a tile's side is so small a part of the picture's
KNOWN = 4  # the truth is known to this part of the error that is asked for
CLEAR, FIRST = 4, 2  # standard errors by which a verdict is clear; with that the truth need be known to this part alone
LATER = 2**16  # from which seed of the family on the truth of the whole picture has its own
MOST = 64  # samples of a side of a pixel in one picture of a truth
SMALL_THINGS = 0.5  # of an uncertainty at most: what no sample may have met

Bounds = tuple[int, int, int, int]


class CannotTell(Exception):
    """The truth cannot be known well enough; the reason."""


class TimeUp(Exception):
    """The user's time is up."""


@dataclass(frozen=True, eq=False)
class Method:
    """A way to make a picture.

    rmse: its error, linear RGB, and the standard error of that. seconds: of a frame of the whole picture, roughly: what
    a search compares methods by. What is told as a result is timed anew (harness/race/turns.py).
    """

    entry: Entry
    parameters: Parameters
    rmse: float
    standard_error: float
    seconds: float

    @property
    def name(self) -> str:
        """The variant and what it does, in words."""
        p = self.parameters
        count = p.spp if p.sampler == "sobol" else f"{p.samples} x {p.samples}"
        sampler = {"one": "one sample", "adaptive": f"adaptive to 1/{2**p.adaptive_depth} pixel"}
        lanes = {"on": "in lanes", "auto": "in lanes where that is quicker"}
        words = [self.entry.name, p.precision, lanes.get(p.vector, "")]
        words.append(sampler.get(p.sampler, f"{p.sampler} {count}"))
        words.append(f"threshold {p.adaptive_threshold:g}" * (p.sampler == "adaptive"))
        for number, what in (p.feelers, "feeler"), (p.glossy_rays, "glossy ray"):
            words.append(f"{number} {what}{'s' * (number > 1)}" * (number > 0))
        words += [f"depth {p.depth}", f"cut-off {p.cutoff:.3g}" * (p.cutoff > 0)]
        return ", ".join(filter(None, words))

    def record(self) -> dict:
        """For JSON."""
        facts = {"rmse": self.rmse, "rmse_standard_error": self.standard_error, "rough_seconds": self.seconds}
        return {"method": self.name, **facts}


def tiles(bounds: Bounds, seed: int) -> list[Bounds]:
    """Random tiles, one in each cell of a grid of ACROSS x ACROSS; of a small picture the whole, as one tile."""
    x0, y0, x1, y1 = bounds
    width, height = x1 - x0, y1 - y0
    side = int(np.clip(np.sqrt(width * height) / SHARE, *SIDES))
    if width * height <= SMALL * (ACROSS * side) ** 2 or min(width, height) < ACROSS * side:
        return [bounds]
    rng, boxes = np.random.default_rng(seed), []
    for row in range(ACROSS):
        for column in range(ACROSS):
            x = x0 + int(rng.integers(width * column // ACROSS, width * (column + 1) // ACROSS - side + 1))
            y = y0 + int(rng.integers(height * row // ACROSS, height * (row + 1) // ACROSS - side + 1))
            boxes.append((x, y, x + side, y + side))
    return boxes


@dataclass
class Trial:
    """A picture that is to be made, with what measures methods for it.

    parameters: its job, in which a method is free to be another. needs_of: the needs of a job with its scene. limit: of
    the RMSE. against: "scene" or "centres" (see truth.view). run: as Sessions.run. end: on the clock of time.monotonic,
    by which all is to be done.
    """

    arrays: dict
    needs_of: Callable[[Parameters], tuple[str, ...]]
    parameters: Parameters
    entries: dict[str, Entry]
    limit: float
    against: str
    run: Callable
    end: float
    threads: int | None = None  # None: as many as a variant runs by default
    shots: int = 0
    why: dict[str, str] = field(default_factory=dict)  # the last reason for which a variant made no picture

    @property
    def left(self) -> float:
        """Seconds."""
        return self.end - time.monotonic()

    def shoot(self, entry: Entry, parameters: Parameters, places: list[Bounds], frames: int = 1):
        """The picture of all places, one below the other, the rough time of a frame of the whole picture, s, and its
        rays (None: not counted). None if it cannot be made. TimeUp.
        """
        results = self._results(entry, parameters, places, self.arrays, frames)
        if results is None:
            return None
        seconds = sum(steady.rough(result.said.frames_s) for result in results)
        kinds = "primary", "reflected", "transmitted", "shadow"
        rays = sum((result.said.rays or {}).get(kind, 0) for result in results for kind in kinds)
        picture = np.concatenate([result.array for result in results])
        height, width, _ = self.parameters.shape()
        return picture, seconds * width * height / np.prod(picture.shape[:2]), rays or None

    def _results(
        self, entry: Entry, parameters: Parameters, places: list[Bounds], scene: dict, frames: int
    ) -> list[Result] | None:
        """The results of a job with the arrays of a scene at each place; None if one cannot be made. TimeUp."""
        results, threads = [], self.threads or entry.threads()
        for place in places:
            job = replace(parameters, region=place, frames=frames, threads=threads)
            if self.left <= 0:
                raise TimeUp
            needs = truth.needs_in(scene, self.arrays, self.needs_of(job))
            result = self.run(entry, scene, job, needs, timeout=self.left, cache=kernels(entry))
            self.shots += 1
            if result.status == "timeout":
                raise TimeUp
            why = judge.broken(result) if result.status == "ok" else f"{result.status}: {result.reason}"
            if why:
                self.why[entry.name] = why
                return None
            results.append(result)
        return results

    def truth(
        self, places: list[Bounds], side: int, first: int, share: float = KNOWN, of: np.ndarray | None = None
    ) -> tuple[Truth, int]:
        """The truth of places, its uncertainty at most limit / share, and the samples of a side of a pixel in each of
        its pictures, at first `side`. first: number in the family of the first of its seeds. CannotTell, TimeUp.

        of: a picture of the places. Then an uncertainty of limit / FIRST is enough if that picture's verdict is clear.
        """
        target = self.limit / share
        wanted = Wanted(against=self.against)
        truth_job = truth.jobs([self.parameters], wanted, self.needs_of)[truth.view(self.parameters, wanted)]
        maker = truth.choose(self.entries, truth_job)
        if maker is None:
            raise CannotTell("no renderer here can make its truth")

        # In lanes its pictures are the same but for rounding (VEC-1), and take a fraction of the time.
        lanes = {"vector": "auto"} if "auto" in maker.methods.get("vector", ()) else {}

        def shoot(parameters: Parameters, scene: dict) -> tuple[np.ndarray, np.ndarray | None]:
            results = self._results(maker, general(maker, replace(parameters, **lanes)), places, scene, 0)
            if results is None:
                raise CannotTell(f"{maker.name} could not make the truth: {self.why[maker.name]}")
            dropped = [result.dropped for result in results]
            joined = None if dropped[0] is None else np.concatenate(dropped)
            return np.concatenate([result.array for result in results]), joined

        def picture(parameters: Parameters) -> np.ndarray:
            return shoot(parameters, self.arrays)[0]

        deep, change = truth_job.parameters, 0.0
        if deep.depth:
            least = min(depth.UNCHANGED, self.limit / KNOWN**2), min(depth.LITTLE, self.limit / KNOWN**2)
            deep, change = depth.deep_enough(deep, self.arrays, shoot, *least)
        if change > target / KNOWN:
            why = (
                f"rays deeper than {deep.depth} and of weights below {deep.cutoff:.2g} could add an RMS of {change:.2g}"
            )
            raise CannotTell(f"{why}, more than {target / KNOWN:.2g}, to which it must be known")
        facts = {"depth": deep.depth, "cutoff": deep.cutoff, "change": change}
        if len(truth_job.seeds) == 1:
            return Truth(maker.name, picture(deep), truth_job.samples, (0,), None, **facts), side
        pixels = sum((x1 - x0) * (y1 - y0) for x0, y0, x1, y1 in places)
        alone = truth.unseen(self.arrays, deep, 1, pixels)  # of one sample a pixel
        goals = [self._goal(goal, change, alone) for goal in ([] if of is None else [self.limit / FIRST]) + [target]]
        room, least = goals.pop(0)
        family = (truth.FAMILY * number % 2**32 for number in count(first))
        seeds = (seed for seed in family if seed != self.parameters.seed)
        side = side if deep.sampler == "jittered" else 1
        side = max(side, min(MOST, int(np.ceil(np.sqrt(least / truth.PICTURES)))))
        while True:
            deep, taken, began = replace(deep, samples=side), [], time.monotonic()
            pictures = (picture(replace(deep, seed=taken[-1])) for seed in seeds if not taken.append(seed))
            for number, (centre, error) in islice(enumerate(truth.means(pictures), 1), truth.PICTURES - 1, None):
                noise, samples = float(np.sqrt(np.mean(error**2))), number * truth.samples(deep)
                if noise <= room and samples >= least:
                    unseen = alone / samples
                    ground_truth = Truth(maker.name, centre, samples, tuple(taken), error, **facts, unseen=unseen)
                    if not goals or self.is_clear(of, ground_truth):
                        return ground_truth, side
                    room, least = goals.pop(0)
                    if noise <= room and samples >= least:
                        return ground_truth, side
                # More pictures err less with the root of their number; the same samples in a larger one by more.
                each, over = (time.monotonic() - began) / number, noise / room
                more = max(1.1 * number * over**2, number * least / samples)
                larger = max(1.1 * over ** (2 / 3), np.sqrt(least / truth.PICTURES) / side)
                larger = min(larger, MOST / side) if deep.sampler == "jittered" else 1.0
                if more > 4 * truth.PICTURES and larger > 1.0:
                    break
                self._must_have(each * (more - number), noise, target)
            self._must_have(each * truth.PICTURES * larger**2, noise, target)
            side = int(np.ceil(side * larger))

    @staticmethod
    def _goal(goal: float, change: float, alone: float) -> tuple[float, float]:
        """How large the noise of a truth may be, and how many samples a pixel it must have at least, for an uncertainty
        of `goal`. alone: unseen by one sample.
        """
        small = SMALL_THINGS * goal if alone else 0.0
        return np.sqrt(goal**2 - (change + small) ** 2), alone / small if alone else 0.0

    def is_clear(self, array: np.ndarray, ground_truth: Truth) -> bool:
        """Whether a truth of a picture's places tells if its error is within the limit: it is known as well as asked
        for, or the error is so far from the limit that it does not matter."""
        if (ground_truth.uncertainty or 0.0) <= 1.001 * self.limit / KNOWN:  # rounding
            return True
        error = judge.errors(array, ground_truth.picture, ground_truth.standard_error, None)
        return abs(error["rmse"] - self.limit) > CLEAR * error["rmse_standard_error"] + ground_truth.doubt

    def _must_have(self, seconds: float, noise: float, target: float) -> None:
        if seconds > self.left:
            raise CannotTell(
                f"no truth from samples can tell in this time: it is known to {noise:.2g}, and {target:.2g} would take"
                f" {seconds:.2g} s more; --against centres has a truth without samples, for pictures without any"
            )

    def error(
        self, array: np.ndarray, ground_truth: Truth, places: list[Bounds], hard: np.ndarray | None = None
    ) -> dict:
        """As judge.errors; of tiles the error of the whole picture, with their spread in rmse_standard_error.

        hard: (height, width, 3) of the whole picture, how large its squared errors are as compared with each other:
        then the tiles say only how large they are over that (a ratio estimator: Cochran, Sampling Techniques, ch. 6).
        """
        error = judge.errors(array, ground_truth.picture, ground_truth.standard_error, None, ground_truth.doubt)
        if len(places) == 1:
            return error
        noise = 0.0 if ground_truth.standard_error is None else ground_truth.standard_error**2
        squares = ((array.astype(np.float64) - ground_truth.picture) ** 2 - noise).reshape(len(places), -1).mean(axis=1)
        other, whole = np.ones(len(places)), 1.0
        x, y = self.parameters.bounds()[:2]
        if hard is not None:
            hardness = np.array([hard[y0 - y : y1 - y, x0 - x : x1 - x].mean() for x0, y0, x1, y1 in places])
            if hardness.mean() > 0:
                other, whole = hardness, float(hard.mean())
        ratio = max(0.0, squares.mean() / other.mean())
        share = array.shape[0] * array.shape[1] * 3 / np.prod(self.parameters.shape())
        spread = (squares - ratio * other).std(ddof=1) * whole / other.mean() * np.sqrt((1 - share) / len(places))
        rmse = float(np.sqrt(ratio * whole))
        spread = min(np.sqrt(spread), spread / (2 * rmse)) if rmse else np.sqrt(spread)
        error |= {"rmse": rmse, "rmse_standard_error": float(np.hypot(error["rmse_standard_error"], spread))}
        return {**error, "below": record.below({**error, "change": ground_truth.doubt})}
