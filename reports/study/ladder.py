"""Ladders of a run (harness/experiment/ladder.py): rungs in order, each with its factor to the rung before it."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from harness.statistics.statistics import Estimate
from reports.run import ranking, study
from reports.run.results import Cell, Missing, Results


@dataclass(frozen=True)
class Step:
    """A rung. cell: None if the run has none. factor: the time of the rung before it that has a time, over its own.

    lines: of the source of its renderer, with all its variants and methods.
    """

    name: str
    changes: str
    variant: str
    cell: Cell | None
    time: Estimate | Missing
    factor: Estimate | Missing | None
    lines: int | Missing

    @property
    def timed(self) -> bool:
        return isinstance(self.time, Estimate)


@dataclass(frozen=True)
class Climb:
    """A ladder on one scene. study: the program of the study that its first rung stands for, or None."""

    name: str
    scene: str
    study: str | None
    steps: list[Step]

    @cached_property
    def timed(self) -> list[Step]:
        return [step for step in self.steps if step.timed]

    @cached_property
    def whole(self) -> Estimate | Missing:
        """The time of the first timed rung over that of the last."""
        if len(self.timed) < 2:
            return Missing("fewer than two rungs have a time")
        return ranking.ratio(self.timed[0].cell, self.timed[-1].cell)

    @cached_property
    def product(self) -> float | Missing:
        """The product of the factors of all rungs."""
        if len(self.timed) < 2:
            return Missing("fewer than two rungs have a time")
        return math.prod(step.factor.value for step in self.timed[1:])

    @cached_property
    def accounted(self) -> float | Missing:
        """The share of the measured factor that the product accounts for: the smaller logarithm over the larger."""
        if isinstance(self.whole, Missing):
            return self.whole
        logs = math.log(self.product), math.log(self.whole.value)
        if min(logs) <= 0 <= max(logs):
            return Missing("the first rung is not slower than the last")
        return min(map(abs, logs)) / max(map(abs, logs))

    @cached_property
    def published(self) -> Estimate | Missing:
        """The study's time of this picture, s: its time of 512 x 512 pixels by the number of pixels, an estimate."""
        if self.study is None:
            return Missing("the ladder begins with no program of the study")
        if not self.steps[0].timed:
            return Missing("the first rung has no time")
        first = self.steps[0].cell
        alike = ("depth", "shadows", "precision")
        if Path(first.scene).stem != "comparison" or any(first.parameters[k] != study.VARIABLES[k] for k in alike):
            return Missing("the study has another scene or other variables")
        mean, half, processes = study.TIMES_S[self.study]["all"]
        scale = first.pixels / (study.VARIABLES["width"] * study.VARIABLES["height"])
        return Estimate(mean * scale, (mean - half) * scale, (mean + half) * scale, processes, "by pixels")

    @cached_property
    def rest(self) -> float | Missing:
        """The study's time over that of the first rung: what of it is left to the machine and whatever else."""
        if isinstance(self.published, Missing):
            return self.published
        return self.published.value / self.steps[0].time.value


def climbs(results: Results) -> list[Climb]:
    """Returns the ladders of a run on each of its scenes; [] for a run without."""
    experiment = results.facts["experiment"]
    return [
        Climb(
            entry["name"], scene, entry.get("study"), list(_steps(results, scene, entry["rung"], experiment["image"]))
        )
        for entry in experiment.get("ladder") or ()
        for scene in results.scenes
    ]


def _steps(results: Results, scene: str, rungs: list[dict], image: dict) -> Iterator[Step]:
    before = None
    for rung in rungs:
        wanted = image | (rung.get("image") or {})
        cell = next(
            (cell for cell in results.of(scene) if cell.variant == rung["renderer"] and _at(cell, wanted)), None
        )
        time = cell.steady if cell else Missing("the run has no such cell")
        factor = None
        if isinstance(time, Missing):
            factor = time
        elif before:
            factor = ranking.ratio(before, cell)
        lines = ((results.record(cell) if cell else None) or {}).get("lines")
        lines = Missing("the run does not have it") if lines is None else lines
        yield Step(rung["name"], rung["changes"], rung["renderer"], cell, time, factor, lines)
        before = cell if isinstance(time, Estimate) else before


def _at(cell: Cell, wanted: dict) -> bool:
    return all(wanted.get(key) == value for key, value in cell.swept.items())
