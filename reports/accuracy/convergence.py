"""Measures how the error of a picture falls with its samples: lines along swept samples, and their slopes."""

from collections import Counter
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from harness.statistics.statistics import Estimate
from reports.accuracy import resampling
from reports.accuracy.pareto import DOUBT
from reports.accuracy.resampling import Blocks
from reports.run import method, stored, view
from reports.run.cell import Cell, Missing
from reports.run.results import Results, grouped
from reports.run.view import View

# The draws of a pixel, random or regular, that a parameter causes: n x n samples, feelers, reflected rays.
DIALS = {
    **{"samples": lambda n: n * n, "spp": lambda n: n},
    **{"feelers": lambda n: max(n, 1), "glossy_rays": lambda n: max(n, 1)},
}
METHODS = "sampler", "precision", "epsilon", *method.STEPS, "cutoff", "glossy_weight"
POOLED = ("seed",)  # pictures that differ only in it make one point with their mean squared error
OCTAVES = 4  # for a slope
NEAR = DOUBT  # times the uncertainty of the truth: a smaller error is partly the truth's
CLOSE = 0.1  # largest difference of a slope that agrees with theory
EQUAL = 1e-6  # relative difference of errors that are drawn as one line


@dataclass(frozen=True)
class Point:
    """The error of the pictures with a number of draws per pixel.

    squares: mean over pictures and channels of the squared error, (height, width), the share of the truth's noise taken
    off. uncertainty: of the truth, RMS; 0 for a deterministic truth of a given depth.
    """

    draws: int
    squares: np.ndarray = field(repr=False)
    uncertainty: float

    @cached_property
    def error(self) -> float:
        """RMSE over all pixels, linear RGB."""
        return float(np.sqrt(max(0.0, self.squares.mean())))

    @property
    def fits(self) -> bool:
        """Is it the error of the method rather than of the truth?"""
        return self.error > 0 and self.error >= NEAR * self.uncertainty


@dataclass(frozen=True)
class Line:
    """Points of one method by rising draws, and all variants with the same errors.

    sampler: or, without one, the swept parameter. method: other differences from the lines of its view. slope: of log2
    error on log2 draws. theory: the slope that the experiment names. lacking: the number of cells without a point, by
    reason.
    """

    variants: tuple[str, ...]
    sampler: str
    method: str
    points: list[Point]
    slope: Estimate | Missing
    theory: float | None
    lacking: dict[str, int]

    @property
    def label(self) -> str:
        return ", ".join(filter(None, [self.sampler, self.method]))

    @property
    def fitted(self) -> list[Point]:
        return [point for point in self.points if point.fits]

    @property
    def octaves(self) -> float:
        return octaves(self.fitted)

    @property
    def off(self) -> float | None:
        """The slope minus theory's."""
        return None if self.theory is None or isinstance(self.slope, Missing) else self.slope.value - self.theory


def lines_by_view(results: Results) -> list[tuple[View, list[Line]]]:
    """Returns every view with swept samples, feelers or glossy rays and a truth, with its lines."""
    if not any(record.get("error") for record in results.records):
        return []
    # Without feelers a light is a point, and without glossy rays a mirror is perfect: another picture.
    kinds = grouped(
        (cell for cell in results.cells if cell.parameters.get("sampler") != "adaptive"),
        lambda cell: tuple(bool(cell.parameters.get(dial)) for dial in ("feelers", "glossy_rays")),
    )
    views = [seen for cells in kinds.values() for seen in view.views(cells, (*DIALS, *METHODS, *POOLED))]
    return [(seen, lines) for seen in views if (lines := _lines(results, seen))]


def _draws(cell: Cell, dials: tuple[str, ...]) -> int:
    return int(np.prod([DIALS[dial](cell.parameters.get(dial, 1)) for dial in dials]))


def _lines(results: Results, seen: View) -> list[Line]:
    differing = [key for key in view.differing(seen.cells, METHODS) if key not in ("sampler", "epsilon")]
    groups = grouped(
        seen.cells, lambda cell: (cell.variant, cell.parameters.get("sampler", "one"), method.values(cell, differing))
    )
    for variant, sampler, rest in list(groups):
        # One sample in the middle of the pixel is the grid of 1 x 1.
        if sampler == "one" and (variant, "uniform", rest) in groups:
            groups[variant, "uniform", rest] += groups.pop((variant, sampler, rest))
    lines: list[Line] = []
    for (variant, sampler, rest), cells in groups.items():
        for setting, run in _runs(cells):
            line = _line(results, seen, variant, sampler, ", ".join(filter(None, [rest, setting])), run)
            if line is not None:
                _add(lines, line)
    return lines


def _runs(cells: list[Cell]) -> list[tuple[str, list[Cell]]]:
    """Returns runs of cells with growing draws, each with the values that are constant in it.

    There is one run, unless several combinations of dials make the same number of draws.
    """
    dials = view.differing(cells, tuple(DIALS))
    ways = {tuple(cell.parameters[dial] for dial in dials) for cell in cells}
    if len(ways) == len({_draws(cell, dials) for cell in cells}):
        return [("", cells)]
    longest = max(dials, key=lambda dial: len({cell.parameters[dial] for cell in cells}))
    others = [dial for dial in dials if dial != longest]
    return list(grouped(cells, lambda cell: method.values(cell, others)).items())


def _line(results: Results, seen: View, variant: str, sampler: str, method: str, cells: list[Cell]) -> Line | None:
    dials = view.differing(cells, tuple(DIALS))
    if not dials:
        return None
    pictures: dict[int, list[tuple[np.ndarray, float]]] = {}
    lacking: Counter[str] = Counter()
    for cell in cells:
        error = _squares(results, cell)
        if isinstance(error, Missing):
            lacking[str(error)] += 1
        else:
            pictures.setdefault(_draws(cell, dials), []).append(error)
    points = [
        Point(draws, np.mean([squares for squares, _ in same], axis=0), max(error for _, error in same))
        for draws, same in sorted(pictures.items())
    ]
    kind = sampler if sampler != "one" else ", ".join(dials)  # without samples, the swept parameter says more
    theory = _theory(results, seen, (kind, *dials))
    return Line((variant,), kind, method, points, slope(points), theory, lacking)


def _squares(results: Results, cell: Cell) -> tuple[np.ndarray, float] | Missing:
    """Returns the squared error of each pixel, mean over channels, without the noise of the truth, and the truth's
    uncertainty.
    """
    if cell.status != "ok":
        return Missing(cell.verdict)
    error = results.record(cell).get("error") or {"unavailable": "the experiment asks for no truth"}
    if "unavailable" in error:
        return Missing(error["unavailable"])
    noise = stored.array(results, file) if (file := error.get("standard_error_file")) else np.zeros(1)
    picture, truth = stored.picture(results, cell), stored.truth(results, cell)
    for array in (picture, truth, noise):
        if isinstance(array, Missing):
            return array
    uncertainty = cell.error("uncertainty")
    return ((picture - truth) ** 2 - noise**2).mean(axis=-1), 0.0 if isinstance(uncertainty, Missing) else uncertainty


def _theory(results: Results, seen: View, keys: tuple[str, ...]) -> float | None:
    """Returns the slope that the experiment names for the case or scene, by sampler or swept parameter; else None."""
    theory = results.facts["experiment"].get("theory") or {}
    return next((theory[name][key] for name in seen.names for key in keys if key in theory.get(name, {})), None)


def _add(lines: list[Line], line: Line) -> None:
    """Adds a line, or only its variant to a line with equal errors."""
    for number, other in enumerate(lines):
        same = (line.sampler, line.method, line.lacking) == (other.sampler, other.method, other.lacking)
        if same and _equal(line, other):
            lines[number] = replace(other, variants=(*other.variants, *line.variants))
            return
    lines.append(line)


def _equal(line: Line, other: Line) -> bool:
    pairs = [[(point.draws, point.error) for point in side.points] for side in (line, other)]
    return len(pairs[0]) == len(pairs[1]) and bool(np.allclose(*pairs, rtol=EQUAL, atol=0) if pairs[0] else True)


def octaves(points: list[Point]) -> float:
    return float(np.log2(points[-1].draws / points[0].draws)) if points else 0.0


def slope(points: list[Point]) -> Estimate | Missing:
    """Returns the least squares slope of log2 error on log2 draws over the points that fit, with equal weights.

    Its interval comes from resampled blocks of pixels, the same ones in all pictures of the line.
    """
    used = [point for point in points if point.fits]
    if octaves(used) < OCTAVES:
        near = len(points) - len(used)
        why = f", and {near} points are exact or within {NEAR} times what the truth is known to" if near else ""
        return Missing(f"needs four octaves, has {octaves(used):.3g}{why}")
    logs = np.log2([point.draws for point in used])
    pull = (logs - logs.mean()) / ((logs - logs.mean()) ** 2).sum()
    value = float(pull @ np.log2([point.error for point in used]))
    blocks = Blocks(*used[0].squares.shape)
    if blocks.weights is None:
        return Estimate(value, None, None, blocks.count, "too few blocks of pixels")
    resampled = np.array([blocks.means(point.squares) for point in used])
    some = (resampled > 0).all(axis=0)  # a resample without error has no logarithm
    low, high = resampling.ends(pull @ np.log2(resampled[:, some]) / 2)
    return Estimate(value, low, high, blocks.count)
