"""Measures how rounding of mirrored rays grows with each bounce, from pictures of depth 0, 1, 2, ..

The picture of depth k minus that of depth k - 1 is the light of bounce k. Its difference between two arithmetics grows
by a factor g with each bounce, since a curved mirror spreads rays, until the two have nothing in common.
"""

import itertools
from dataclasses import dataclass

import numpy as np

from harness.statistics.statistics import Estimate
from reports.accuracy import precision, resampling
from reports.accuracy.precision import STRICT
from reports.accuracy.resampling import Blocks
from reports.run import stored
from reports.run.cell import Cell, Missing
from reports.run.results import Results
from reports.run.stored import STEP
from reports.run.view import View

UNITS = {"float64": 2.0**-53, "float32": 2.0**-24}
SMALL = 24  # u: how far off the first ray's angle usually is
LEAST_PIXELS = 30  # that a bounce reaches, for its median to count
LEAST_BOUNCES = 3  # for the fit of a growth
LEAST_DEPTHS = 4  # of a sweep
FLOOR = 4  # u of the pictures' median: a smaller difference is rounding of their sums
ALIKE = 0.1  # of the difference between two random pixels: the growth ends there


@dataclass(frozen=True)
class Bounce:
    """The light of bounce `number` at the `pixels` that it reaches.

    median: of its difference over these pixels. random: that between two of these pixels chosen at random.
    floor: the difference that rounding of sums makes, see FLOOR.
    """

    number: int
    pixels: int
    median: float
    random: float
    floor: float

    @property
    def fits(self) -> bool:
        """Is the difference between rounding and saturation, where it grows?"""
        return self.pixels >= LEAST_PIXELS and self.floor < self.median < ALIKE * self.random


@dataclass(frozen=True)
class Growth:
    """One arithmetic of a variant against strict float64 of `against`.

    growth: g, of the fitted bounces. start: of the fitted line at bounce 0. useful: bounces until 24 u has grown to 1.
    """

    variant: str
    arithmetic: tuple[str, str]
    against: str
    bounces: list[Bounce]
    growth: Estimate | Missing
    start: float | None

    @property
    def label(self) -> str:
        return f"{self.variant}, {precision.name(self.arithmetic)}"

    @property
    def fitted(self) -> list[Bounce]:
        """The first successive bounces that fit; after the growth has ended, later fits are chance."""
        first = next((n for n, bounce in enumerate(self.bounces) if bounce.fits), len(self.bounces))
        last = next((n for n in range(first, len(self.bounces)) if not self.bounces[n].fits), len(self.bounces))
        return self.bounces[first:last]

    @property
    def useful(self) -> float | None:
        """ln(1 / 24 u) / ln g."""
        if isinstance(self.growth, Missing) or self.growth.value <= 1:
            return None
        unit = UNITS[self.arithmetic[0]]
        return float(np.log(1 / (SMALL * unit)) / np.log(self.growth.value))

    @property
    def passes(self) -> int | None:
        """The first bounce with enough pixels and a median beyond 1/255; None if there is none."""
        beyond = (bounce.number for bounce in self.bounces if bounce.median > STEP and bounce.pixels >= LEAST_PIXELS)
        return next(beyond, None)


@dataclass(frozen=True)
class Chaos:
    """Growths of a view. equal: labels of arithmetics that equal strict float64 in every bit. lacking: reasons."""

    view: View
    growths: list[Growth]
    equal: list[str]
    lacking: list[str]


def mirror_views(results: Results) -> list[Chaos]:
    """Returns every view of mirrors with depths 0, 1, 2, .. in more than one arithmetic."""
    views = []
    for seen, by_method in precision.groups(results):
        if not _mirrors(results, seen.cells):
            continue
        swept = {key: cells for key, cells in by_method.items() if len(_depths(cells)) >= LEAST_DEPTHS}
        bases = {variant: cells for (variant, chosen), cells in swept.items() if chosen == STRICT}
        if bases and len(swept) > 1:
            chaos = _chaos(results, seen, swept, bases)
            if chaos.growths or chaos.equal:
                views.append(chaos)
    return views


def _mirrors(results: Results, cells: list[Cell]) -> bool:
    """Does each pixel have a single path of mirrored rays, no tree and no mean of samples?"""
    if any(cell.parameters.get("sampler", "one") != "one" for cell in cells):
        return False
    needs = {need for cell in cells if cell.timed for need in results.records[cell.timed[0]]["needs"]}
    return "reflection" in needs and not needs & {"transmission", "glossy", "lens", "soft"}


def _depths(cells: list[Cell]) -> list[Cell]:
    """Returns the cells of depth 0, 1, 2, .. up to the first gap."""
    by_depth = {cell.parameters["depth"]: cell for cell in cells}
    prefix = []
    while len(prefix) in by_depth:
        prefix.append(by_depth[len(prefix)])
    return prefix


def _chaos(results: Results, seen: View, swept: dict, bases: dict) -> Chaos:
    first = "cpp" if "cpp" in bases else next(iter(bases))
    light = {variant: _light(results, cells) for variant, cells in bases.items()}
    growths, equal, lacking = [], [], []
    for (variant, chosen), cells in swept.items():
        # Strict float64 is compared with another variant's, other arithmetics with the same variant's.
        against = variant if variant in bases and chosen != STRICT else first
        if (variant, chosen) == (first, STRICT):
            continue
        label = f"{variant}, {precision.name(chosen)}"
        lights, other = _light(results, cells), light[against]
        wrong = next((side for side in (lights, other) if isinstance(side, Missing)), None)
        if wrong is not None:
            lacking.append(f"{label}: {wrong}")
        elif all(np.array_equal(a, b) for (a, _), (b, _) in zip(lights, other, strict=False)):
            equal.append(f"{label} (and {against})")
        else:
            growths.append(_growth(variant, chosen, against, lights, other))
    return Chaos(seen, growths, equal, lacking)


def _light(results: Results, cells: list[Cell]) -> list[tuple[np.ndarray, np.ndarray]] | Missing:
    """Returns for bounce 1, 2, ..: its light, (height, width, 3), and the picture up to it."""
    pictures = [stored.picture(results, cell) for cell in _depths(cells)]
    for cell, picture in zip(cells, pictures, strict=False):
        if isinstance(picture, Missing):
            return Missing(f"depth {cell.parameters['depth']}: {picture.reason}")
    return [(after - before, after) for before, after in itertools.pairwise(pictures)]


def _growth(variant: str, chosen: tuple[str, str], against: str, lights: list, right: list) -> Growth:
    bounces, off, reached = [], [], []
    rng = np.random.default_rng(1)
    for number, ((light, _), (truth, picture)) in enumerate(zip(lights, right, strict=False), 1):
        reaches = np.abs(truth).max(axis=-1) > 0
        difference = np.abs(light - truth).max(axis=-1)
        if not reaches.any():
            break
        some = truth[reaches]
        apart = np.abs(some - some[rng.permutation(len(some))]).max(axis=-1)
        floor = FLOOR * UNITS[chosen[0]] * float(np.median(picture[reaches].max(axis=-1)))
        median = float(np.median(difference[reaches]))
        bounces.append(Bounce(number, int(reaches.sum()), median, float(np.median(apart)), floor))
        off.append(difference)
        reached.append(reaches)
    alone = Growth(variant, chosen, against, bounces, Missing("not fitted"), None)
    growth, start = _fit(alone.fitted, off, reached)
    return Growth(variant, chosen, against, bounces, growth, start)


def _fit(fitted: list[Bounce], off: list[np.ndarray], reached: list[np.ndarray]) -> tuple[Estimate | Missing, float]:
    """Fits g by least squares of the log of the median on the bounce; returns g and the line at bounce 0."""
    if len(fitted) < LEAST_BOUNCES:
        why = f"needs {LEAST_BOUNCES} bounces between rounding and saturation, has {len(fitted)}"
        return Missing(why), None
    numbers = np.array([bounce.number for bounce in fitted], dtype=float)
    pull = (numbers - numbers.mean()) / ((numbers - numbers.mean()) ** 2).sum()
    logs = np.log([bounce.median for bounce in fitted])
    slope = float(pull @ logs)
    start = float(np.exp(logs.mean() - slope * numbers.mean()))
    blocks = Blocks(*off[0].shape)
    if blocks.weights is None:
        return Estimate(float(np.exp(slope)), None, None, blocks.count, "too few blocks of pixels"), start
    medians = np.array([blocks.medians(off[b.number - 1], reached[b.number - 1]) for b in fitted])
    with np.errstate(divide="ignore"):
        slopes = pull @ np.log(medians)
    low, high = resampling.ends(np.exp(slopes))
    return Estimate(float(np.exp(slope)), low, high, blocks.count), start
