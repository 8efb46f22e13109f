"""The history of a renderer: what each commit makes of its instructions and times, and where they step."""

import itertools
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from harness.errors import UserError
from harness.statistics.digits import change
from harness.statistics.statistics import Estimate
from reports.compare.instructions import of_two
from reports.run import ranking, results
from reports.run.missing import Missing

COUNT_NOISE = 1e-3  # standard deviation of the logarithm of a count: two of the same version differ by 0.2 % at most
WIDTH = 2 * 1.96  # standard deviations, of an interval of 95 %
# What a step must explain, times variance times log(commits). The BIC of steps of a mean (Yao 1988) has 2 or 3; with 5,
# one history of 15 equal commits in some 300 has a step.
EXPLAINS = 5.0


@dataclass(frozen=True)
class Point:
    """A commit at one place (scene and swept values): its hash, date and subject, and what was measured.

    instructions: of a steady frame. time: of a steady frame over that of the baseline, paired by round. Either is
    Missing with the reason.
    """

    commit: str
    date: str
    subject: str
    place: str
    instructions: float | Missing
    time: Estimate | Missing


@dataclass(frozen=True)
class Step:
    """A change between two measured commits that follow each other: `after` has `ratio` times what `before` has.

    of: "instructions" or "time". time: the ratio of the times of the two, where instructions step; None if unknown.
    """

    place: str
    before: Point
    after: Point
    of: str
    ratio: float
    time: float | None

    @property
    def text(self) -> str:
        more = f"{change(self.ratio)} {self.of}"
        time = "" if self.time is None else f", {change(self.time)} time"
        return f"{self.after.commit[:9]} {self.after.subject}: {more}{time} ({self.place})"


def read(folder: Path, commit: str, date: str, subject: str) -> list[Point]:
    """Returns a Point for each place of the run in `folder`, which held the variant against itself at the commit."""
    loaded = results.load(folder)
    (against,) = loaded.facts["against"]
    points = []
    for place in loaded.places:
        cells = {cell.variant: cell for cell in loaded.at(place)}
        then, now = cells[against["other"]], cells[against["variant"]]
        counts = loaded.counts(then)
        if not isinstance(counts, Missing):
            present = loaded.counts(now)
            compared = of_two(present, counts, "the present version", "this one")
            other = not isinstance(present, Missing) and compared.ratio is None
            counts = Missing(compared.reason) if other else counts["instructions"]
        bad = next((cell for cell in (then, now) if cell.unranked), None)
        time = Missing(f"{bad.label}: {bad.unranked}") if bad else ranking.ratio(then, now)
        points.append(Point(commit, date, subject, results.place_label(place), counts, time))
    return points


def steps(points: list[Point], least: float) -> list[Step]:
    """Returns the steps of at least a share `least` in Points of one place, in the order of the commits.

    Steps of the instructions where commits have them, else of the times. They are the change points of the logarithms
    (PELT of ruptures, with squared distances from the means between them). UserError without ruptures.
    """
    try:
        import ruptures
    except ImportError:
        raise UserError("history: needs ruptures", remedy="pip install 'rayrace[history]'") from None
    counted = [point for point in points if not isinstance(point.instructions, Missing)]
    timed = [point for point in points if not isinstance(point.time, Missing)]
    of, measured = ("instructions", counted) if counted else ("time", timed)
    if len(measured) < 2:
        return []
    values = np.log([point.instructions if counted else point.time.value for point in measured])
    noise = COUNT_NOISE if counted else _noise(measured)
    penalty = EXPLAINS * noise**2 * math.log(len(measured))
    ends = ruptures.Pelt(model="l2", min_size=1, jump=1).fit(values.reshape(-1, 1)).predict(pen=penalty)
    means = [float(values[start:end].mean()) for start, end in itertools.pairwise([0, *ends])]
    changes = []
    for end, (low, high) in zip(ends, itertools.pairwise(means), strict=False):
        ratio, before, after = math.exp(high - low), measured[end - 1], measured[end]
        if abs(ratio - 1) >= least:
            changes.append(Step(after.place, before, after, of, ratio, _of_times(before, after) if counted else None))
    return changes


def _noise(points: list[Point]) -> float:
    """Returns the median standard deviation of the logarithms of times, from their intervals."""
    widths = [math.log(point.time.high / point.time.low) for point in points if point.time.low]
    return max(COUNT_NOISE, float(np.median(widths)) / WIDTH) if widths else COUNT_NOISE


def _of_times(before: Point, after: Point) -> float | None:
    times = before.time, after.time
    return None if any(isinstance(time, Missing) for time in times) else times[1].value / times[0].value


def table(points: list[Point]) -> pd.DataFrame:
    """Returns a row for each Point, with the reasons of what is missing."""
    rows = []
    for point in points:
        missing = isinstance(point.time, Missing)
        rows.append(
            {
                "commit": point.commit,
                "date": point.date,
                "subject": point.subject,
                "place": point.place,
                "instructions": None if isinstance(point.instructions, Missing) else point.instructions,
                "no_instructions": str(point.instructions) if isinstance(point.instructions, Missing) else "",
                "time": None if missing else point.time.value,
                "time_low": None if missing else point.time.low,
                "time_high": None if missing else point.time.high,
                "no_time": str(point.time) if missing else "",
            }
        )
    return pd.DataFrame(rows)
