"""The truth that a picture is an approximation of: which job makes it, and what is known of it.

Of a scene without samples it is one picture in float64, strict, at the same depth. Of a sampled scene it is the mean of
many pictures with other seeds, each with as many samples as the largest one under test, and has a standard error.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from harness.judge import judge
from harness.judge.reference import job_of
from harness.renderer.parameters import Parameters
from harness.renderer.registry import Entry

SAMPLED = {"supersampling", "adaptive", "lens", "soft", "glossy"}  # needs: a picture that has one is an estimate
ENLARGED = 2  # times as many samples a side as the largest picture under test has
FAMILY = 0x9E3779B9  # the golden ratio: seeds of truths are multiples of it, far from those that people choose


@dataclass(frozen=True)
class Job:
    """The job that makes a truth. seeds: one for each of its pictures; none if there is no truth, for this reason."""

    parameters: Parameters
    needs: tuple[str, ...]
    seeds: tuple[int, ...]
    reason: str = ""


@dataclass(frozen=True)
class Truth:
    """A truth (height, width, 3), who made it, of how many pictures, and if of several its standard error, likewise."""

    maker: str
    picture: np.ndarray
    pictures: int
    standard_error: np.ndarray | None

    @property
    def uncertainty(self) -> float | None:
        """Root mean square of the standard error, linear RGB."""
        return None if self.standard_error is None else float(np.sqrt(np.mean(self.standard_error**2)))


def view(parameters: Parameters, depth: int | None = None) -> Parameters:
    """What a picture is of, every choice of how to make it taken away but the epsilon of its precision (OFF-1).

    A picture of one sample a pixel is of the centres of pixels, any other of their areas.
    """
    default = Parameters()
    return replace(
        job_of(parameters),
        depth=parameters.depth if depth is None else depth,
        feelers=min(parameters.feelers, 1),
        glossy_rays=min(parameters.glossy_rays, 1),
        sampler="one" if parameters.sampler == "one" else "jittered",
        sliver=None,
        **{name: getattr(default, name) for name in ("samples", "adaptive_depth", "adaptive_threshold")},
        **{name: getattr(default, name) for name in ("glossy_weight", "seed")},
    )


def jobs(
    pictures: Iterable[Parameters],
    depth: int | None,
    times: int | None,
    needs_of: Callable[[Parameters], tuple[str, ...]],
) -> dict[Parameters, Job]:
    """The job of each view of one scene. pictures: of all that are under test.

    times: as many samples as the largest of them has a sampled truth; None: it is not to be made. needs_of: the needs
    of a job with this scene.
    """
    groups: dict[Parameters, list[Parameters]] = {}
    for parameters in pictures:
        groups.setdefault(replace(view(parameters, depth), epsilon=None), []).append(parameters)
    found = {}
    for shown, members in groups.items():
        made = _job(shown, members, times, needs_of)
        for mine in {view(parameters, depth) for parameters in members}:
            exact = not SAMPLED & set(made.needs)  # else its noise hides what epsilon does
            found[mine] = replace(made, parameters=mine) if exact else made
    return found


def _job(shown: Parameters, under_test: list[Parameters], times: int | None, needs_of) -> Job:
    pictures = times
    if shown.sampler == "jittered":
        # One feeler and one glossy ray of each sample; and fewer, larger pictures, as each takes a process.
        side = int(np.ceil(np.sqrt(max(map(_samples, under_test)))))
        shown = replace(shown, samples=ENLARGED * side)
        pictures = times and max(2, -(-times // ENLARGED**2))
    else:
        feelers, glossy = (max(getattr(p, name) for p in under_test) for name in ("feelers", "glossy_rays"))
        shown = replace(shown, feelers=feelers, glossy_rays=glossy)
    needs = needs_of(shown)
    if not SAMPLED & set(needs):
        return Job(shown, needs, (0,))
    if pictures is None:
        return Job(shown, needs, (), "its truth takes many pictures, and the experiment has no [reference]")
    used = {parameters.seed for parameters in under_test}
    family = (FAMILY * k % 2**32 for k in range(1, pictures + len(used) + 1))
    return Job(shown, needs, tuple(seed for seed in family if seed not in used)[:pictures])


def _samples(parameters: Parameters) -> int:
    """Counts the samples of a pixel: each feeler and glossy ray counts; of adaptive samples, their largest number."""
    side = {"one": 1, "adaptive": 2**parameters.adaptive_depth}.get(parameters.sampler, parameters.samples)
    return side**2 * max(parameters.feelers, 1) * max(parameters.glossy_rays, 1)


def make(told: Job, maker: Entry, arrays: dict[str, np.ndarray], cache: Path | None, run: Callable) -> Truth:
    """The truth of a job with seeds, made by `maker`, whose compiled code goes to `cache`. LookupError with the reason
    if it fails. `run` starts it.
    """

    def pictures() -> Iterator[np.ndarray]:
        for seed in told.seeds:
            result = run(maker, arrays, replace(told.parameters, seed=seed), told.needs, cache=cache)
            if result.status != "ok":
                raise LookupError(f"{maker.name} could not make the truth: {result.status}: {result.reason}")
            if judge.not_finite(result.array):
                raise LookupError(f"the truth of {maker.name} has pixels that are not finite")
            yield result.array

    return mean(maker.name, pictures())


def mean(maker: str, pictures: Iterable[np.ndarray]) -> Truth:
    """The truth that pictures (height, width, 3) with independent samples tell, one after the other (Welford 1962)."""
    count, centre, squares = 0, None, None
    for picture in pictures:
        picture, count = picture.astype(np.float64), count + 1
        if centre is None:
            centre, squares = picture, np.zeros_like(picture)
            continue
        away = picture - centre
        centre = centre + away / count
        squares += away * (picture - centre)
    error = np.sqrt(squares / (count - 1) / count) if count > 1 else None
    return Truth(maker, centre, count, error)
