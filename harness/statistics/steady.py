"""Separates warm-up from steady state in the frames of one process, by one rule.

Frame 0 is never steady: it may have what happens once. With fewer than 10 later frames nothing more can be told:
all of them are taken as steady, and the state is "assumed". Otherwise:

1. The level is the median of the last half of the later frames. The band around it is as wide as 5 standard deviations
   of that half (1.4826 MAD), and 2 % of the level at least, on either side.
2. The warm-up ends at the first frame in the band of whose next 8 at least half are in the band too, so that neither an
   outlier after it nor a lucky frame within it counts for more than it is.
3. The state is "steady" if what follows is at least 2/3 of the later frames, and if the medians of its two halves
   differ by no more than 5 %, or than 3 standard errors where frames scatter so much. Otherwise it is "none": the
   process was still warming up, drifted, or changed its level.

After Kalibera and Jones (Rigorous benchmarking in reasonable time, ISMM 2013), who find the end of the warm-up for each
benchmark, and Barrett et al. (Virtual machine warmup blows hot and cold, OOPSLA 2017), who let a process have no steady
state; here by a rule instead of by eye or by change points, which need hundreds of frames.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

LEAST = 10  # later frames
WIDTH, LEAST_WIDTH = 5.0, 0.02  # of the band: standard deviations; of the level
AHEAD = 8  # frames
SHARE = 2 / 3  # of the later frames
NO_FRAMES, NO_STATE = "no steady frames", "no steady state"
DRIFT, ERRORS = 0.05, 3.0  # between halves: relative; standard errors


@dataclass(frozen=True)
class Steady:
    """first: the first steady frame, None if there is none. state: "steady", "assumed" or "none". note: "" or why none.

    warm_up: frames before the level was reached, frame 0 included; None if it cannot be told.
    """

    first: int | None
    state: str
    note: str = ""
    warm_up: int | None = None

    @property
    def start(self) -> int:
        """From which frame on its frames count: where there is no steady state, all but the first stand for it."""
        return 1 if self.first is None else self.first


def find(frames_s: Sequence[float]) -> Steady:
    """The steady frames of a process, from the seconds of all its frames, the first one first."""
    later = len(frames_s) - 1
    if later < 1:
        return Steady(None, "none", NO_FRAMES)
    if later < LEAST:
        return Steady(1, "assumed")
    settled = frames_s[-((later + 1) // 2) :]
    level = median(settled)
    width = max(WIDTH * _scale(settled, level), LEAST_WIDTH * level)
    inside = [abs(frame - level) <= width for frame in frames_s]
    starts = (n for n, is_in in enumerate(inside) if is_in and _stays(inside[n + 1 : n + 1 + AHEAD]))
    warm_up = next(starts, later + 1)
    first = max(1, warm_up)
    rest = frames_s[first:]
    if len(rest) < SHARE * later:
        return Steady(None, "none", f"{NO_STATE}: {first} of {later + 1} frames went by before the last ones' level")
    early, late = rest[: len(rest) // 2], rest[len(rest) // 2 :]
    before, after = median(early), median(late)
    error = math.hypot(_error(early, before), _error(late, after))
    if abs(after - before) > max(DRIFT * min(before, after), ERRORS * error):
        return Steady(None, "none", f"{NO_STATE}: its frames still get {_change(before, after)}")
    return Steady(first, "steady", warm_up=warm_up)


def _stays(following: list[bool]) -> bool:
    return 2 * sum(following) >= len(following)


def _scale(values: Sequence[float], centre: float) -> float:
    """Standard deviation, from the median absolute deviation, which outliers hardly move."""
    return 1.4826 * median(abs(value - centre) for value in values)


def _error(values: Sequence[float], centre: float) -> float:
    """Standard error of the median, that of normal values."""
    return math.sqrt(math.pi / 2 / len(values)) * _scale(values, centre)


def _change(before: float, after: float) -> str:
    """ "12 % faster": how the time of a frame changed."""
    size = abs(after - before) / (before or after)
    return f"{100 * size:.0f} % {'faster' if after < before else 'slower'}"
