"""Reports what more threads gain: speed-up and efficiency, with Amdahl's and Gustafson's laws fitted.

Amdahl (AFIPS 1967, p. 483): of one work, a share p of the time of one thread is divided by n threads; S = 1 / ((1 - p)
+ p / n). Gustafson (CACM 31, 1988, p. 532): the work grows with n, and a share a of the time of n threads is serial;
S = n - a (n - 1).
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.lines import Line2D

from harness.statistics import statistics
from harness.statistics.statistics import LEVEL, Estimate
from reports.paper import markdown, quantity, style, table, thinning
from reports.run import ranking
from reports.run.cell import Cell, Missing
from reports.run.results import Results, grouped
from reports.scaling import crossing
from reports.scaling.sweep import PIXELS

TITLE = "Threads: speed-up and efficiency"
SAME_WORK = 0.02  # of the pixels of a thread, which whole sides round
RESAMPLES = 999
MOST = 12  # lines of a figure
MARKERS = "osD^vP*X<>ph"
ROOM = 1.3  # times the highest point: an interval that goes on beyond is cut off
CAPTION = (
    "Speed-up S: the time of one thread over that of n threads of the same renderer, paired by round as in the table "
    "of times; where the work grows with the threads, times the work. Efficiency: S / n. Curves: Amdahl's law S = 1 / "
    "((1 - p) + p / n), fitted where the work is the same (strong scaling), by least squares of T = a + b / n with "
    "weights 1 / T², p = b / (a + b); Gustafson's law S = n - a (n - 1), where the pixels of a thread stay the same "
    "within 2 % (weak scaling), with weights 1 / S². [low, high]: 95 % interval, bootstrap over rounds. Hollow: more "
    "threads than usable cores; the laws know of no such threads, and the fit leaves these out. Off: the largest "
    "deviation of the law from a fitted S."
)
CSV_HEADER = (
    "line", "law", "threads", "pixels", "speed_up", "low", "high", "efficiency", "of_law", "fitted", "processes",
)  # fmt: skip
LAWS_HEADER = "line", "law", "name", "value", "low", "high", "off", "note"


def amdahl(share: float, threads):
    """Returns the speed-up of one work of which the share can be divided."""
    return 1 / (1 - share + share / threads)


def gustafson(serial: float, threads):
    """Returns the speed-up where the work grows with the threads, of whose time the share `serial` is not divided."""
    return threads - serial * (threads - 1)


def _least_squares(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Returns the numbers x >= 0 with the least |matrix x - right|."""
    from scipy import optimize  # here, since it takes long to import, and few runs have laws

    return optimize.nnls(matrix, right)[0]


def _amdahl_fit(threads: np.ndarray, works: np.ndarray, times: np.ndarray) -> float:
    """Returns the share p that weighted least squares finds."""
    a, b = _least_squares(np.column_stack([1 / times, 1 / (threads * times)]), np.ones(len(times)))
    return b / (a + b)


def _gustafson_fit(threads: np.ndarray, works: np.ndarray, times: np.ndarray) -> float:
    """Returns the serial share a, likewise."""
    gain = works / works[0] * times[0] / times
    (serial,) = _least_squares(((threads - 1) / gain)[:, None], (threads - gain) / gain)
    return min(1.0, serial)


@dataclass(frozen=True)
class Law:
    """A law of speed-up. name: of its share. speed_up: by share and threads. fit: the share by threads, work, times."""

    title: str
    name: str
    scaling: str
    speed_up: Callable
    fit: Callable
    absent: str


AMDAHL = Law(
    "Amdahl", "p", "strong scaling", amdahl, _amdahl_fit,
    "no picture was made with two numbers of threads, one of them 1",
)  # fmt: skip
GUSTAFSON = Law(
    "Gustafson", "a", "weak scaling", gustafson, _gustafson_fit,
    "the work does not grow with the threads: no pictures have as many pixels a thread",
)  # fmt: skip


@dataclass(frozen=True)
class Line:
    """Cells of one variant by their rising number of threads, the first with one.

    gains: speed-ups. fitted: how many of the first cells the law is fitted to. share: of the law.
    """

    variant: str
    label: str
    law: Law
    cells: list[Cell]
    gains: list[Estimate]
    fitted: int
    share: Estimate | Missing

    @property
    def threads(self) -> np.ndarray:
        return _threads(self.cells)

    @property
    def off(self) -> float | None:
        """The largest relative deviation of the law from a speed-up that it is fitted to; None without a fit."""
        if isinstance(self.share, Missing):
            return None
        law = self.law.speed_up(self.share.value, self.threads[: self.fitted])
        return max(abs(law / [gain.value for gain in self.gains[: self.fitted]] - 1))


def _threads(cells: list[Cell]) -> np.ndarray:
    return np.array([cell.parameters["threads"] for cell in cells], dtype=float)


def varied(results: Results) -> list[Cell]:
    """Returns the cells of a run that sweeps numbers of threads; [] for another run."""
    cells = [cell for cell in results.cells if "threads" in cell.swept and not cell.apart and not cell.gpu]
    return cells if len({cell.parameters["threads"] for cell in cells}) > 1 else []


def lines_of(results: Results) -> list[Line]:
    """Returns the lines of both laws, in the order of the run."""
    ranked = [cell for cell in varied(results) if not cell.unranked]
    lines = []
    for law, free in ((AMDAHL, ("threads",)), (GUSTAFSON, ("threads", *PIXELS.keys))):
        groups = grouped(ranked, lambda cell, free=free: (cell.scene, cell.variant, *_rest(cell, free)))
        for group in groups.values():
            for single in [cell for cell in group if cell.parameters["threads"] == 1]:
                cells = _alike(single, group) if law is GUSTAFSON else group
                if len(cells) > 1:
                    lines.append(_line(results, law, sorted(cells, key=lambda cell: cell.parameters["threads"])))
    return lines


def _rest(cell: Cell, free: tuple[str, ...]) -> list[str]:
    return [f"{key} = {value}" for key, value in cell.swept.items() if key not in free]


def _alike(single: Cell, cells: list[Cell]) -> list[Cell]:
    """Returns cells with the same pixels a thread as a cell of one thread, one for each number of threads."""

    def off(cell: Cell) -> float:
        return abs(cell.pixels / cell.parameters["threads"] / single.pixels - 1)

    near = sorted((cell for cell in cells if off(cell) <= SAME_WORK), key=off)
    return [group[0] for group in grouped(near, lambda cell: cell.parameters["threads"]).values()]


def _line(results: Results, law: Law, cells: list[Cell]) -> Line:
    """Fits a law to cells, the first of which has one thread."""
    usable = results.facts["environment"]["cores"].get("usable")
    cores = usable if isinstance(usable, int) else math.inf
    fitted = sum(cell.parameters["threads"] <= cores for cell in cells)
    gains = []
    for cell in cells:
        work, gain = cell.pixels / cells[0].pixels, ranking.ratio(cells[0], cell)
        ends = (None if end is None else work * end for end in (gain.low, gain.high))
        gains.append(replace(gain, value=work * gain.value, **dict(zip(("low", "high"), ends, strict=True))))
    free = ("threads", *PIXELS.keys) if law is GUSTAFSON else ("threads",)
    words = [Path(cells[0].scene).stem] * (len(results.scenes) > 1) + _rest(cells[0], free)
    if law is GUSTAFSON:
        words.append(f"{cells[0].pixels} pixels a thread")
    label = ", ".join([cells[0].variant, *words])
    return Line(cells[0].variant, label, law, cells, gains, fitted, _share(law, cells[:fitted], cores))


def _share(law: Law, cells: list[Cell], cores: float) -> Estimate | Missing:
    """Returns the share of a law with its bootstrap interval."""
    if len(cells) < 2:
        return Missing(f"no more than one thread within the {cores} usable cores")
    threads, works = _threads(cells), np.array([cell.pixels for cell in cells], dtype=float)
    by_round = [cell.rounds("steady_s") for cell in cells]
    values = [np.array(list(rounds.values())) for rounds in by_round]
    share = law.fit(threads, works, np.array([np.median(seconds) for seconds in values]))
    count = min(map(len, values))
    if count < statistics.LEAST:
        return Estimate(share, None, None, count, statistics.too_few(count))
    rng, shares = np.random.default_rng(1), []
    together = len({tuple(rounds) for rounds in by_round}) == 1  # what disturbed a round disturbed all
    for _ in range(RESAMPLES):
        drawn = rng.integers(count, size=count)
        resampled = [
            seconds[drawn] if together else seconds[rng.integers(len(seconds), size=len(seconds))] for seconds in values
        ]
        shares.append(
            law.fit(
                threads, works, np.median(resampled, axis=1) if together else np.array([*map(np.median, resampled)])
            )
        )
    low, high = np.quantile(shares, [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    return Estimate(float(share), float(low), float(high), count)


def draw(results: Results, lines: list[Line]):
    """Draws speed-up and efficiency of lines against threads."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(7.4, 3.2 + 0.16 * len(lines)), layout="constrained")
    counts = sorted({count for line in lines for count in line.threads})
    scale, smooth = crossing.across(counts), np.geomspace(1, counts[-1], 100)
    for axes in (left, right):
        axes.set_xscale(scale.name)
        axes.set_xticks(thinning.few(counts, 9), [f"{count:g}" for count in thinning.few(counts, 9)])
        axes.xaxis.minorticks_off()
        axes.set_xlabel("threads")
        axes.grid(color="#EEEEEE")
    left.plot(counts, counts, ls="--", lw=0.8, color="#888888")
    right.axhline(100, ls="--", lw=0.8, color="#888888")
    points = [(count, gain.value) for line in lines for count, gain in zip(line.threads, line.gains, strict=True)]
    handles = []
    for number, line in enumerate(lines):
        look = {"color": style.colour(line.variant, results.variants), "marker": MARKERS[number % len(MARKERS)]}
        for n, (count, gain) in enumerate(zip(line.threads, line.gains, strict=True)):
            fill = look["color"] if n < line.fitted else "white"
            for axes, by in ((left, 1), (right, count / 100)):
                if gain.low is not None:
                    axes.plot([count] * 2, [gain.low / by, gain.high / by], color=look["color"], lw=1.2)
                axes.plot(count, gain.value / by, **look, mfc=fill, ms=4.5, ls="")
        fits = isinstance(line.share, Estimate)
        if fits:
            law = line.law.speed_up(line.share.value, smooth)
            for axes, drawn in ((left, law), (right, 100 * law / smooth)):
                axes.plot(smooth, drawn, color=look["color"], lw=1, ls="-" if line.law is AMDAHL else "-.")
        said = f"{line.law.name} = {quantity.text(line.share)}" if fits else "no fit"
        handles.append(Line2D([], [], **look, lw=1, ms=4.5, label=f"{line.label}: {line.law.title}, {said}"))
    handles.append(Line2D([], [], color="#888888", ls="--", lw=0.8, label="as many times as fast as there are threads"))
    if scale.name == "log":
        left.set_yscale("log")
        style.log_ticks(left.yaxis)
    else:
        left.set_ylim(0, ROOM * max(*counts, *(gain for _, gain in points)))
    right.set_ylim(0, ROOM * max(100, *(100 * gain / count for count, gain in points)))
    left.set_ylabel("speed-up")
    right.set_ylabel("efficiency (%)")
    figure.legend(handles=handles, loc="outside lower center")
    return figure


def write(results: Results, out: Path) -> str:
    """Writes speedup.png, .svg and .pdf, speedup.csv and speedup-laws.csv; returns the section.

    "" if the run varies no number of threads.
    """
    cells = varied(results)
    if not cells:
        return ""
    lines = lines_of(results)
    parts = [f"## {TITLE}"]
    if lines:
        shown = thinning.few(lines, MOST)
        parts += [style.figure(out / "speedup", TITLE, draw, results, shown), _table(lines)]
        parts.append(thinning.note(len(shown), len(lines), "lines", "the table and the CSV file have all"))
    for law in (AMDAHL, GUSTAFSON):
        if not any(line.law is law for line in lines):
            parts.append(f"{law.title}'s law ({law.scaling}): unavailable: {law.absent}.")
    lost = grouped([cell for cell in cells if cell.unranked], lambda cell: (cell.variant, cell.unranked))
    parts += markdown.listed("Not ranked:", [f"{group[0].name}: {why}" for (_, why), group in lost.items()])
    table.write_lines(out / "speedup.csv", CSV_HEADER, _csv(lines))
    table.write_lines(out / "speedup-laws.csv", LAWS_HEADER, _laws_csv(lines))
    files = ", ".join(f"[{name}]({name})" for name in ("speedup.csv", "speedup-laws.csv"))
    return "\n\n".join(filter(None, [*parts, f"Every point and law: {files}.", markdown.escape(CAPTION)]))


def _table(lines: list[Line]) -> str:
    rows = []
    for line in lines:
        fits, off = isinstance(line.share, Estimate), line.off
        limited = line.law is AMDAHL and line.share.value < 1 if fits else None
        most = quantity.times(1 / (1 - line.share.value)) if limited else "no limit" if fits else "unavailable"
        law, share = f"{line.law.title} ({line.law.scaling})", f"{line.law.name} = " * fits + quantity.text(line.share)
        rows.append([line.label, law, share, most, "unavailable" if off is None else quantity.percent(off)])
    header = ["line", "law", "share", "speed-up of ever more threads", "off"]
    return markdown.table(header, rows)


def _csv(lines: list[Line]) -> Iterator[tuple]:
    for line in lines:
        for n, (count, cell, gain) in enumerate(zip(line.threads, line.cells, line.gains, strict=True)):
            of_law = None if isinstance(line.share, Missing) else line.law.speed_up(line.share.value, count)
            numbers = gain.value, gain.low, gain.high, gain.value / count, of_law
            yield line.label, line.law.title, int(count), cell.pixels, *numbers, n < line.fitted, gain.processes


def _laws_csv(lines: list[Line]) -> Iterator[tuple]:
    for line in lines:
        fits = isinstance(line.share, Estimate)
        numbers = (line.share.value, line.share.low, line.share.high) if fits else (None,) * 3
        note = line.share.note if fits else str(line.share)
        yield line.label, line.law.title, line.law.name, *numbers, line.off, note
