"""How the error of a picture falls with its samples: lines through swept samples, and their slopes."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from harness.statistics.statistics import Estimate
from reports.accuracy import resampling
from reports.accuracy.resampling import Blocks
from reports.run import method, stored, view
from reports.run.cell import Cell, Missing
from reports.run.results import Results
from reports.run.view import View

# How many random or regular draws of a pixel a parameter stands for: n x n samples, feelers, reflected rays.
DIALS = {"samples": lambda n: n * n, "feelers": lambda n: max(n, 1), "glossy_rays": lambda n: max(n, 1)}
METHODS = "sampler", "precision", "epsilon", "floating_point", *method.STEPS, "cutoff", "glossy_weight"
POOLED = ("seed",)  # pictures that differ in it alone are of one point, which has their mean square error
OCTAVES = 4  # that a slope needs
NEAR = 3  # standard errors of the truth: an error below so many is partly the truth's
CLOSE = 0.1  # between a slope and theory's
EQUAL = 1e-6  # relative, of errors that are drawn as one line


@dataclass(frozen=True)
class Point:
    """The error of the pictures with so many draws a pixel. squares: mean over pictures and channels of the squared
    error, (height, width). standard_error: of the truth, root mean square over pixels; 0 of a deterministic one."""

    draws: int
    squares: np.ndarray = field(repr=False)
    standard_error: float

    @cached_property
    def error(self) -> float:
        """RMSE over all pixels, linear RGB."""
        return float(np.sqrt(self.squares.mean()))

    @property
    def fits(self) -> bool:
        """Is it the method's error, and not the truth's?"""
        return self.error > 0 and self.error >= NEAR * self.standard_error


@dataclass(frozen=True)
class Line:
    """Points of one method along a sweep, draws rising, and all variants that have these errors.

    sampler: or, where there is none, what is swept. method: what else tells it from other lines of its view. slope: of
    log2 error on log2 draws. theory: the slope that the experiment names. lacking: why cells have no point, how many.
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
        """Slope less theory's."""
        return None if self.theory is None or isinstance(self.slope, Missing) else self.slope.value - self.theory


def found(results: Results) -> list[tuple[View, list[Line]]]:
    """Every view in which samples, feelers or glossy rays were swept against a truth, with its lines."""
    if not any(record.get("error") for record in results.records):
        return []
    kinds: dict[tuple, list[Cell]] = {}
    for cell in results.cells:
        if cell.parameters.get("sampler") != "adaptive":
            # Without feelers a light is a point, and without glossy rays a mirror is perfect: another picture.
            key = tuple(bool(cell.parameters.get(dial)) for dial in ("feelers", "glossy_rays"))
            kinds.setdefault(key, []).append(cell)
    seen = [one for cells in kinds.values() for one in view.views(cells, (*DIALS, *METHODS, *POOLED))]
    told = [(one, _lines(results, one)) for one in seen]
    return [(one, lines) for one, lines in told if lines]


def _draws(cell: Cell, dials: tuple[str, ...]) -> int:
    return int(np.prod([DIALS[dial](cell.parameters.get(dial, 1)) for dial in dials]))


def _lines(results: Results, seen: View) -> list[Line]:
    telling = [key for key in view.differing(seen.cells, METHODS) if key not in ("sampler", "epsilon")]
    groups: dict[tuple, list[Cell]] = {}
    for cell in seen.cells:
        method = ", ".join(f"{key} = {cell.parameters[key]}" for key in telling)
        groups.setdefault((cell.variant, cell.parameters["sampler"], method), []).append(cell)
    for variant, sampler, method in list(groups):
        # One sample in the middle of the pixel is the grid of 1 x 1.
        if sampler == "one" and (variant, "uniform", method) in groups:
            groups[variant, "uniform", method] += groups.pop((variant, sampler, method))
    lines: list[Line] = []
    for (variant, sampler, method), cells in groups.items():
        for held, mine in _runs(cells):
            line = _line(results, seen, variant, sampler, ", ".join(filter(None, [method, held])), mine)
            if line is not None:
                _add(lines, line)
    return lines


def _runs(cells: list[Cell]) -> list[tuple[str, list[Cell]]]:
    """Cells along which the draws grow, and what is held there: all of them, unless two ways lead to as many draws."""
    dials = view.differing(cells, tuple(DIALS))
    ways = {tuple(cell.parameters[dial] for dial in dials) for cell in cells}
    if len(ways) == len({_draws(cell, dials) for cell in cells}):
        return [("", cells)]
    longest = max(dials, key=lambda dial: len({cell.parameters[dial] for cell in cells}))
    held: dict[str, list[Cell]] = {}
    for cell in cells:
        others = ", ".join(f"{dial} = {cell.parameters[dial]}" for dial in dials if dial != longest)
        held.setdefault(others, []).append(cell)
    return list(held.items())


def _line(results: Results, seen: View, variant: str, sampler: str, method: str, cells: list[Cell]) -> Line | None:
    dials = view.differing(cells, tuple(DIALS))
    if not dials:
        return None
    pictures: dict[int, list[tuple[np.ndarray, float]]] = {}
    lacking: dict[str, int] = {}
    for cell in cells:
        error = _squares(results, cell)
        if isinstance(error, Missing):
            lacking[str(error)] = lacking.get(str(error), 0) + 1
        else:
            pictures.setdefault(_draws(cell, dials), []).append(error)
    points = [
        Point(draws, np.mean([squares for squares, _ in told], axis=0), max(error for _, error in told))
        for draws, told in sorted(pictures.items())
    ]
    kind = sampler if sampler != "one" else ", ".join(dials)  # without samples, what is swept tells more
    theory = _theory(results, seen, (kind, *dials))
    return Line((variant,), kind, method, points, slope(points), theory, lacking)


def _squares(results: Results, cell: Cell) -> tuple[np.ndarray, float] | Missing:
    """Squared error of each pixel against the truth, mean over channels, and the standard error of the truth."""
    if cell.status != "ok":
        return Missing(cell.verdict)
    error = results.record(cell).get("error") or {"unavailable": "no truth was asked for"}
    if "unavailable" in error:
        return Missing(error["unavailable"])
    picture, truth = stored.picture(results, cell), stored.array(results, error["truth_file"])
    for one in (picture, truth):
        if isinstance(one, Missing):
            return one
    return ((picture - truth) ** 2).mean(axis=-1), error["standard_error"] or 0.0


def _theory(results: Results, seen: View, keys: tuple[str, ...]) -> float | None:
    """The slope that the experiment has for the case or scene, by sampler or by what is swept."""
    told = results.facts["experiment"].get("theory") or {}
    return next((told[name][key] for name in seen.names for key in keys if key in told.get(name, {})), None)


def _add(lines: list[Line], line: Line) -> None:
    """Add a line, or its variant to one of equal errors."""
    for number, other in enumerate(lines):
        if (line.sampler, line.method, line.lacking) == (other.sampler, other.method, other.lacking) and _equal(
            line, other
        ):
            lines[number] = Line(**{**vars(other), "variants": (*other.variants, *line.variants)})
            return
    lines.append(line)


def _equal(line: Line, other: Line) -> bool:
    pairs = [[(point.draws, point.error) for point in one.points] for one in (line, other)]
    return len(pairs[0]) == len(pairs[1]) and bool(np.allclose(*pairs, rtol=EQUAL, atol=0) if pairs[0] else True)


def octaves(points: list[Point]) -> float:
    return float(np.log2(points[-1].draws / points[0].draws)) if points else 0.0


def slope(points: list[Point]) -> Estimate | Missing:
    """The least squares slope of log2 error on log2 draws, all points weighing alike, of those that fit.

    Its interval is by resampling blocks of pixels, the same ones in all pictures of the line.
    """
    used = [point for point in points if point.fits]
    if octaves(used) < OCTAVES:
        near = len(points) - len(used)
        why = f", and {near} points are exact or within {NEAR} standard errors of the truth" if near else ""
        return Missing(f"needs four octaves, has {octaves(used):.3g}{why}")
    logs = np.log2([point.draws for point in used])
    pull = (logs - logs.mean()) / ((logs - logs.mean()) ** 2).sum()
    value = float(pull @ np.log2([point.error for point in used]))
    blocks = Blocks(*used[0].squares.shape)
    if blocks.weights is None:
        return Estimate(value, None, None, blocks.count, "too few blocks of pixels")
    resampled = np.array([blocks.means(point.squares) for point in used])
    some = (resampled > 0).all(axis=0)  # a resample without any error has no logarithm
    low, high = resampling.ends(pull @ np.log2(resampled[:, some]) / 2)
    return Estimate(value, low, high, blocks.count)
