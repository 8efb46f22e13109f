"""The reference picture of a job, the mask of its ill-conditioned pixels, and what perturbed references have there."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

import numpy as np

from harness.judge.cache import Kept
from harness.judge.judge import TOLERANCE, Reference
from harness.judge.span import THRESHOLD, leaves
from harness.process import repetition
from harness.process.session import Sessions
from harness.renderer import methods
from harness.renderer.builder import BuildError
from harness.renderer.job import count_shapes, fingerprint
from harness.renderer.parameters import Parameters, default_epsilon, default_sliver
from harness.renderer.registry import Entry

# Who may be the reference, the quickest first, start included. A picture is never judged by its own renderer.
JUDGES = ("cpp", "numpy", "numba", "python")
JUDGES_OF_MANY = ("cpp", "numba", "numpy", "python")  # of many samples; or shapes: numpy has no hierarchy

MANY = 200  # shapes, from where on a hierarchy makes up for a compilation
MANY_RAYS = 20_000_000  # of all pictures of a reference: NumPy takes a microsecond for each, a compilation 10 s or more

# 8 find all that float64 pictures can part by. Of the pixels where float32 ones do, 8 miss about one in a thousand.
PERTURBATIONS = {"float64": 8, "float32": 32}
FURTHER = {"float64": 4, "float32": 8}  # perturbed references that show how often one leaves what the others span
SEED, FURTHER_SEED = 20, 21
ULPS = 4  # of float32, in the screen coordinates X and Y of CAM-2
FURTHER_ULPS = {"float64": 1, "float32": 4}  # float64 errs by 2^-29 of that, unless chaos has taken over
# Of the sliver of CSG-4: the distances to two faces are off by up to 14 of its 16 u.
SLIVERS = 1 / 8, 15 / 8
# What a reference has as by default, whatever the picture's method.
PLAIN = "cutoff", "kernel", *methods.changing(methods.ROUNDING, methods.FAILURES)


@dataclass(frozen=True)
class NoReference:
    reason: str


def judges_of(arrays: dict[str, np.ndarray], parameters: Parameters) -> tuple[str, ...]:
    """The judges, the quickest first, of many shapes or many rays; () where that depends on the scene's needs alone."""
    many = sum(count_shapes(arrays).values()) >= MANY or rays_of(parameters) >= MANY_RAYS
    return JUDGES_OF_MANY if many else ()


def rays_of(parameters: Parameters) -> int:
    """An estimate of the rays of all pictures that a reference is made of: a glossy mirror's tree, or two a sample."""
    x0, y0, x1, y1 = parameters.bounds()
    rays = sum(parameters.glossy_rays**order for order in range(parameters.depth + 1)) if parameters.glossy_rays else 2
    pictures = 1 + perturbations(parameters.precision) + others(parameters.precision)[0]
    return (x1 - x0) * (y1 - y0) * parameters.per_pixel() * rays * pictures


def choose(
    judged: Entry,
    entries: dict[str, Entry],
    parameters: Parameters,
    needs: tuple[str, ...],
    judges: tuple[str, ...] = (),
) -> Entry | None:
    """The first of `judges`, or of JUDGES, of another renderer that is here and can do the job."""
    wanted = job_of(parameters)
    for name in judges or (JUDGES_OF_MANY if {"mesh", "csg"} & set(needs) else JUDGES):
        entry = entries.get(name)
        if entry is None or entry.is_of(judged):
            continue
        if repetition.unsupported(entry, wanted, needs) is None and _runs(entry, wanted, needs):
            return entry
    return None


def _runs(entry: Entry, parameters: Parameters, needs: tuple[str, ...]) -> bool:
    if entry.unavailable:
        return False
    try:
        entry.renderer.build(for_any_scene(entry, parameters), needs)
    except BuildError:
        return False
    return True


def for_any_scene(entry: Entry, parameters: Parameters) -> Parameters:
    """`parameters` with the kernel that has everything, where `entry` is compiled beforehand: one build judges all
    scenes. Its pictures are the same, byte for byte.
    """
    general = entry.renderer.manifest.build and "general" in entry.methods.get("kernel", ())
    return replace(parameters, kernel="general") if general else parameters


def job_of(parameters: Parameters) -> Parameters:
    """The job whose picture is the reference for one made with `parameters`.

    In float64, strict, nothing cut off, but rays leave surfaces as far off as in the picture, else contact shadows
    would differ by method; and faces of a CSG solid as near to each other as there count as one, else its thinnest
    parts would.
    """
    epsilon, offset = parameters.epsilon, parameters.offset
    if offset == "none":
        epsilon, offset = None, Parameters.offset
    if epsilon is None and offset != "fixed":
        epsilon = max(default_epsilon(parameters.precision), default_epsilon("float64"))
    coarse = default_sliver(parameters.precision) > default_sliver("float64")
    sliver = parameters.sliver or (default_sliver(parameters.precision) if coarse else None)
    plain = {name: getattr(Parameters, name) for name in PLAIN}
    return replace(parameters.picture(), precision="float64", offset=offset, epsilon=epsilon, sliver=sliver, **plain)


def needs_of(needs: tuple[str, ...]) -> tuple[str, ...]:
    """The needs of that job, of a picture's."""
    return tuple(name for name in needs if name != "cutoff")


def key(maker: Entry, scene_version: str, parameters: Parameters) -> str:
    """By what the reference by `maker` of a picture is kept."""
    counts = perturbations(parameters.precision), others(parameters.precision)
    return fingerprint({}, scene_version, job_of(parameters), "span", counts, maker.name, maker.renderer.version)


def find(kept: Kept, judged: Entry, entries: dict[str, Entry], scene_version: str, parameters: Parameters):
    """The Reference of a picture that an earlier run made and kept, or None: nothing is rendered."""
    for maker in (entries[name] for name in JUDGES if name in entries):
        stored = kept.get(key(maker, scene_version, parameters))
        if stored and not maker.is_of(judged):
            return Reference.restored(*stored)
    return None


def perturbations(precision: str) -> int:
    """How many perturbed pictures the mask for a picture of this precision is made of."""
    return PERTURBATIONS.get(precision, PERTURBATIONS["float64"])


def others(precision: str) -> tuple[int, int, float]:
    """How many further perturbed pictures there are, the seed of their directions, and by how many ULPS they move."""
    kind = precision if precision in FURTHER else "float64"
    return FURTHER[kind], FURTHER_SEED, FURTHER_ULPS[kind]


def make(
    entry: Entry,
    arrays: dict[str, np.ndarray],
    parameters: Parameters,
    needs: tuple[str, ...],
    cache: Path,
    run: Callable[..., repetition.Result] | None = None,
    masked: bool = True,
) -> Reference | NoReference:
    """A Reference made by `entry`, with its compiled code in `cache`, or a NoReference.

    run: does its jobs, as Sessions.run; by default in processes that end with it. masked: False leaves the mask empty,
    for one picture instead of 13 to 41; what agrees with that reference agrees with the one with a mask.
    """
    if run is None:
        with Sessions() as sessions:
            return make(entry, arrays, parameters, needs, cache, sessions.run, masked)
    wanted, precision = for_any_scene(entry, job_of(parameters)), parameters.precision
    count = perturbations(precision) if masked else 0
    jobs = [wanted]
    if masked:
        jobs += [*perturbed(wanted, count, SEED, ULPS), *perturbed(wanted, *others(precision))]
    results = succeeding(entry.name, (run(entry, arrays, job, needs, cache=cache) for job in jobs))
    try:
        first = next(results)
        picture = first.array.astype(np.float64)
        if not np.isfinite(picture).all():
            return NoReference(f"the reference of {entry.name} has pixels that are not finite")
        mask, low, high = np.zeros(picture.shape[:2], bool), picture.copy(), picture.copy()
        for other in (result.array for result in islice(results, count)):
            mask |= ~(np.abs(other - picture).max(axis=-1) <= THRESHOLD)
            finite = np.isfinite(other)
            np.minimum(low, other, out=low, where=finite)
            np.maximum(high, other, out=high, where=finite)
        span, left = np.stack([low[mask], high[mask]]), ()
        if mask.any():
            tolerance = TOLERANCE.get(precision, TOLERANCE["float64"])
            left = tuple(int(np.count_nonzero(leaves(other.array[mask], span, tolerance))) for other in results)
    except LookupError as error:
        return NoReference(str(error))
    return Reference(entry.name, picture, mask, first.said.rays, span, left)


def succeeding(maker: str, results: Iterable[repetition.Result]) -> Iterator[repetition.Result]:
    """The Results by `maker` of the job of a reference and of that job perturbed. LookupError if one has failed."""
    for number, result in enumerate(results):
        if result.status != "ok":
            what = "mask" if number else "reference"
            raise LookupError(f"{maker} could not make the {what}: {result.status}: {result.reason}")
        yield result


def perturbed(parameters: Parameters, count: int, seed: int, ulps: float) -> list[Parameters]:
    """The job of a reference perturbed: its sample moved by `ulps` float32 units in the last place of X and Y near 1,
    in seeded directions.

    A pixel whose float64 colour changes visibly under so small a move is one where float32, or another order of the
    same sums, may rightly give another colour: an edge, or a ray path that chaos has taken over. The thinnest part of a
    CSG solid is another: where `sliver` is given, it is SLIVERS times that in turn.
    """
    shift = ulps * np.spacing(np.float32(1.0)) / 2
    angles = np.random.default_rng(seed).uniform(0, 2 * np.pi, count)
    return [
        replace(
            parameters,
            sample_x=float(parameters.sample_x + shift * np.cos(angle) * parameters.width),
            sample_y=float(parameters.sample_y + shift * np.sin(angle) * parameters.height),
            sliver=parameters.sliver and parameters.sliver * SLIVERS[number % 2],
        )
        for number, angle in enumerate(angles)
    ]
