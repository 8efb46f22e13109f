"""The reference picture of a job, and the mask of its ill-conditioned pixels."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from harness.judge.cache import Kept
from harness.process import repetition
from harness.renderer.builder import BuildError
from harness.renderer.job import count_shapes, fingerprint
from harness.renderer.parameters import Parameters, default_epsilon
from harness.renderer.registry import Entry

# Who may be the reference, the quickest first, start included. A picture is never judged by its own renderer.
JUDGES = ("cpp", "numpy", "numba", "python")
JUDGES_OF_MANY = ("cpp", "numba", "numpy", "python")  # of many samples; or shapes: numpy has no hierarchy

MANY = 200  # shapes, from where on a hierarchy makes up for a compilation

# 8 find all that float64 pictures can part by. Of the pixels where float32 ones do, 8 miss about one in a thousand.
PERTURBATIONS = {"float64": 8, "float32": 32}
ULPS = 4  # of float32, in the screen coordinates X and Y of CAM-2
THRESHOLD = 0.1 / 255
# What a reference has as by default, whatever the picture's method.
PLAIN = (
    *("sphere", "triangle", "slab", "merge", "fresnel", "phong", "renormalise", "floating_point", "cutoff"),
    *("kernel", "vector"),
)


@dataclass(frozen=True)
class Reference:
    """A float64 picture, the mask (height, width) of its ill-conditioned pixels, its ray counts and its maker."""

    maker: str
    picture: np.ndarray
    mask: np.ndarray
    rays: dict | None

    def stored(self) -> tuple[dict, dict[str, np.ndarray]]:
        """Converts it to facts for JSON and arrays, for the cache."""
        return {"maker": self.maker, "rays": self.rays}, {"reference": self.picture, "mask": self.mask}

    @classmethod
    def restored(cls, facts: dict, arrays: dict[str, np.ndarray]) -> "Reference":
        return cls(facts["maker"], arrays["reference"], arrays["mask"], facts["rays"])


@dataclass(frozen=True)
class NoReference:
    reason: str


def judges_of(arrays: dict[str, np.ndarray]) -> tuple[str, ...]:
    """The judges, the quickest first, of a scene; () where that depends on its needs alone."""
    return JUDGES_OF_MANY if sum(count_shapes(arrays).values()) >= MANY else ()


def choose(
    judged: Entry,
    known: dict[str, Entry],
    parameters: Parameters,
    needs: tuple[str, ...],
    judges: tuple[str, ...] = (),
) -> Entry | None:
    """The first of `judges`, or of JUDGES, of another renderer that is here and can do the job."""
    wanted = job_of(parameters)
    for name in judges or (JUDGES_OF_MANY if {"mesh", "csg"} & set(needs) else JUDGES):
        entry = known.get(name)
        if entry is None or entry.renderer.folder == judged.renderer.folder:
            continue
        if repetition.unsupported(entry, wanted, needs) is None and _runs(entry, wanted, needs):
            return entry
    return None


def _runs(entry: Entry, parameters: Parameters, needs: tuple[str, ...]) -> bool:
    if entry.unavailable:
        return False
    try:
        entry.renderer.build(parameters, needs)
    except BuildError:
        return False
    return True


def job_of(parameters: Parameters) -> Parameters:
    """The job whose picture is the reference for one made with `parameters`.

    In float64, strict, nothing cut off, but rays leave surfaces as far off as in the picture: else contact shadows
    would differ by method.
    """
    epsilon, offset = parameters.epsilon, parameters.offset
    if offset == "none":
        epsilon, offset = None, Parameters.offset
    if epsilon is None and offset != "fixed":
        epsilon = max(default_epsilon(parameters.precision), default_epsilon("float64"))
    plain = {name: getattr(Parameters, name) for name in PLAIN}
    return replace(parameters.picture(), precision="float64", offset=offset, epsilon=epsilon, **plain)


def needs_of(needs: tuple[str, ...]) -> tuple[str, ...]:
    """The needs of that job, of a picture's."""
    return tuple(name for name in needs if name != "cutoff")


def key(maker: Entry, scene_version: str, parameters: Parameters) -> str:
    """By what the reference by `maker` of a picture is kept."""
    count = perturbations(parameters.precision)
    return fingerprint({}, scene_version, job_of(parameters), count, maker.name, maker.renderer.version)


def find(kept: Kept, judged: Entry, known: dict[str, Entry], scene_version: str, parameters: Parameters):
    """The Reference of a picture that an earlier run made and kept, or None: nothing is rendered."""
    for maker in (known[name] for name in JUDGES if name in known):
        stored = kept.get(key(maker, scene_version, parameters))
        if stored and maker.renderer.folder != judged.renderer.folder:
            return Reference.restored(*stored)
    return None


def perturbations(precision: str) -> int:
    """How many perturbed pictures the mask for a picture of this precision is made of."""
    return PERTURBATIONS.get(precision, PERTURBATIONS["float64"])


def make(
    entry: Entry,
    arrays: dict[str, np.ndarray],
    parameters: Parameters,
    needs: tuple[str, ...],
    cache: Path,
    run: Callable[..., repetition.Result] = repetition.run,
):
    """A Reference made by `entry`, with its compiled code in `cache`, or a NoReference. `run` starts it."""
    wanted = job_of(parameters)

    def results():
        for x, y in [(wanted.sample_x, wanted.sample_y), *perturbed(wanted, perturbations(parameters.precision))]:
            yield run(entry, arrays, replace(wanted, sample_x=x, sample_y=y), needs, cache=cache)

    def moved(picture, right):
        return ~(np.abs(picture - right).max(axis=-1) <= THRESHOLD)

    found = of_results(entry.name, results(), moved)
    if isinstance(found, Reference) and not np.isfinite(found.picture).all():
        return NoReference(f"the reference of {entry.name} has pixels that are not finite")
    return found


def of_results(
    maker: str, results: Iterable[repetition.Result], differs: Callable[[np.ndarray, np.ndarray], np.ndarray]
) -> Reference | NoReference:
    """The Reference by `maker` from the Result of its job and those of the same job perturbed.

    differs(array, right): where the array of a perturbed job and that of the job itself are not alike.
    """
    first, mask = None, False
    for result in results:
        if result.status != "ok":
            what = "mask" if first else "reference"
            return NoReference(f"{maker} could not make the {what}: {result.status}: {result.reason}")
        first = first or result
        mask |= differs(result.array, first.array)
    return Reference(maker, first.array.astype(np.float64), mask, first.said.rays)


def perturbed(parameters: Parameters, count: int, seed: int = 20) -> list[tuple[float, float]]:
    """Sample positions moved by ULPS float32 units in the last place of X and Y near 1, in seeded directions.

    A pixel whose float64 colour changes visibly under so small a move is one where float32, or another order of the
    same sums, may rightly give another colour: an edge, or a ray path that chaos has taken over.
    """
    shift = ULPS * np.spacing(np.float32(1.0)) / 2
    angles = np.random.default_rng(seed).uniform(0, 2 * np.pi, count)
    return [
        (
            float(parameters.sample_x + shift * np.cos(angle) * parameters.width),
            float(parameters.sample_y + shift * np.sin(angle) * parameters.height),
        )
        for angle in angles
    ]
