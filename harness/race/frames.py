"""Checks one later frame of a repetition, which nobody knows before all are over: is it the picture of its place?

A renderer of contract 2 has said a checksum of each render (FRM-2) before it could know which of them would be named.
The renderer makes the named picture again, in a job like any other: its checksum must be the one that was said, and the
picture right. So a frame that was copied, rendered in part, or less deep than the first, is found whatever its time.
"""

import math
import secrets
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from harness.judge import bound, judge, reference
from harness.judge.reference import NoReference, Reference
from harness.process.repetition import Result, is_checked
from harness.renderer import places
from harness.renderer.parameters import Parameters
from harness.renderer.registry import Entry
from harness.store.record import FALSE_FRAMES, UNCHECKED

BLOCK = 5  # repetitions of a cell at least, of which one has a frame checked, at random
MOVED = 4  # tolerances by which a reference changes with the place of its sample, where any picture must


@dataclass(frozen=True)
class Choice:
    """A render of a later frame: its numbers, the place of its sample, and its checksum."""

    frame: int
    render: int
    sample: tuple[float, float]
    checksum: str

    def job(self, parameters: Parameters) -> Parameters:
        """The parameters of a job that makes its picture, of those of the repetition."""
        x, y = self.sample
        return replace(parameters, frames=0, least_frame=0.0, sample_x=x, sample_y=y)

    def record(self) -> dict:
        return {"frame": self.frame, "render": self.render, "sample": list(self.sample)}


def choose(result: Result, parameters: Parameters) -> Choice:
    """Chooses a render of a repetition that is ok, at random."""
    _, *later = result.said.frames
    frame = secrets.choice(later)
    render = secrets.randbelow(frame["renders"])
    sample = parameters.sample_x, parameters.sample_y
    place = places.place(result.outcome.places.key, frame["index"], render, sample)
    start = places.DIGITS * render
    return Choice(frame["index"], render, place, frame["checksums"][start : start + places.DIGITS])


def unchecked(entry: Entry, parameters: Parameters) -> str:
    """Why no later frame of a job is ever checked, in words that begin with UNCHECKED; "" if they are, or there is
    none."""
    if parameters.frames == 0 or is_checked(entry, parameters):
        return ""
    if parameters.kind == "rays":
        return f"{UNCHECKED}first hits have no checksums"
    if entry.contract >= 2:
        return f"{UNCHECKED}this system has no named pipes"
    return f"{UNCHECKED}the renderer keeps contract 1, by which later frames may be copies"


def verdict(
    choice: Choice,
    result: Result,
    parameters: Parameters,
    run: Callable[[Parameters], Result],
    fault: Callable[[Parameters, Result, np.ndarray], str | None],
) -> str | None:
    """None, or why a later frame is not what it should be, in words that begin with FALSE_FRAMES; or why nobody knows,
    in words that begin with UNCHECKED.

    result: of the repetition. run(parameters): the same renderer and scene once more. fault(parameters, result,
    picture): None, or what is wrong with the result of that, beside the picture of frame 0; or UNCHECKED and why nobody
    knows.
    """
    job, name = choice.job(parameters), f"frame {choice.frame}"
    alone = run(job)
    if alone.status != "ok":
        return f"{UNCHECKED}the job of {name} alone: {alone.status}: {alone.reason}"
    if (checksum := places.checksum(alone.array)) != choice.checksum:
        again = run(job)
        if again.status == "ok" and places.checksum(again.array) != checksum:
            return f"{UNCHECKED}two processes make other bytes of one picture"
        return f"{FALSE_FRAMES}{name} had another picture than that of the place of its sample"
    wrong = fault(job, alone, result.array)
    if wrong is None or wrong.startswith(UNCHECKED):
        return wrong
    return f"{FALSE_FRAMES}{name} is wrong: {wrong}"


def fault(
    job: Parameters, result: Result, first: np.ndarray, entry: Entry, arrays: dict, needs: tuple[str, ...],
    maker: Entry | None, cache: Path, run: Callable[..., Result],
) -> str | None:  # fmt: skip
    """None, or what is wrong with the picture that `entry` makes of a job: it is not that of another renderer, `maker`,
    or that of another place.

    first: the picture with its sample at the centre. UNCHECKED with the reason where there is no reference. cache, run:
    of reference.make.
    """
    if maker is None:
        return f"{UNCHECKED}no other renderer here can make this picture"
    external, precision = entry.renderer.manifest.external, job.precision
    limit = 0.0 if result.dropped is None else bound.bound(arrays, job.depth, result.dropped)

    def right(parameters: Parameters, masked: bool) -> Reference | NoReference:
        return reference.make(maker, arrays, parameters, reference.needs_of(needs), cache, run, masked)

    for masked in (False, True):  # what agrees without a mask agrees with one, which takes many pictures
        moved = right(job, masked)
        if isinstance(moved, NoReference):
            return f"{UNCHECKED}{moved.reason}"
        agreement = judge.judge(result.array, moved, precision, external, limit)
        if agreement.wrong is None:
            break
    if agreement.wrong is None and np.array_equal(result.array, first):
        plain = right(replace(job, sample_x=Parameters.sample_x, sample_y=Parameters.sample_y), False)
        if isinstance(plain, Reference) and np.abs(plain.picture - moved.picture).max() > MOVED * agreement.tolerance:
            return "its samples do not move to their place"
    return agreement.wrong


class Turns:
    """Which good repetitions of each cell have a frame checked: one of each BLOCK, at random."""

    def __init__(self):
        self.drawn: dict[tuple[str, int], float] = {}

    def is_due(self, cell: str, number: int, processes: int) -> bool:
        """Whether the turn is at a good repetition, the `number`th of so many, of a cell by its key. One that is not
        good passes it on to the next."""
        blocks = max(1, processes // BLOCK)
        block = min(number, processes - 1) * blocks // processes
        last = -(-(block + 1) * processes // blocks)
        drawn = self.drawn.setdefault((cell, block), number + secrets.randbelow(max(1, last - number)))
        if number < drawn:
            return False
        self.drawn[cell, block] = math.inf
        return True
