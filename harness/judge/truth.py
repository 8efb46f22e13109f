"""The truth of a scene, from which errors are distances (ERR-1): which job makes it, and how well it is known.

It is the mean of several pictures by the quickest renderer that can make them: independent samples over the area of
each pixel, lens, light and lobe, in float64, strict, and so deep that nothing changes any more.
"""

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from harness.experiment.experiment import Reference as Wanted
from harness.judge import bound, depth, judge
from harness.judge.cache import Kept
from harness.judge.reference import for_any_scene, job_of
from harness.process import repetition
from harness.renderer.job import fingerprint
from harness.renderer.parameters import Parameters
from harness.renderer.registry import Entry

SAMPLED = {"supersampling", "adaptive", "lens", "soft", "glossy"}  # needs: a picture that has one is an estimate
MAKERS = ("cpp-threads", "numba-parallel", "cpp", "numba", "numpy", "python")  # the quickest first
PICTURES = 4  # at least, of which a truth is the mean; few and large, as many samples of a pixel are better in one
FEW = 10_000_000  # samples up to which a kernel of the scene alone saves less than its build takes
FAMILY = 0x9E3779B9  # the golden ratio: seeds of truths are multiples of it, far from those that people choose
UNSEEN = 3.0  # of N samples: what none has met takes less than 3/N of their area (95 %; Hanley and Lippman-Hand 1983)


@dataclass(frozen=True)
class Job:
    """The job that makes a truth.

    seeds: one for each of its pictures. against: what the truth is of: "scene", or where that was asked for "areas" or
    "centres" of pixels. deepen: depth and cut-off are still to be found. shown: the view (see `view`). taken: seeds of
    pictures under test.
    """

    parameters: Parameters
    needs: tuple[str, ...]
    seeds: tuple[int, ...]
    against: str
    deepen: bool
    shown: Parameters
    taken: frozenset[int] = frozenset()

    @property
    def samples(self) -> int:
        """Samples of a pixel, of all pictures."""
        return len(self.seeds) * samples(self.parameters)


@dataclass(frozen=True)
class Truth:
    """A truth (height, width, 3), who made it, of how many samples of a pixel, in pictures with which seeds, and if of
    several its standard error, likewise.

    depth, cutoff: of its rays. change: RMS, linear RGB, that deeper rays could add at most (depth.py); None where the
    depth was given. unseen: likewise, of what is so small that no sample may have met it.
    """

    maker: str
    picture: np.ndarray
    samples: int
    seeds: tuple[int, ...]
    standard_error: np.ndarray | None
    depth: int
    cutoff: float = 0.0
    change: float | None = None
    unseen: float = 0.0

    @property
    def doubt(self) -> float:
        """RMS, linear RGB, of what it may lack: deeper rays, and what no sample has met."""
        return (self.change or 0.0) + self.unseen

    @property
    def uncertainty(self) -> float | None:
        """Root mean square of its standard error and its doubt, linear RGB; None for one picture of a given depth."""
        if self.standard_error is None:
            return self.change
        return float(np.hypot(np.sqrt(np.mean(self.standard_error**2)), self.doubt))

    def facts(self) -> dict:
        """What is known of it, as `error` of a record has it."""
        facts = {"samples": self.samples, "depth": self.depth, "change": self.change, "unseen": self.unseen}
        return {**facts, "uncertainty": self.uncertainty}

    def stored(self) -> tuple[dict, dict[str, np.ndarray]]:
        """Converts it to facts for JSON and arrays, for the cache."""
        arrays = {"truth": self.picture, "standard_error": self.standard_error}
        names = "maker", "samples", "seeds", "depth", "cutoff", "change", "unseen"
        facts = {name: getattr(self, name) for name in names}
        return facts, {name: array for name, array in arrays.items() if array is not None}

    @classmethod
    def restored(cls, facts: dict, arrays: dict[str, np.ndarray]) -> "Truth":
        facts = {**facts, "seeds": tuple(facts["seeds"])}
        return cls(picture=arrays["truth"], standard_error=arrays.get("standard_error"), **facts)

    def serves(self, job: Job) -> bool:
        """Whether it is as good as that of a job with the same view, and independent of the pictures under test."""
        deep = not job.deepen or self.depth >= job.parameters.depth
        return deep and self.samples >= job.samples and not job.taken & set(self.seeds)


def view(parameters: Parameters, wanted: Wanted) -> Parameters:
    """What a picture is held against: pictures with equal views share a truth.

    Of the scene, every choice of how to make the picture is taken away; feelers and glossy rays are those that its own
    lights and materials need (see `_job`). With wanted.against = "centres" only those
    that do not say where the samples are: a picture of one sample a pixel is then held against the centres of pixels,
    any other against their areas, and one without feelers or glossy rays against one without.
    """
    default = Parameters()
    plain = {name: getattr(default, name) for name in ("samples", "spp", "adaptive_depth", "adaptive_threshold")}
    plain |= {name: getattr(default, name) for name in ("glossy_weight", "seed", "sliver")}
    shown = replace(job_of(parameters), depth=_depth(parameters, wanted), **plain)
    if wanted.against == "scene":
        plain = {name: getattr(default, name) for name in ("offset", "epsilon", "sample_x", "sample_y")}
        return replace(shown, feelers=1, glossy_rays=1, sampler="jittered", **plain)
    sampler = "one" if parameters.sampler == "one" else "jittered"
    return replace(
        shown, feelers=min(parameters.feelers, 1), glossy_rays=min(parameters.glossy_rays, 1), sampler=sampler
    )


def _depth(parameters: Parameters, wanted: Wanted) -> int:
    """The depth of the truth of a picture; 0 where it is still to be found."""
    return {"own": parameters.depth, "enough": 0}.get(wanted.depth, wanted.depth)


def jobs(
    pictures: Iterable[Parameters], wanted: Wanted, needs_of: Callable[[Parameters], tuple[str, ...]]
) -> dict[Parameters, Job]:
    """The job of each view of one scene. pictures: of all that are under test; needs_of: the needs of a job with this
    scene.
    """
    groups: dict[Parameters, list[Parameters]] = {}
    for parameters in pictures:
        groups.setdefault(replace(view(parameters, wanted), epsilon=None), []).append(parameters)
    by_view = {}
    for shown, members in groups.items():
        made = _job(shown, members, wanted, needs_of)
        for with_epsilon in {view(parameters, wanted) for parameters in members}:
            if not SAMPLED & set(made.needs):  # else its noise hides what epsilon does
                made = replace(
                    made, parameters=replace(made.parameters, epsilon=with_epsilon.epsilon), shown=with_epsilon
                )
            by_view[with_epsilon] = made
    return by_view


def _job(seen: Parameters, under_test: list[Parameters], wanted: Wanted, needs_of) -> Job:
    against = {"scene": "scene", "centres": "centres" if seen.sampler == "one" else "areas"}[wanted.against]
    deepen = wanted.depth == "enough"
    shown = seen
    if deepen:
        first, cutoff = depth.steps(max(parameters.depth for parameters in under_test))[0]
        shown = replace(seen, depth=first, cutoff=cutoff)
    pictures = wanted.times
    if shown.sampler == "jittered":
        # One feeler and one glossy ray of each sample.
        count, pictures = max(map(samples, under_test)), PICTURES
        shown = replace(shown, samples=int(np.ceil(np.sqrt(wanted.times / pictures * count))))
    else:
        feelers, glossy = (max(getattr(p, name) for p in under_test) for name in ("feelers", "glossy_rays"))
        shown = replace(shown, feelers=feelers, glossy_rays=glossy)
    needs = needs_of(shown)
    if against == "scene":  # soft lights and rough materials are the scene's: without them there are no such rays
        shown = replace(shown, feelers=int("soft" in needs), glossy_rays=int("glossy" in needs))
    if deepen and not {"reflection", "transmission"} & set(needs):  # no ray has children
        shown = replace(shown, depth=0, cutoff=0.0)
        needs = needs_of(shown)
    taken = frozenset(parameters.seed for parameters in under_test)
    family = (FAMILY * k % 2**32 for k in range(1, pictures + len(taken) + 1))
    seeds = tuple(seed for seed in family if seed not in taken)[:pictures] if SAMPLED & set(needs) else (0,)
    return Job(shown, needs, seeds, against, deepen, seen, taken)


def samples(parameters: Parameters) -> int:
    """Counts the samples of a pixel: each feeler and glossy ray counts; of adaptive samples, their largest number."""
    return parameters.per_pixel() * max(parameters.feelers, 1) * max(parameters.glossy_rays, 1)


def certifiable(job: Job, truth: Truth) -> Parameters:
    """The job that 60 digits can repeat: that of the truth, as deep as it came to be; of a sampled one, with a few
    samples of its first picture."""
    deep = replace(job.parameters, depth=truth.depth, cutoff=truth.cutoff)
    if truth.standard_error is None:
        return deep
    return replace(deep, samples=min(deep.samples, 2), seed=truth.seeds[0])


def key(shown: Parameters, wanted: Wanted, maker: Entry, scene_version: str) -> str:
    """By what the truth of a view is kept."""
    settings = (*depth.SETTINGS, UNSEEN) if wanted.depth == "enough" else ()
    return fingerprint({}, "truth", scene_version, shown, settings, maker.name, maker.renderer.version)


def find(kept: Kept, entries: dict[str, Entry], scene_version: str, parameters: Parameters) -> Truth | None:
    """The truth of the scene for a picture that an earlier run made and kept; None if there is none."""
    wanted = Wanted()
    for maker in (entries[name] for name in MAKERS if name in entries):
        stored = kept.get(key(view(parameters, wanted), wanted, maker, scene_version))
        if stored and parameters.seed not in (truth := Truth.restored(*stored)).seeds:
            return truth
    return None


def choose(entries: dict[str, Entry], job: Job) -> Entry | None:
    """The first of MAKERS that is here and can do the job."""
    for name in MAKERS:
        entry = entries.get(name)
        if entry and not entry.unavailable and repetition.unsupported(entry, job.parameters, job.needs) is None:
            return entry
    return None


def make(job: Job, maker: Entry, arrays: dict[str, np.ndarray], cache: Path | None, run: Callable) -> Truth:
    """The truth of a job with seeds, made by `maker`, whose compiled code goes to `cache`. LookupError with the reason
    if it fails. `run` starts it.
    """

    def shoot(parameters: Parameters, scene: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray | None]:
        job_parameters = replace(parameters, threads=maker.threads())
        if parameters.width * parameters.height * samples(parameters) * len(job.seeds) <= FEW:
            job_parameters = for_any_scene(maker, job_parameters)
        result = run(maker, scene, job_parameters, needs_in(scene, arrays, job.needs), cache=cache)
        if result.status != "ok":
            raise LookupError(f"{maker.name} could not make the truth: {result.status}: {result.reason}")
        if judge.not_finite(result.array):
            raise LookupError(f"the truth of {maker.name} has pixels that are not finite")
        return result.array, result.dropped

    wanted, change = job.parameters, None
    if job.deepen:
        wanted, change = depth.deep_enough(wanted, arrays, shoot) if wanted.depth else (wanted, 0.0)
    centre, error = mean(shoot(replace(wanted, seed=seed), arrays)[0] for seed in job.seeds)
    missed = unseen(arrays, wanted, job.samples, centre[..., 0].size)
    return Truth(maker.name, centre, job.samples, job.seeds, error, wanted.depth, wanted.cutoff, change, missed)


def needs_in(scene: dict[str, np.ndarray], arrays: dict[str, np.ndarray], needs: tuple[str, ...]) -> tuple[str, ...]:
    """The needs of a job with the scene `arrays`, or with that one all white (depth.all_white), which has ambient
    light."""
    return needs if scene is arrays else tuple(sorted({*needs, "ambient"}))


def unseen(arrays: dict[str, np.ndarray], parameters: Parameters, count: int, pixels: int) -> float:
    """RMS, linear RGB, over so many pixels, that something may add which none of `count` samples of a pixel has met:
    something as bright as any hit, all in one pixel. 0 where samples have no area.
    """
    if parameters.sampler != "jittered":
        return 0.0
    return bound.brightest(arrays) * UNSEEN / count / float(np.sqrt(pixels))


def mean(pictures: Iterable[np.ndarray]) -> tuple[np.ndarray, np.ndarray | None]:
    """The mean of pictures (height, width, 3) with independent samples, and if there are several its standard error."""
    return deque(means(pictures), maxlen=1)[0]


def means(pictures: Iterable[np.ndarray]) -> Iterator[tuple[np.ndarray, np.ndarray | None]]:
    """The mean and standard error after each of the pictures.

    One after the other (Welford 1962), as all of them may not fit into memory.
    """
    centre, squares = None, None
    for count, picture in enumerate(pictures, 1):
        picture = picture.astype(np.float64)
        if centre is None:
            centre, squares = picture, np.zeros_like(picture)
            yield centre, None
            continue
        away = picture - centre
        centre = centre + away / count
        squares += away * (picture - centre)
        yield centre, np.sqrt(squares / (count - 1) / count)
