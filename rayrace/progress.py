"""The progress of a run: one line on a terminal, a plain line for each repetition elsewhere.

Nothing is drawn while a renderer is measured: the line changes between repetitions only.
"""

import os
import statistics
import sys
from bisect import insort
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.live import Live
from rich.markup import escape
from rich.text import Text

from harness.statistics import steady
from harness.store import record as rows
from rayrace.terminal import spell, verdict
from reports.paper import quantity

BAR = 12  # characters


class Standings:
    """The times so far of the variants at one place, each the median over its processes.

    The place is the one with the most variants, of several the one with the most work.
    """

    def __init__(self, cells: Sequence):
        places = {}
        for cell in cells:
            if cell.refused is None and not cell.stressed and cell.parameters.frames:
                places.setdefault((cell.scene, repr(cell.point)), []).append(cell)
        most = max(places.values(), key=lambda group: (len(group), group[0].work), default=[])
        self.names = {cell.key: cell.entry.name for cell in most} if len(most) > 1 else {}
        self.times: dict[str, list[float]] = {}

    def add(self, cell, record: dict) -> None:
        """Counts a repetition."""
        if cell.key in self.names and record["status"] == "ok" and record["pass"] == "timed" and not record["unranked"]:
            insort(self.times.setdefault(cell.key, []), steady.find(record["frames_s"]).seconds)

    def __str__(self) -> str:
        """Returns "cpp 117 ms, numba 1.02 ×": the fastest first, the others as ratios to it; "" of fewer than two."""
        medians = sorted((statistics.median(times), self.names[key]) for key, times in self.times.items())
        if len(medians) < 2:
            return ""
        (best, name), *others = medians
        return ", ".join(
            [f"{name} {quantity.seconds(best)}", *(f"{other} {quantity.times(time / best)}" for time, other in others)]
        )


class Lines:
    """Prints a line for each repetition to standard error. If nobody listens any more, it says nothing."""

    def kept(self, records: list[dict]) -> None:
        """These rows a resumed run has: they count in the standings."""

    def begins(self, cell, done: int, total: int, left_s: float | None) -> None:
        """A repetition of the cell begins now."""

    def tell(self, cell, record: dict, done: int, total: int, left_s: float | None) -> None:
        """A repetition of the cell has ended."""
        _unless_deaf(lambda: print(line(cell, record, done, total, left_s), file=sys.stderr, flush=True))


class OneLine:
    """Keeps one line of a terminal up to date: how far the run is, what runs, and the standings so far."""

    def __init__(self, cells: Sequence, live: Live):
        self.live, self.standings, self.places = live, Standings(cells), places(cells)
        self.cells = {cell.key: cell for cell in cells}

    def kept(self, records: list[dict]) -> None:
        for record in records:
            if record["cell"] in self.cells:
                self.standings.add(self.cells[record["cell"]], record)

    def begins(self, cell, done: int, total: int, left_s: float | None) -> None:
        self._draw(cell, done, total, left_s)

    def tell(self, cell, record: dict, done: int, total: int, left_s: float | None) -> None:
        self.standings.add(cell, record)
        if record["status"] != "ok" and record["repetition"] == 0:
            _unless_deaf(lambda: self.live.console.print(escape(line(cell, record, done, total, left_s))))
        self._draw(cell, done, total, left_s)

    def _draw(self, cell, done: int, total: int, left_s: float | None) -> None:
        full = round(BAR * done / total) if total else 0
        left = _left(done, total, left_s)
        place = f"{done}/{total}{left and ', '}{left}"
        so_far, text = str(self.standings), Text(no_wrap=True, overflow="ellipsis")
        text.append("━" * full, "green").append("━" * (BAR - full), "dim").append(f" {place}  ")
        text.append(cell.entry.name, "bold")
        if so_far:
            text.append(f"  so far {so_far}")
        text.append(f"  {self.places[cell.key]}", "dim")
        _unless_deaf(lambda: self.live.update(text, refresh=True))


@contextmanager
def progress(cells: Sequence) -> Iterator[Lines | OneLine]:
    """Yields what a run of these cells tells of its repetitions: it has `kept`, `begins` and `tell`."""
    if not sys.stderr.isatty():
        yield Lines()
        return
    live = Live(console=Console(stderr=True, highlight=False), auto_refresh=False, transient=True)
    _unless_deaf(live.start)
    try:
        yield OneLine(cells, live)
    finally:
        _unless_deaf(live.stop)


def unless_gone() -> None:
    """Sends what is said from now on nowhere where the terminal is gone, of which a write of nothing tells."""
    for number in (1, 2):
        try:
            os.write(number, b"")
        except OSError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), number)


def _unless_deaf(say) -> None:
    """Let `say` say something; if nobody hears it, nobody will hear what this process says from now on."""
    try:
        say()
    except OSError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        for number in (1, 2):
            os.dup2(nowhere, number)
        os.close(nowhere)


def places(cells: Sequence) -> dict[str, str]:
    """Returns where each cell is, by key: what of scene and swept values not all cells have."""
    points = {cell.key: {"scene": Path(cell.scene).stem, **cell.point} for cell in cells}
    values: dict[str, list[str]] = {}
    for point in points.values():
        for name, value in point.items():
            values.setdefault(name, []).append(repr(value))
    varied = {name for name, some in values.items() if len(set(some)) > 1 or len(some) < len(points)}
    return {
        key: ", ".join(
            str(value) if name == "scene" else f"{name} {value}" for name, value in point.items() if name in varied
        )
        for key, point in points.items()
    }


def _left(done: int, total: int, seconds: float | None) -> str:
    return "" if seconds is None or done == total else f"{spell(seconds)} left"


def line(cell, record: dict, done: int, total: int, left_s: float | None) -> str:
    """Returns what is said of a repetition that has ended."""
    left = _left(done, total, left_s)
    place = f"[{done}/{total}{left and ', '}{left}] {cell.label}"
    if record["pass"] == "count":
        outcome = _counted(record["counts"]) if record.get("counts") else record["reason"]
        return f"{place}, count: {outcome}"
    if record["status"] != "ok":
        return f"{place}: {verdict(record)}: {record['reason']}"
    if record["stability"]:
        return f"{place}: {record['stability']['failures']} of {record['stability']['count']} answers are wrong"
    frames = record["frames_s"]
    seconds = steady.find(frames).seconds
    time = "no steady frame" if seconds is None else f"{quantity.seconds(seconds)} a frame"
    accuracy = f"{rows.error_of(record['error'])}, {rows.agreement_of(record['agreement'])}"
    unranked = ", unranked" if record["unranked"] else ""
    turn = {"load": ", load pass", "pair": ", for the noise floor", "cold": ", cold"}.get(record["pass"], "")
    return f"{place}{turn}: first {quantity.seconds(frames[0])}, {time}, {accuracy}{unranked}"


def _counted(counts: dict) -> str:
    plain, whole = quantity.plain, counts["instructions"]
    per_ray = f", {plain(whole / counts['rays'])} a ray" if counts["rays"] else ""
    return f"{plain(whole)} instructions a frame{per_ray}, by {counts['tool']}"
