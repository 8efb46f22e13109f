"""Finds the break-even of a hierarchy: times of frames with it and without by the size of scenes, and its build."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from harness.statistics import statistics
from harness.statistics.statistics import Estimate
from reports.paper import markdown, quantity, style, table
from reports.paper.table import Column
from reports.run import launch, ranking
from reports.run.results import Cell, Missing, Results, grouped, point_label
from reports.scaling import hierarchy_figure
from reports.scaling.complexity_points import counts

TITLE = "Hierarchies: where they pay"
NAMED = ("objects", "size", "accel")  # of a swept point: they vary along a line
ABSENT = "not in the run"
CSV_HEADER = "scene", "variant", "break_even_objects", "measured_below", "measured_above", "frame_s", "note"
CAPTION = (
    "A frame without a hierarchy (accel = none) over one with it (accel = bvh), by the number of objects that a ray is "
    'tested against; ratio, interval and "not resolved" as in the table of times. Build: the phase of that name, once '
    "per process, median over processes. Frames until it pays: the build over the time that each frame then saves, by "
    "the medians. Break-even: where the ratio is 1, with its logarithm interpolated linearly over log objects between "
    "the last measured size whose median is not above 1 and the next size, whose median is; sizes between the two were "
    "not measured."
)


@dataclass(frozen=True)
class Point:
    """One size of a scene.

    none, bvh: the cells without a hierarchy and with it; None if the run lacks one. frames: steady time of a frame, s,
    by "none" and "bvh". built: time of the phase `build`, s.
    """

    objects: int
    none: Cell | None
    bvh: Cell | None
    frames: dict[str, Estimate | Missing]
    built: Estimate | Missing

    @property
    def cell(self) -> Cell:
        return self.bvh or self.none

    def both(self) -> tuple[float, float] | None:
        """Returns the times of a frame without and with it, s; None if one is missing."""
        times = self.frames["none"], self.frames["bvh"]
        return None if any(isinstance(time, Missing) for time in times) else tuple(time.value for time in times)

    @property
    def ratio(self) -> Estimate | Missing:
        """The time of a frame without the hierarchy over the time with it."""
        for time in self.frames.values():
            if isinstance(time, Missing):
                return time
        return ranking.ratio(self.none, self.bvh)


@dataclass(frozen=True)
class Line:
    """Cells of one variant and kind of scene that differ only in size and hierarchy, by their size."""

    scene: str
    variant: str
    label: str
    points: list[Point]


@dataclass(frozen=True)
class BreakEven:
    """objects: where the ratio is 1. seconds: of a frame without a hierarchy there. between: sizes around it."""

    objects: float
    seconds: float
    between: tuple[int, int]


def lines_of(results: Results) -> list[Line]:
    """Returns the lines with both ways and more than one size, in the order of the run."""
    groups: dict[tuple, dict[int, dict[str, Cell]]] = {}
    for cell in results.cells:
        accel, size = cell.parameters.get("accel"), objects(results, cell)
        if cell.apart or accel not in ("none", "bvh") or size is None:
            continue
        swept = {key: value for key, value in cell.swept.items() if key not in NAMED}
        label = ", ".join([cell.variant, *([point_label(swept)] if swept else [])])
        key = cell.scene, cell.variant, label, launch.rest(cell, ("accel",))
        groups.setdefault(key, {}).setdefault(size, {})[accel] = cell
    lines = [
        Line(scene, variant, label, [_point(results, size, cells) for size, cells in sorted(sizes.items())])
        for (scene, variant, label, _), sizes in groups.items()
    ]
    meant = [line for line in lines if len(line.points) > 1 and any(p.none and p.bvh for p in line.points)]
    return sorted(meant, key=lambda line: (results.scenes.index(line.scene), results.variants.index(line.variant)))


def objects(results: Results, cell: Cell) -> int | None:
    """Returns the number of objects that a ray is tested against; None if no record has it."""
    return counts(results.records[cell.timed[0]] if cell.timed else None)[0]


def _point(results: Results, size: int, cells: dict[str, Cell]) -> Point:
    none, bvh = cells.get("none"), cells.get("bvh")
    return Point(size, none, bvh, {"none": _frame(none), "bvh": _frame(bvh)}, _built(results, bvh))


def _frame(cell: Cell | None) -> Estimate | Missing:
    """Returns the steady time of a frame of a ranked cell, s."""
    if cell is None:
        return Missing(ABSENT)
    return Missing(cell.unranked) if cell.unranked else cell.steady


def _built(results: Results, cell: Cell | None) -> Estimate | Missing:
    """Returns the time of the phase `build`, s, median over processes."""
    if cell is None:
        return Missing(ABSENT)
    if cell.status != "ok":
        return Missing(cell.verdict)
    processes = [results.records[row]["phases"] or [] for row in cell.counting]
    spent = [[end - start for name, start, end in phases if name == "build"] for phases in processes]
    if not all(spent):
        return Missing("it reports no phase build")
    return statistics.median([sum(seconds) for seconds in spent])


def pays_after(point: Point) -> float | Missing:
    """Returns the number of frames that save as much time as building takes."""
    both, faster = point.both(), point.ratio
    if both is None:
        return Missing("the time of a frame without it or with it is not known")
    if faster.value <= 1 or both[0] <= both[1]:
        return Missing("never: a frame is not faster with it")
    if statistics.verdict(faster, None) == statistics.NOT_RESOLVED:
        return Missing(f"{statistics.NOT_RESOLVED}: whether a frame is faster with it")
    return point.built if isinstance(point.built, Missing) else point.built.value / (both[0] - both[1])


def break_even(line: Line) -> BreakEven | Missing:
    """Returns the number of objects from which on a frame is faster with the hierarchy."""
    sizes = [(point.objects, point.ratio.value, both[0]) for point in line.points if (both := point.both())]
    if len(sizes) < 2:
        lacking = [time for point in line.points for time in point.frames.values() if isinstance(time, Missing)]
        why = next((time.reason for time in lacking if time.reason != ABSENT), ABSENT)
        return Missing(f"{len(sizes)} size{'s' * (len(sizes) != 1)} with both times, 2 are needed: {why}")
    if sizes[-1][1] <= 1:
        return Missing(f"they do not cross: it is not faster at {sizes[-1][0]} objects, the most with both times")
    for (n, faster, seconds), (m, later, later_seconds) in reversed(list(pairwise(sizes))):
        if faster <= 1:
            share = math.log(faster) / (math.log(faster) - math.log(later))
            return BreakEven(n * (m / n) ** share, seconds * (later_seconds / seconds) ** share, (n, m))
    return Missing(
        f"they do not cross: it is the faster method from {sizes[0][0]} objects on, the fewest with both times"
    )


def columns(results: Results, points: dict[int, Point]) -> list[Column]:
    """Returns the columns of the table. points: by the id of the cell that stands for each."""
    floor = results.floor.value

    def of(value):
        return lambda cell: value(points[id(cell)])

    return [
        Column("objects", "objects", "1", of(lambda p: float(p.objects)), lambda value: f"{value:.0f}"),
        Column("frame, none", "frame_none", "s", of(lambda p: p.frames["none"])),
        Column("frame, bvh", "frame_bvh", "s", of(lambda p: p.frames["bvh"])),
        Column("none ÷ bvh", "none_over_bvh", "1", of(lambda p: p.ratio), lambda value: quantity.ratio(value, floor)),
        Column("build", "build", "s", of(lambda p: p.built)),
        Column("frames until it pays", "frames_until_it_pays", "1", of(pays_after)),
    ]


def write(results: Results, out: Path) -> str:
    """Writes hierarchy*.csv, .png and .svg; returns the section, "" if accel was not varied over sizes of a scene."""
    lines = lines_of(results)
    if not lines:
        return ""
    points = {id(point.cell): point for line in lines for point in line.points}
    shown = columns(results, points)
    tables = [
        (scene, [point.cell for line in scene_lines for point in line.points], shown)
        for scene, scene_lines in grouped(lines, lambda line: line.scene).items()
    ]
    crossings = [(line, break_even(line)) for line in lines]
    table.write_lines(out / "hierarchy-break-even.csv", CSV_HEADER, _csv(crossings))
    parts = [table.section(out, "hierarchy", TITLE, tables, CAPTION, silent=NAMED), "### Break-even", _table(crossings)]
    parts.append("[hierarchy-break-even.csv](hierarchy-break-even.csv)")
    if any(not isinstance(time, Missing) for point in points.values() for time in point.frames.values()):
        parts.append(style.figure(out / "hierarchy", TITLE, hierarchy_figure.draw, results, crossings))
    return "\n\n".join(parts)


def gist(results: Results) -> str:
    """Returns a sentence on the fewest and the most objects from which on a hierarchy pays; "" if none is known."""
    crossings = [(line, break_even(line)) for line in lines_of(results)]
    break_evens = [(crossing.objects, line) for line, crossing in crossings if not isinstance(crossing, Missing)]
    if not break_evens:
        return ""
    ends = [min(break_evens, key=lambda pair: pair[0]), max(break_evens, key=lambda pair: pair[0])]
    said = [f"{quantity.plain(objects, 2)} objects ({line.variant}, {Path(line.scene).stem})" for objects, line in ends]
    return f"A frame is faster with a hierarchy from {' to '.join(dict.fromkeys(said))} on."


def _table(crossings: list[tuple[Line, BreakEven | Missing]]) -> str:
    rows = []
    for line, crossing in crossings:
        crosses = not isinstance(crossing, Missing)
        between = f"{crossing.between[0]} and {crossing.between[1]} objects" if crosses else ""
        faster = f"{quantity.plain(crossing.objects)} objects" if crosses else str(crossing)
        rows.append([Path(line.scene).stem, line.label, faster, between or "unavailable"])
    return markdown.table(["scene", "renderer", "faster from", "measured at"], rows)


def _csv(crossings: list[tuple[Line, BreakEven | Missing]]) -> Iterator[tuple]:
    for line, crossing in crossings:
        missing = isinstance(crossing, Missing)
        numbers = (None,) * 4 if missing else (crossing.objects, *crossing.between, crossing.seconds)
        yield line.scene, line.label, *numbers, str(crossing) if missing else ""
