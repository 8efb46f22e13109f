"""Separates warm-up from steady state in the frames of one process, by one rule.

Frame 0 is never steady, as it may include one-time work. Fewer than 10 later frames are too few to judge: all of them
count as steady, and the state is "assumed". Otherwise:

1. The level is the median of the last half of the later frames. The band around it is as wide as 5 standard deviations
   of that half (1.4826 MAD), and 2 % of the level at least, on either side.
2. The warm-up ends at the first frame in the band for which at least half of the next 8 frames are in the band too.
   So neither a later outlier nor one fast frame during the warm-up decides.
3. The state is "steady" if the frames from there on are at least 2/3 of the later frames, and the medians of their two
   halves differ by at most 5 %, or 3 standard errors if that is more. Otherwise it is "none": the process was still
   warming up, drifted, or changed its level.

After Kalibera and Jones (Rigorous benchmarking in reasonable time, ISMM 2013), who determine the end of the warm-up for
each benchmark by eye, and Barrett et al. (Virtual machine warmup blows hot and cold, OOPSLA 2017), who also report "no
steady state" but use change points, which need hundreds of frames.
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
    """The steady frames of a process.

    first: the first one, None if there is none. state: "steady", "assumed" or "none". note: "", or why there is none.
    warm_up: number of frames before the level was reached, with frame 0; None if unknown.
    """

    first: int | None
    state: str
    note: str = ""
    warm_up: int | None = None

    @property
    def start(self) -> int:
        """The first frame that counts; without a steady state that is frame 1."""
        return 1 if self.first is None else self.first


def find(frames_s: Sequence[float]) -> Steady:
    """Finds the steady frames of a process. frames_s: durations of all its frames in order, s."""
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
        return Steady(None, "none", f"{NO_STATE}: {first} of {later + 1} frames came before the last level")
    early, late = rest[: len(rest) // 2], rest[len(rest) // 2 :]
    before, after = median(early), median(late)
    error = math.hypot(_error(early, before), _error(late, after))
    if abs(after - before) > max(DRIFT * min(before, after), ERRORS * error):
        return Steady(None, "none", f"{NO_STATE}: its frames still became {_change(before, after)}")
    return Steady(first, "steady", warm_up=warm_up)


def _stays(following: list[bool]) -> bool:
    return 2 * sum(following) >= len(following)


def _scale(values: Sequence[float], centre: float) -> float:
    """Standard deviation, estimated from the median absolute deviation, which is robust."""
    return 1.4826 * median(abs(value - centre) for value in values)


def _error(values: Sequence[float], centre: float) -> float:
    """Standard error of the median of normal values."""
    return math.sqrt(math.pi / 2 / len(values)) * _scale(values, centre)


def _change(before: float, after: float) -> str:
    """ "12 % faster": how the time of a frame changed."""
    size = abs(after - before) / (before or after)
    return f"{100 * size:.0f} % {'faster' if after < before else 'slower'}"
