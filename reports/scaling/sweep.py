"""Finds the numbers that a run varies, and the lines of renderers and methods along each."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations
from pathlib import Path

from harness.statistics.statistics import Estimate
from reports.run import command, gpu, launch
from reports.run.cell import Cell, Missing
from reports.run.results import Results, grouped
from reports.scaling.complexity_points import counts

SHAPES = launch.SHAPE  # reports/gpu draws them
ASIDE = ("processes", "frames", "least_frame")  # how it was measured
KINDS = ("case", "region", "seed")  # numbers or not, they order nothing


@dataclass(frozen=True)
class Axis:
    """A number that a run varies.

    keys: of swept values that make it. of: its value in a cell, None if not known. unit: says a value in words, after
    "at about".
    """

    name: str
    keys: tuple[str, ...]
    of: Callable[[Results, Cell], float | None]
    unit: str = ""

    def words(self, value: float, square: bool = False) -> str:
        """Returns a value in words: "300 × 300 pixels", "12 lights", "cutoff 0.01"."""
        if square:
            return "{0} × {0} {1}".format(digits(math.sqrt(value)), self.unit)
        unit = self.unit.removesuffix("s") if value == 1 else self.unit
        return f"{digits(value)} {unit}" if unit else f"{self.name} {digits(value)}"


def digits(value: float) -> str:
    """Returns whole numbers in full, other numbers to three digits."""
    return f"{value:,.0f}" if value == round(value) else f"{value:.3g}"


def _counted(place: int, key: str) -> Callable:
    """Returns a function for the number of objects or lights of a cell's scene."""

    def of(results: Results, cell: Cell) -> float | None:
        count = counts(results.records[cell.timed[0]] if cell.timed else None)[place]
        return cell.swept.get(key) if count is None else count

    return of


def _parameter(key: str) -> Callable:
    return lambda _, cell: cell.parameters.get(key, cell.swept.get(key))


PIXELS = Axis("pixels", ("side", "width", "height", "scale"), lambda _, cell: cell.pixels, "pixels")
NAMED = (
    PIXELS,
    Axis("depth", ("depth",), _parameter("depth")),
    Axis("objects", ("objects", "size"), _counted(0, "objects"), "objects"),
    Axis("lights", ("lights",), _counted(1, "lights"), "lights"),
    Axis("threads", ("threads",), _parameter("threads"), "threads"),
    Axis("rays", ("rays",), _parameter("rays"), "rays"),
)
ALWAYS = NAMED[:4]  # told in the title of a panel, whatever their values


@dataclass(frozen=True)
class Quantity:
    """What is drawn against an axis. of: its value in a cell, in `unit`. crosses: what a line does that falls below."""

    name: str
    title: str
    unit: str
    of: Callable[[Cell], Estimate | Missing]
    crosses: str = ""


def _time(cell: Cell) -> Estimate | Missing:
    return Missing(cell.unranked) if cell.unranked and not cell.simulated else cell.steady


def _error(cell: Cell) -> Estimate | Missing:
    error = cell.error()
    return error if isinstance(error, Missing) else Estimate(error, None, None, len(cell.timed))


TIME = Quantity("time", "steady frame", "s", _time, "overtakes")
ERROR = Quantity("error", "error (RMSE, linear RGB)", "1", _error)
MEMORY = Quantity(
    "memory", "peak memory", "B", lambda cell: cell.median("peak_bytes", "not reported"), "needs less memory than"
)
RAYS = Quantity("rays", "number of rays of a frame", "1", lambda cell: cell.median("rays", "not reported"))
QUANTITIES = TIME, ERROR, MEMORY, RAYS


@dataclass(frozen=True)
class Line:
    """Cells of one renderer and method along an axis, each with its value of the axis, which rises."""

    variant: str
    label: str
    cells: list[tuple[float, Cell]]

    def points(self, quantity: Quantity) -> list[tuple[float, Estimate]]:
        """Returns the known values of a quantity."""
        values = [(x, quantity.of(cell)) for x, cell in self.cells]
        return [(x, value) for x, value in values if isinstance(value, Estimate)]


@dataclass(frozen=True, eq=False)
class Panel:
    """A chart of lines along one axis; everything else that is a number is the same in all its cells.

    scene: its scene or case. fixed: the values of the other axes, in words. mark: what must be said across it.
    squares: its axis is that of pixels, and all its pictures are as wide as high.
    """

    axis: Axis
    scene: str
    fixed: str
    lines: list[Line]
    mark: str
    squares: bool

    @property
    def label(self) -> str:
        return ", ".join(filter(None, [self.scene, self.fixed]))

    @property
    def values(self) -> list[float]:
        """The values of the axis, rising."""
        return sorted({x for line in self.lines for x, _ in line.cells})

    def words(self, value: float) -> str:
        """Returns a value of the axis in words."""
        return self.axis.words(value, self.squares)


def axes(results: Results) -> list[Axis]:
    """Returns the numbers that a run varies, but for shapes of launches."""
    swept = dict.fromkeys(key for cell in results.cells for key in cell.swept)
    numbers = [key for key in swept if key not in (*SHAPES, *ASIDE, *KINDS) and _is_number(results, key)]
    others = [Axis(key.replace("_", " "), (key,), _parameter(key)) for key in numbers]
    named = [axis for axis in NAMED if any(key in numbers for key in axis.keys)]
    keys = {key for axis in named for key in axis.keys}
    return named + [axis for axis in others if not keys & set(axis.keys)]


def _is_number(results: Results, key: str) -> bool:
    """Is a swept key a number in all cells, as the renderer got it: "2^-6" is one, "default" threads are too?"""
    values = [cell.parameters.get(key, cell.swept[key]) for cell in results.cells if key in cell.swept]
    switches = any(isinstance(cell.swept.get(key), bool) for cell in results.cells)
    return not switches and all(isinstance(value, (int, float)) for value in values)


def comparable(results: Results) -> list[Cell]:
    """Returns the cells that comparisons include; without any those of a simulator, which charts are marked for."""
    return [cell for cell in results.cells if not cell.apart] or [cell for cell in results.cells if cell.simulated]


@lru_cache(maxsize=4)
def panels(results: Results) -> list[Panel]:
    """Returns a panel for each axis, and for each set of values of what else varies; none where nothing varies.

    Each has a line with a time at two values of the axis or more.
    """
    along, cells = axes(results), comparable(results)
    at = {cell: {axis.name: axis.of(results, cell) for axis in along} for cell in cells}
    names = _methods(cells, along)
    charts = []
    for axis in along:
        groups = grouped(
            (cell for cell in cells if at[cell][axis.name] is not None),
            lambda cell, axis=axis: (
                _scene(cell), *(cell.swept.get(key) for key in SHAPES),
                *(value for name, value in at[cell].items() if name != axis.name),
            ),
        )  # fmt: skip
        kept = []
        for group in groups.values():
            lines = [
                Line(variant, ", ".join(filter(None, [variant, method])), _along(axis, line, at))
                for (variant, method), line in grouped(group, lambda cell: (cell.variant, names[cell])).items()
            ]
            if any(len({x for x, _ in line.points(TIME)}) > 1 for line in lines):
                kept.append((group, lines))
        title_axes = _told([group[0] for group, _ in kept], [other for other in along if other is not axis], at)
        for group, lines in kept:
            squares = axis is PIXELS and all(cell.size[0] == cell.size[1] for cell in group)
            scene = ", ".join(filter(None, _scene(group[0]))) if len({_scene(cell) for cell in cells}) > 1 else ""
            charts.append(
                Panel(axis, scene, _fixed(group[0], title_axes, at), lines, gpu.mark(results, group), squares)
            )
    return charts


def crossed(results: Results) -> list[tuple[Axis, Axis, str, dict[tuple[float, float], Cell]]]:
    """Returns pairs of axes that a run of one renderer and method varies together, a label, and the cells by values.

    At least half of the combinations of their values have a cell.
    """
    along, cells = axes(results), comparable(results)
    names = _methods(cells, along)
    if len({(cell.variant, names[cell]) for cell in cells}) > 1:
        return []
    at = {cell: {axis.name: axis.of(results, cell) for axis in along} for cell in cells}
    pairs = []
    for first, other in combinations(along, 2):
        rest = [axis for axis in along if axis not in (first, other)]
        groups = grouped(cells, lambda cell, rest=rest: (_scene(cell), *(at[cell][axis.name] for axis in rest)))
        for group in groups.values():
            by_value = {(at[cell][first.name], at[cell][other.name]): cell for cell in group}
            columns, rows = ({values[place] for values in by_value} for place in (0, 1))
            if min(len(columns), len(rows)) > 1 and len(by_value) >= len(columns) * len(rows) / 2:
                words = _fixed(group[0], _told([group[0]], rest, at), at)
                label = ", ".join(filter(None, [_scene(group[0])[0], group[0].variant, words]))
                pairs.append((first, other, label, by_value))
    return pairs


def _scene(cell: Cell) -> tuple[str, str]:
    """Returns the case or scene of a cell, and its region if that was swept."""
    region = cell.swept.get("region")
    return str(cell.swept.get("case") or Path(cell.scene).stem), "" if region is None else f"region {region}"


def _methods(cells: list[Cell], along: list[Axis]) -> dict[Cell, str]:
    """Returns the name of the method of each cell: its swept values that are no number of an axis, differ, and are not
    the default; the precision is always told."""
    numbers = {key for axis in along for key in axis.keys} | {*SHAPES, *ASIDE, "case", "region"}
    keys = [key for key in dict.fromkeys(key for cell in cells for key in cell.swept) if key not in numbers]
    keys = [key for key in keys if len({str(cell.swept.get(key)) for cell in cells}) > 1]
    return {cell: ", ".join(filter(None, (_word(key, cell.swept.get(key)) for key in keys))) for cell in cells}


def _word(key: str, value) -> str:
    if key == "precision":
        return str(value or "")
    if value is None or value == command.default(key):
        return ""
    if key == "vector":
        return {"on": "in lanes", "auto": "in lanes where faster"}.get(value, "")
    if isinstance(value, bool):
        return key if value else f"no {key}"
    return f"{key.replace('_', ' ')} {value}"


def _along(axis: Axis, cells: list[Cell], at: dict[Cell, dict]) -> list[tuple[float, Cell]]:
    return sorted(((at[cell][axis.name], cell) for cell in cells), key=lambda pair: pair[0])


def _told(cells: list[Cell], others: list[Axis], at: dict[Cell, dict]) -> list[Axis]:
    """Returns the axes whose values are told of these cells: not those that are as by default in all of them."""
    return [
        axis
        for axis in others
        if axis in ALWAYS or any(at[cell][axis.name] != command.default(axis.keys[0]) for cell in cells)
    ]


def _fixed(cell: Cell, title_axes: list[Axis], at: dict[Cell, dict]) -> str:
    """Returns the values of axes in words."""
    square = cell.size[0] == cell.size[1]
    values = [(axis, at[cell][axis.name]) for axis in title_axes if at[cell][axis.name] is not None]
    return ", ".join(axis.words(value, square and axis is PIXELS) for axis, value in values)
