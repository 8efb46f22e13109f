"""Reports how close each renderer comes to the machine's limits, beside readable C++, POV-Ray and measured peaks.

The peaks are measured just before each repetition, in the same interleaved run.
"""

from dataclasses import dataclass
from pathlib import Path

from harness.statistics import statistics
from harness.statistics.statistics import Estimate
from reports.paper import markdown, quantity, style, table
from reports.paper.table import Column
from reports.run import launch, ranking
from reports.run.results import Cell, Missing, Results
from reports.scaling import limits_figure, operations

TITLE = "Close to the limit"
CAPTION = (
    "Ratios are of times of a steady frame, paired by round, as in the table of times: to the readable kernel of cpp, "
    "one thread, float64 (below 1 is faster), and the time in which POV-Ray traces, by its own clock and with as many "
    "threads, over the cell's (above 1 is faster): a frame of POV-Ray is a process that starts and reads the scene. "
    "For first hits, the time of a whole frame over the part of Embree's own frame that Embree takes, whose "
    f"rest is NumPy (below 1 is faster). {operations.CAPTION} Peak: before each process a program measured, for "
    "some 20 ms each, the rates of one thread and of as many threads as the renderer has: independent fused "
    "multiply-adds, counted as two operations, in the processor's widest vectors and one number at a time, and bytes "
    "to and from memory. Share of the peak: the median over processes of the rate over the peak of vectors in the "
    "cell's precision on its threads; code that fuses nothing cannot pass half of it. In the figure, code without "
    "vectors has a roof of its own, and renderers with the same number of operations per byte are drawn side by side. "
    "Parallel efficiency: time on one thread over time on several, over the gain of the calibration with the same "
    "threads, round by round: 100 % is all that the machine can gain."
)
NO_TRACE = "POV-Ray did not tell in what time it traced"
NO_PEAKS = "the run measured no peaks (measure.peaks)"
FREE = ("vector", "precision", "epsilon", "threads", "frames", "least_frame")  # in which cells of a group may differ
POV_RAY = {False: "povray", True: "povray-threads"}  # by whether the cell has several threads


@dataclass(frozen=True)
class Limits:
    """Cells that make one picture in any precision, with any lanes and threads.

    base: the readable kernel of cpp on one thread; None if the run lacks it.
    """

    results: Results
    label: str
    cells: list[Cell]

    @property
    def base(self) -> Cell | None:
        return self._find("cpp", vector="off", precision="float64")

    def over_base(self, cell: Cell) -> Estimate | Missing | str:
        return ranking.ratio_to_cell(cell, self.base, "readable cpp in float64 is not in the run")

    def faster_than_pov_ray(self, cell: Cell) -> Estimate | Missing | str:
        """Returns the time in which POV-Ray traces over the time of the cell."""
        name = POV_RAY[threads(cell) > 1]
        if cell.variant == name:
            return "1 (POV-Ray)"
        if cell.unranked:
            return Missing(f"not ranked: {cell.unranked}")
        pov_ray = self._find(name)
        if pov_ray is None:
            return Missing(f"{name} is not in the run")
        traced = pov_ray.rounds("trace_s")
        return ranking.ratio_of_rounds(traced, cell.rounds("steady_s")) if traced else Missing(NO_TRACE)

    def over_search(self, cell: Cell) -> Estimate | Missing:
        """Returns the time of a whole frame of the cell over the time that Embree's search took in its own frame."""
        embree = self._find("embree")
        if embree is None or cell.unranked:
            return Missing(f"not ranked: {cell.unranked}" if cell.unranked else "embree is not in the run")
        times, search = cell.rounds("steady_s"), embree.rounds("search_s")
        both = sorted(times.keys() & search.keys())
        if not both:
            return Missing("its search is not reported")
        return statistics.ratio([times[number] for number in both], [search[number] for number in both], paired=True)

    def share(self, cell: Cell) -> Estimate | Missing:
        """Returns the share of the machine's peak, 0 to 1."""
        count = operations.flops(self.results, cell)
        if isinstance(count, Missing):
            return count
        peaks = self._peaks(cell, "all", cell.parameters["precision"])
        times = cell.rounds("steady_s")
        shared = [count / times[number] / peaks[number] for number in times if number in peaks]
        return statistics.median(shared) if shared else self._no_peaks(cell)

    def rate(self, cell: Cell) -> Estimate | Missing:
        """Returns the floating-point operations per second."""
        return operations.rate(self.results, cell, "steady_s")

    def intensity(self, cell: Cell) -> float | Missing:
        """Returns the floating-point operations per byte moved."""
        count, moved = operations.flops(self.results, cell), operations.moved(self.results, cell)
        if isinstance(count, Missing):
            return count
        return moved if isinstance(moved, Missing) else count / moved

    def speed_up(self, cell: Cell) -> Estimate | Missing:
        """Returns the time of the same renderer's kernel on one thread over its time on several."""
        return self._gain(cell, lambda number: 1.0)

    def efficiency(self, cell: Cell) -> Estimate | Missing:
        """Returns the speed-up over that of the calibration with the same kind of multiply-adds, 0 to 1."""
        kind = ("" if self.vector(cell) == "on" else "scalar_") + cell.parameters["precision"]
        single, all_ = self._peaks(cell, "one", kind), self._peaks(cell, "all", kind)
        if not single:
            return self._no_peaks(cell)
        return self._gain(cell, lambda number: all_[number] / single[number] if number in single else None)

    def _gain(self, cell: Cell, ceiling) -> Estimate | Missing:
        if threads(cell) == 1:
            return Missing("it has one thread")
        if cell.unranked:
            return Missing(f"not ranked: {cell.unranked}")
        alone = self._alone(cell)
        if alone is None:
            return Missing("the same kernel on one thread is not in the run")
        single, many = alone.rounds("steady_s"), cell.rounds("steady_s")
        gains = [
            single[number] / many[number] / ceiling(number) for number in single if number in many and ceiling(number)
        ]
        return statistics.median(gains) if gains else Missing("no round has both")

    def _alone(self, cell: Cell) -> Cell | None:
        """Returns the ranked cell of the same renderer, precision and lanes on one thread; None if there is none."""

        def likeness(other: Cell) -> tuple:
            renderer = (self.results.record(other) or {}).get("renderer")
            return renderer, other.parameters["precision"], other.parameters.get("vector", "off")

        able = (other for other in self.cells if threads(other) == 1 and not other.unranked and not other.gpu)
        return next((other for other in able if likeness(other) == likeness(cell)), None)

    def _peaks(self, cell: Cell, of: str, kind: str) -> dict[int, float]:
        """Returns a rate of the calibrations by round."""
        records = [self.results.records[row] for row in cell.counting]
        rates = {record["repetition"]: (record.get("peaks") or {}).get(of, {}).get(kind) for record in records}
        return {number: value for number, value in rates.items() if value}

    def _no_peaks(self, cell: Cell) -> Missing:
        measured = [self.results.records[row].get("peaks") or {} for row in cell.counting]
        return Missing(next((peaks["unavailable"] for peaks in measured if "unavailable" in peaks), NO_PEAKS))

    def vector(self, cell: Cell) -> str:
        """Returns whether the rays of a cell were in lanes: "on" or "off" (VEC-4)."""
        vector = cell.parameters.get("vector", "off")
        if vector != "auto":
            return vector
        return ((self.results.record(cell) or {}).get("used") or {}).get("methods", {}).get("vector", "off")

    def _find(self, variant: str, **parameters) -> Cell | None:
        """Returns the ranked cell of a variant with the given parameters; None if there is none."""
        cells = (cell for cell in self.cells if cell.variant == variant and not cell.unranked)
        return next(
            (cell for cell in cells if all(cell.parameters.get(key, "off") == parameters[key] for key in parameters)),
            None,
        )


def threads(cell: Cell) -> int:
    return cell.parameters.get("threads", 1)


def pictures(results: Results) -> list[Limits]:
    """Returns each whole picture with the cells that made it; [] for a run that measured no peaks."""
    if not any(record.get("peaks") for record in results.records):
        return []
    sizes = {id(cell): cell.parameters["width"] * cell.parameters["height"] for cell in results.cells}
    cells = [cell for cell in results.cells if not cell.gpu and cell.pixels == sizes[id(cell)]]
    groups = launch.groups(cells, FREE, across_variants=True)
    return [Limits(results, group.label, group.cells) for group in groups]


def columns(limits: Limits) -> list[Column]:
    floor = limits.results.floor.value

    def ratio(value):
        return quantity.ratio(value, floor)

    def lanes(cell: Cell) -> str:
        used = limits.vector(cell)
        return f"{used} (auto)" if cell.parameters.get("vector") == "auto" else used

    if any(cell.parameters.get("kind") == "rays" for cell in limits.cells):
        beside = Column("time ÷ Embree's search", "time_over_search_of_embree", "1", limits.over_search, ratio)
    else:
        beside = Column("POV-Ray's tracing ÷ time", "pov_ray_tracing_over_time", "1", limits.faster_than_pov_ray, ratio)
    return [
        Column("precision", "precision", "", lambda cell: cell.parameters["precision"]),
        Column("lanes", "vector", "", lanes),
        Column("threads", "threads", "1", lambda cell: float(threads(cell)), lambda value: f"{value:.0f}"),
        Column("time ÷ readable cpp", "time_over_readable_cpp", "1", limits.over_base, ratio),
        beside,
        Column("Gflop/s", "flops", "1/s", limits.rate, scale=1e-9),
        Column("share of the peak (%)", "share", "1", limits.share, scale=100),
        Column("flop per byte", "intensity", "1/byte", limits.intensity),
        Column("speed-up", "speed_up", "1", limits.speed_up),
        Column("parallel efficiency (%)", "efficiency", "1", limits.efficiency, scale=100),
    ]


def write(results: Results, out: Path) -> str:
    """Writes limits-*.csv, limits-*.png and .svg for each picture made; returns the section, "" without peaks."""
    groups = pictures(results)
    if not groups:
        return ""
    tables = [(group.label, group.cells, columns(group)) for group in groups]
    parts = [table.section(out, "limits", TITLE, tables, CAPTION, silent=("precision", "vector"))]
    for number, group in enumerate(groups):
        if any(not isinstance(group.rate(cell), Missing) for cell in group.cells):
            path = out / f"limits-{number}-{markdown.slug(group.label)}"
            parts.append(style.figure(path, f"{TITLE}: {group.label}", limits_figure.draw, group))
    return "\n\n".join(parts)
