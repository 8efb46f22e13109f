"""Jobs that return first hits in place of a picture: their rays, their reference, and their verdict."""

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from itertools import islice
from pathlib import Path

import numpy as np

from harness.experiment.image import Image
from harness.judge import span
from harness.judge.judge import Reference, Verdict
from harness.judge.reference import SEED, ULPS, NoReference, for_any_scene, job_of, others, perturbations, succeeding
from harness.process import repetition
from harness.renderer.job import fingerprint
from harness.renderer.parameters import Parameters
from harness.renderer.registry import Entry
from harness.scene.model import Scene
from harness.scene.needs import shapes

DISTANCE, OBJECT = 0, 7  # columns of hits (renderers/README.md)
# Of a hit's distance, as a share of it, outside the mask.
TOLERANCE = {"float64": 1e-9, "float32": 1e-4}
THRESHOLD = 1e-5  # by which share the distance of a well-conditioned hit changes at most


class Aimed:
    """A scene with `count` rays from its eye through random points of its screen. Stands in the place of its Source.

    In random order, so that the caches hold little of what the next ray needs.
    """

    def __init__(self, source, count: int, seed: int):
        self.source, self.count, self.seed = source, count, seed
        self.name, self.stem, self.size = source.name, source.stem, source.size
        self._flat: dict[str, tuple[str, dict[str, np.ndarray]]] = {}

    @property
    def counts(self) -> tuple[int, int]:
        return self.source.counts

    @cached_property
    def rays(self) -> np.ndarray:
        return through_the_screen(self.source.scene, self.count, self.seed)

    def flat(self, arithmetic: str) -> tuple[str, dict[str, np.ndarray]]:
        """The hash of its arrays, and the arrays, its rays among them."""
        if arithmetic not in self._flat:
            arrays = {**self.source.flat(arithmetic)[1], "rays": self.rays}
            self._flat[arithmetic] = fingerprint(arrays), arrays
        return self._flat[arithmetic]

    def parameters(self, image: Image, threads: int, frames: int, least_frame: float = 0.0) -> Parameters:
        """Returns the parameters of the job, whose size is its number of rays."""
        made = image.parameters(threads, frames, least_frame)
        return replace(made, kind="rays", width=self.count, height=1, region=None, depth=0)

    def needs(self, parameters: Parameters) -> tuple[str, ...]:
        return tuple(sorted(shapes(self.source.scene)))


def through_the_screen(scene: Scene, count: int, seed: int) -> np.ndarray:
    """Rays (count, 6), origin and unit direction: CAM-3 at points that are uniform on the screen."""
    camera = scene.camera
    x, y = np.random.default_rng(seed).uniform(-1, 1, (2, count, 1))
    rays = np.empty((count, 6))
    rays[:, :3] = np.add(camera.centre, camera.e)
    towards = x * np.array(camera.u) + y * np.array(camera.v) - np.array(camera.e)
    rays[:, 3:] = towards / np.linalg.norm(towards, axis=1, keepdims=True)
    return rays


def make(
    entry: Entry,
    arrays: dict[str, np.ndarray],
    parameters: Parameters,
    needs: tuple[str, ...],
    cache: Path,
    run: Callable[..., repetition.Result],
) -> Reference | NoReference:
    """The Reference of a list of rays, made by `entry`: `picture` (R, 8) has their hits, `mask` (R,).

    A ray is ill-conditioned if a turn by ULPS of float32 changes the object, or the distance by more than THRESHOLD.
    span: (S, 4), of each object that such a ray hits in it or in a perturbed reference: the row of the ray, the object,
    the smallest and the largest distance.
    """
    wanted, precision = for_any_scene(entry, job_of(parameters)), parameters.precision
    rays, count = arrays["rays"], perturbations(precision)

    def results():
        yield run(entry, arrays, wanted, needs, cache=cache)
        for number, seed, ulps in ((count, SEED, ULPS), others(precision)):
            rng = np.random.default_rng(seed)
            for _ in range(number):
                turned = rays.copy()
                turned[:, 3:] += ulps * np.spacing(np.float32(0.5)) * _unit(rng.normal(size=(len(rays), 3)))
                turned[:, 3:] = _unit(turned[:, 3:])
                yield run(entry, {**arrays, "rays": turned}, wanted, needs, cache=cache)

    made = succeeding(entry.name, results())
    try:
        first = next(made)
        right = first.array.astype(np.float64)
        mask, seen = np.zeros(len(right), bool), []
        for other in (result.array for result in islice(made, count)):
            moved = (other[:, OBJECT] != right[:, OBJECT]) | ~(_off(other, right) <= THRESHOLD)
            seen.append(_told(other, moved))
            mask |= moved
        spans, left = _spans(np.concatenate([_told(right, mask), *seen])), ()
        if mask.any():
            tolerance = TOLERANCE.get(precision, TOLERANCE["float64"])
            left = tuple(int(np.count_nonzero(_leaves(other.array, mask, spans, tolerance))) for other in made)
    except LookupError as error:
        return NoReference(str(error))
    return Reference(entry.name, right, mask, first.said.rays, spans, left)


def _told(hits: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Row, object and distance of the hits in `rows` (R,), which is boolean."""
    return np.column_stack([np.flatnonzero(rows), hits[rows][:, [OBJECT, DISTANCE]]])


def _spans(hits: np.ndarray) -> np.ndarray:
    """The smallest and the largest distance (S, 4) of each row and object in `hits`, rising."""
    hits = hits[np.lexsort(hits.T[::-1])]
    first = np.flatnonzero(np.diff(hits[:, :2], axis=0, prepend=np.nan).any(axis=1))
    last = np.append(first, len(hits))[1:] - 1
    return np.column_stack([hits[first], hits[last, 2]])


def _leaves(hits: np.ndarray, mask: np.ndarray, spans: np.ndarray, tolerance: float) -> np.ndarray:
    """Which of the M ill-conditioned rays hit what no perturbed reference hits, or where none does: booleans (M,).

    Spans of distances are widened on either side by span.WIDENED of their width, and a share of the distance: the
    tolerance, at least THRESHOLD.
    """
    rows, objects, distances = _told(hits, mask).T
    among = {(row, thing): place for place, (row, thing) in enumerate(spans[:, :2].tolist())}
    places = np.array([among.get(pair, -1) for pair in zip(rows.tolist(), objects.tolist(), strict=True)], dtype=int)
    if not len(places):
        return np.zeros(0, bool)
    low, high = spans[places, 2:].T
    missed = objects < 0
    with np.errstate(invalid="ignore"):  # inf - inf, of misses
        wider = span.WIDENED * (high - low) + max(tolerance, THRESHOLD) * np.abs(high)
        within = (distances >= low - wider) & (distances <= high + wider)
    return (places < 0) | ~(missed | within)


def judge(hits: np.ndarray, reference: Reference, precision: str) -> Verdict:
    """Judge `hits` (R, 8), as the contract returns them.

    max_outside, max_inside: largest error of the distance of a hit, as a share of it, outside and inside the mask.
    bad_pixels: share of all rays that hit something else than the reference says.
    """
    right, mask = reference.picture, reference.mask
    if len(hits) != len(right):
        return Verdict(f"{len(hits)} answers, expected {len(right)}")
    other, off = hits[:, OBJECT] != right[:, OBJECT], _off(hits, right)
    tolerance = TOLERANCE.get(precision, TOLERANCE["float64"])
    wrong = None
    if (other & ~mask).any():
        wrong = f"{int((other & ~mask).sum())} rays hit something else outside the mask"
    elif not (off[~mask] <= tolerance).all():
        wrong = (
            f"{int((~(off[~mask] <= tolerance)).sum())} distances off by more than {tolerance:.3g} of them outside the "
            f"mask, the worst by {off[~mask].max():.3g}"
        )
    elif mask.any():
        beyond = int(np.count_nonzero(_leaves(hits, mask, reference.span, tolerance)))
        limit = span.most(int(mask.sum()), reference.left)
        if beyond > limit:
            wrong = (
                f"{beyond} of {int(mask.sum())} rays inside the mask hit what turns by some float32 steps do not bring "
                f"them to; of right answers at most {limit} do"
            )
    both = mask & ~other
    return Verdict(
        wrong=wrong,
        max_outside=float(off[~mask].max()) if not mask.all() else None,
        max_inside=float(off[both].max()) if both.any() else None,
        bad_pixels=float(other.mean()),
        mask_fraction=float(mask.mean()),
        tolerance=tolerance,
    )


def _off(hits: np.ndarray, right: np.ndarray) -> np.ndarray:
    """By which share the distances differ of those that hit the same; 0 of the others."""
    same = (hits[:, OBJECT] == right[:, OBJECT]) & (right[:, OBJECT] >= 0)
    off = np.zeros(len(right))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        off[same] = np.abs(hits[same, DISTANCE].astype(np.float64) / right[same, DISTANCE] - 1)
    return np.nan_to_num(off, nan=0.0)  # 0 / 0 are the same; what is infinite becomes the largest number


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
