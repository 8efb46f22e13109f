"""Finds what the marks of a repetition contradict: the clock, its phases, or the processor. Such a row has no rank.

A renderer tells its own times. Three accounts of them are independent: the wall time of its phases, above all `render`;
the CPU time inside a phase, from the measurer's series; the CPU time of its whole life, from wait4.

marks()  By the contract frames cover the phase `render`, but for the search for a batch, and T threads use at most
         T s of CPU time in a second. The same must hold of what follows the first frame, which may be the longest; of a
         renderer of contract 2, what follows the answer to its question for places (FRM-1), before which it could do
         nothing for its later frames. After each of those it needs no longer than a checksum takes.
written() No frame is shorter than it takes to write its pixels.
Blanks   CPU time that no frame covers (start, imports, a hierarchy) does not depend on the picture: the renderer is
         started once more for a small one. What is used beyond that is rendering, in whatever phase. The size of that
         one and its frames are random: no renderer can tell it from others.

Each rule allows for the resolution of the clocks and of the series: a difference below that is no contradiction.
"""

import itertools
import random
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

from harness.process import bandwidth
from harness.process.repetition import Result
from harness.race.row import cover
from harness.race.series import ticks
from harness.renderer import events
from harness.renderer.limits import amount
from harness.renderer.parameters import Parameters
from harness.renderer.registry import Entry
from harness.store.record import CONTRADICTED
from harness.system import trouble

UNCOVERED = 0.5  # of the wall time, in no phase at all
UNFRAMED = 0.2  # of a phase render, in no frame
SHORT = 0.1  # s that may be so anyway, as while other programs have the processors
CPU_MORE = 0.1  # more CPU time than the threads have, which a clock of ticks may tell
SEARCH = 8  # later frames: each size of batch up to theirs, twice, and again for one that was interrupted
PAUSES = 0.2  # s in it while other programs have the processors
COLD = 10  # times as long as a later frame is the first at most, with cold caches (worker.py)
BLANK_MORE = 0.5  # of the CPU time of a blank, which differs as other programs use the caches and the clock
PACKING = 2  # times as long as ours may an interpreter take to pack a pixel, in the phases that write
WRITING = "download", "save"
WRITES = 3  # times as quick as this machine was just now may it be at other times
CHECKSUM = 4  # times as long as zlib may a checksum take
PAUSE, PER_RENDER = 5e-4, 5e-6  # s between two frames beside: to print a line, and for each render to take its place
SMALLER = 6.0, 10.0  # times as wide and as high as a blank is the picture
BLANK_FRAMES = 3  # later ones of a blank, at most


def reason(
    result: Result,
    series: Path,
    entry: Entry,
    parameters: Parameters,
    blanks: "Blanks | None",
    run: Callable,
    key=None,
    disturbed: dict | None = None,
) -> str | None:
    """None, or what a repetition that is ok contradicts, in words that begin with CONTRADICTED.

    blanks: the blanks known so far; None where the process compiled what none will compile again. run(parameters): the
    same renderer and scene once more, with as much to compile, the Result. key: on what the CPU time of a blank
    depends, within `blanks`.
    disturbed: what the machine did meanwhile (trouble.between).
    """
    on_cpu = entry.variant.device == "cpu"  # what a GPU does takes no CPU time, and its driver has threads of its own
    threads = parameters.threads if on_cpu else None
    contradicted = marks(result, series, threads, parameters.least_frame, _lost(disturbed or {}))
    if on_cpu and parameters.kind == "image":
        contradicted = contradicted or written(result, threads)
    if contradicted or not on_cpu or blanks is None or parameters.kind == "rays" or result.outcome.measurer is None:
        return contradicted
    return blanks.contradiction(key, result, parameters, lambda: run(blank(parameters)))


def _lost(disturbed: dict) -> float:
    """Seconds for which a renderer may have stood still, also between its marks, as others had the processor."""
    return sum(disturbed[name] for name in trouble.TAKEN if isinstance(disturbed.get(name), int | float))


def marks(result: Result, series: Path, threads: int | None, least_frame: float = 0.0, lost: float = 0.0) -> str | None:
    """None, or what the marks contradict. threads: that the renderer may use; None: CPU time tells nothing of it.
    least_frame: of the job, s. lost: s for which it may have stood still, of which the clock tells nothing."""
    said, outcome = result.said, result.outcome
    wall = outcome.wall_s
    covered = sum(end - start for _, start, end in cover(said, outcome.spawned, outcome.exited))
    if wall - covered > max(SHORT, UNCOVERED * wall) + lost:
        return f"{CONTRADICTED}the clock: its phases cover {covered:.3g} s of its life of {wall:.3g} s"
    if all(phase["name"] != "render" for phase in said.phases):
        return f"{CONTRADICTED}its phases: it has {len(said.frames)} frames and no phase render"
    rows = ticks(series) if threads and outcome.measurer else []
    resolution = (outcome.measurer or {}).get("resolution_s") or 0.0
    places, checksums = outcome.places, checksums_s(result)
    for what, frames, windows in _parts(said, places.given if places else None):
        framed, length = _seconds(frames), sum(end - start for start, end in windows)
        allowed = framed + (checksums if places else _search(said, least_frame))
        if length - allowed > max(SHORT, UNFRAMED * length) + lost:
            return f"{CONTRADICTED}its phases: {what} {framed:.3g} s of {length:.3g} s of phase render"
        used = sum(_cpu_within(rows, start - outcome.spawned, end - outcome.spawned) for start, end in windows)
        if rows and used > threads * allowed * (1 + CPU_MORE) + SHORT + resolution:
            return (
                f"{CONTRADICTED}the processor: {what} {framed:.3g} s of phase render, which used"
                f" {used:.3g} s of CPU time on {threads} thread{'s' * (threads > 1)}"
            )
    return _paused(result, lost) if places else None


def written(result: Result, threads: int) -> str | None:
    """None, or which frame is shorter than it takes so many threads to write its pixels."""
    size = result.array.nbytes
    least = bandwidth.write_s(size) / (WRITES * threads)
    for frame, seconds in zip(result.said.frames, result.said.frames_s, strict=True):
        if seconds < least:
            return (
                f"{CONTRADICTED}the memory: frame {frame['index']} took {seconds:.3g} s,"
                f" in which nobody writes its {amount(size)} here (at least {least:.3g} s)"
            )
    return None


def checksums_s(result: Result) -> float:
    """Seconds that a renderer of contract 2 may have taken for the checksums of all later frames, and to say them."""
    _, *later = result.said.frames
    if result.outcome.places is None or not later:
        return 0.0
    renders = later[0]["renders"]
    each = PAUSE + renders * (PER_RENDER + CHECKSUM * bandwidth.checksum_s(result.array.nbytes))
    return each * len(later)


def _paused(result: Result, lost: float) -> str | None:
    """None, or how long a renderer of contract 2 paused before each of its later frames, or after each, where a
    checksum is all that is due. The shortest pause counts, of at least two: others who use the machine make it longer
    by no more than their part of what they took."""
    _, *later = result.said.frames
    if len(later) < 2:
        return None
    ends = [result.outcome.places.given, *(frame["end"] for frame in later)]
    last = max(phase["end"] for phase in result.said.phases if phase["name"] == "render")
    starts = [*(frame["start"] for frame in later), last]
    pauses = [start - end for start, end in zip(starts, ends, strict=True)]
    shortest = max(min(pauses[:-1]), min(pauses[1:]))
    allowed = (checksums_s(result) + lost) / len(later)
    if shortest <= allowed:
        return None
    return (
        f"{CONTRADICTED}its phases: it pauses for {shortest:.3g} s or more at each later frame,"
        f" where a checksum takes {allowed:.3g} s at most"
    )


def _parts(said: events.Said, given: float | None) -> Iterator[tuple[str, list[dict], list[tuple[float, float]]]]:
    """The phase render with all frames; what of it follows the first frame, with the later ones.

    given: when a renderer of contract 2 was told the places of its later frames. Between frame 0 and then it searches,
    and waits for the answer.
    """
    render = [(phase["start"], phase["end"]) for phase in said.phases if phase["name"] == "render"]
    first, *later = said.frames
    start = first["end"] if given is None else given
    after = [(max(begin, start), end) for begin, end in render if end > start]
    before = [(begin, min(end, first["end"])) for begin, end in render if begin < first["end"]]
    yield "its frames cover", said.frames, render if given is None else [*before, *after]
    if later:
        yield "its frames after the first cover", later, after


def _seconds(frames: list[dict]) -> float:
    return sum(frame["end"] - frame["start"] for frame in frames)


def _longest(frames: list[dict]) -> float:
    return max((frame["end"] - frame["start"] for frame in frames), default=0.0)


def _search(said: events.Said, least_frame: float) -> float:
    """Seconds that the search for the number of renders of a batch may have taken between the first two frames."""
    first, *later = said.frames
    if not later:
        return 0.0
    second = later[0]
    if second["renders"] == 1 and _seconds([first]) >= COLD * least_frame:  # it was long enough
        return 0.0
    return min(max(0.0, second["start"] - first["end"]), SEARCH * _longest(later) + PAUSES)


def _cpu_within(rows: list[dict], start: float, end: float) -> float:
    """CPU time that was surely used between two times: between the readings that lie inside.

    A reading is stamped before it is made, and has been made when the next is stamped.
    """
    inside = [
        float(reading["cpu_s"])
        for reading, following in itertools.pairwise(rows)
        if start <= float(reading["t"]) and float(following["t"]) <= end
    ]
    return inside[-1] - inside[0] if inside else 0.0


class Blanks:
    """CPU time of processes that rendered a smaller picture, by what the time depends on."""

    def __init__(self):
        self.times: dict = {}

    def contradiction(self, key, result: Result, parameters: Parameters, make: Callable[[], Result]) -> str | None:
        """None, or how the marks contradict the CPU time of the process (wait4).

        make: runs the blank. It is run only if none of `key` is known that explains the row: the machine may have
        become slower meanwhile.
        """
        used = unframed_cpu(result, parameters)
        if used <= _most(self.times.get(key, 0.0)):
            return None
        blank = make()
        if blank.status != "ok":
            return None
        self.times[key] = seconds = max(self.times.get(key, 0.0), _cpu(blank))
        if used <= _most(seconds):
            return None
        return (
            f"{CONTRADICTED}the processor: {used:.3g} s of CPU time in no frame, {seconds:.3g} s for a smaller picture"
        )


def blank(parameters: Parameters) -> Parameters:
    """The parameters of a blank: a smaller picture, or region of the same size, with some frames, at random."""
    x0, y0, x1, y1 = parameters.bounds()
    width, height = (max(1, round(side / random.uniform(*SMALLER))) for side in (x1 - x0, y1 - y0))
    frames = random.randint(0, min(BLANK_FRAMES, parameters.frames))
    if parameters.region is None:
        return replace(parameters, width=width, height=height, frames=frames)
    left, top = random.randint(x0, x1 - width), random.randint(y0, y1 - height)
    return replace(parameters, region=(left, top, left + width, top + height), frames=frames)


def unframed_cpu(result: Result, parameters: Parameters) -> float:
    """CPU time (s) of a process beyond what its frames, and writing the picture, can have used.

    The first frame counts for no more than COLD later ones: it may have made what they only copy.
    """
    first, *later = result.said.frames
    longest = _longest(later)
    begun = min(_seconds([first]), COLD * longest) if later else _seconds([first])
    framed = parameters.threads * (begun + _seconds(later) + _search(result.said, parameters.least_frame))
    x0, y0, x1, y1 = parameters.bounds()
    writing = sum(phase["end"] - phase["start"] for phase in result.said.phases if phase["name"] in WRITING)
    packing = PACKING * bandwidth.pack_pixel_s() * (x1 - x0) * (y1 - y0)
    return _cpu(result) - framed - checksums_s(result) - min(writing, packing)


def _cpu(result: Result) -> float:
    return result.outcome.user_s + result.outcome.system_s


def _most(blank: float) -> float:
    return SHORT + (1 + BLANK_MORE) * blank
