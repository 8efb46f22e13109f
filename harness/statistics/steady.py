"""The time of a frame, by one rule for all that rayrace tells: `find(frames_s).seconds` of a process, the median of its
steady frames. Separates warm-up from steady state, and tells whether a cell has a steady state.

Frame 0 is never steady, as it may include one-time work. Fewer than 10 later frames are too few to judge: all of them
count as steady, and the state is "assumed". Otherwise:

1. The level is the median of the last half of the later frames. The band around it is as wide as 5 standard deviations
   of that half (1.4826 MAD), and 2 % of the level at least, on either side.
2. The warm-up ends at the first frame in the band for which at least half of the next 8 frames are in the band too.
   So neither a later outlier nor one fast frame during the warm-up decides. If more than 1/3 of the later frames came
   before, a warm-up cannot be told from a change of level, and all later frames count.
3. The change is the median of the last third of these frames over that of their first third. The state is "none" if it
   is more than 5 %, and more than 4 standard errors unless that many frames came before; else "steady".
4. A cell of 5 or more processes has no steady state if the median of their changes is more than 5 %, and its 95 %
   interval is on one side of no change. What all processes do alike is the program's; what goes either way is the
   machine's, and stands in the interval of the cell's time. Fewer processes have none if more than half have none.

After Georges, Buytaert and Eeckhout (Statistically rigorous Java performance evaluation, OOPSLA 2007) and Kalibera and
Jones (Rigorous benchmarking in reasonable time, ISMM 2013): the process is the unit. Barrett et al. (Virtual machine
warmup blows hot and cold, OOPSLA 2017) and Traini et al. (Towards effective assessment of steady state performance in
Java software, Empirical Software Engineering 2023) use change points, which need hundreds of frames, and find that
processes of one program differ in their states, as here: so one process decides nothing. MSER-5 (White, 1997) averages
5 frames at a time, which leaves 4 of 20. How often the rule is wrong: docs/measuring-well.md.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from statistics import median

from harness.statistics import statistics

LEAST = 10  # later frames
WIDTH, LEAST_WIDTH = 5.0, 0.02  # of the band: standard deviations; of the level
AHEAD = 8  # frames
SHARE = 2 / 3  # of the later frames
DRIFT, ERRORS = 0.05, 4.0  # of a change: relative; standard errors
MOST_UNSTEADY = 1 / 2  # of the processes of a cell that are too few for an interval
NO_FRAMES, NO_STATE = "no steady frames", "no steady state"


@dataclass(frozen=True)
class Steady:
    """The steady frames of a process.

    first: the first one, None if there is none. state: "steady", "assumed" or "none". note: "", or why there is none.
    warm_up: number of frames before the level was reached, with frame 0; None if unknown. change: the time of a late
    frame over that of an early one; None of too few frames. frames: those that count, s; without a steady state all but
    frame 0.
    """

    first: int | None
    state: str
    note: str = ""
    warm_up: int | None = None
    change: float | None = None
    frames: tuple[float, ...] = field(default=(), compare=False, repr=False)

    @property
    def start(self) -> int:
        """The first frame that counts; without a steady state that is frame 1."""
        return 1 if self.first is None else self.first

    @property
    def seconds(self) -> float | None:
        """The time of a frame of this process, s: the median of the frames that count; None if there is none."""
        return median(self.frames) if self.frames else None


def find(frames_s: Sequence[float]) -> Steady:
    """Finds the steady frames of a process. frames_s: durations of all its frames in order, s."""
    later = len(frames_s) - 1
    if later < 1:
        return Steady(None, "none", NO_FRAMES)
    if later < LEAST:
        return Steady(1, "assumed", frames=tuple(frames_s[1:]))
    settled = frames_s[-((later + 1) // 2) :]
    level = median(settled)
    width = max(WIDTH * _scale(settled, level), LEAST_WIDTH * level)
    inside = [abs(frame - level) <= width for frame in frames_s]
    starts = (n for n, is_in in enumerate(inside) if is_in and _stays(inside[n + 1 : n + 1 + AHEAD]))
    warm_up = next(starts, later + 1)
    first = max(1, warm_up)
    is_long = later + 1 - first < SHARE * later
    if is_long:
        first, warm_up = 1, None
    third = (later + 1 - first) // 3
    early, late = frames_s[first : first + third], frames_s[-third:]
    before, after = median(early), median(late)
    change = _ratio(after, before)
    error = math.hypot(_error(early, before), _error(late, after))
    if _matters(change) and (is_long or abs(after - before) > ERRORS * error):
        note = f"{NO_STATE}: its frames became {_told(change)}"
        return Steady(None, "none", note, change=change, frames=tuple(frames_s[1:]))
    return Steady(first, "steady", warm_up=warm_up, change=change, frames=tuple(frames_s[first:]))


def rough(frames_s: Sequence[float]) -> float:
    """Returns about how long a frame takes (s), of one process that nothing audits: of `find`, or where it has no later
    frame of its first, which may include one-time work. Never a result: whoever prints it calls it rough.
    """
    seconds = find(frames_s).seconds
    return frames_s[0] if seconds is None else seconds


def together(changes: Sequence[float], notes: Sequence[str]) -> str:
    """Returns why the processes of a cell have no steady state; "" if they have one.

    changes: the known ones. notes: one of each process, "" if it has a steady state.
    """
    if len(changes) >= statistics.LEAST:
        change = statistics.median(changes)
        if not _matters(change.value) or change.low <= 1 <= change.high:
            return ""
        return f"{NO_STATE}: the frames of {len(changes)} processes became {_told(change.value)}"
    none = list(filter(None, notes))
    if len(none) <= MOST_UNSTEADY * len(notes):
        return ""
    return none[0] if len(none) == len(notes) else f"{none[0]}, in {len(none)} of {len(notes)} repetitions"


def _stays(following: list[bool]) -> bool:
    return 2 * sum(following) >= len(following)


def _scale(values: Sequence[float], centre: float) -> float:
    """Standard deviation, estimated from the median absolute deviation, which is robust."""
    return 1.4826 * median(abs(value - centre) for value in values)


def _error(values: Sequence[float], centre: float) -> float:
    """Standard error of the median of normal values."""
    return math.sqrt(math.pi / 2 / len(values)) * _scale(values, centre)


def _ratio(above: float, below: float) -> float:
    """Returns a quotient of times, which may be 0."""
    return above / below if below else math.inf if above else 1.0


def _matters(change: float) -> bool:
    return max(change, _ratio(1.0, change)) > 1 + DRIFT


def _told(change: float) -> str:
    """Returns how the time of a frame changed: "12 % slower"."""
    return f"{abs(100 * (change - 1)):.0f} % slower" if change > 1 else f"{100 * (1 - change):.0f} % faster"
