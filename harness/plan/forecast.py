"""Predicts a run before it starts: which cells run, for how long, and how much of it fits a time budget."""

import math
from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from harness.experiment.experiment import Experiment
from harness.plan import predict, resume
from harness.plan.plan import Cell, Plan, pair_facts
from harness.plan.predict import Prediction, Predictor
from harness.store import store


@dataclass(frozen=True)
class Line:
    """The prediction for a cell.

    left: number of due processes, including those of the pair, without counts. begun: its first repetition is done.
    skipped: None, or why it will not run. first: for its first repetition, with all that is made once; later: for each
    other. Both are None if unknown. counting: for its count (s), 0 if none is due; None if unknown.
    """

    cell: Cell
    left: int
    begun: bool
    skipped: str | None
    first: Prediction | None
    later: Prediction | None
    counting: float | None = 0.0

    @property
    def seconds(self) -> float | None:
        """The predicted duration of all due repetitions without counts (s); None if unknown."""
        if self.skipped or not self.left:
            return 0.0
        if self.later is None:
            return None
        return self.later.seconds * self.left + (0.0 if self.begun else self.first.seconds - self.later.seconds)


class Forecast:
    """The prediction for a plan. done: finished processes, (cell key, number, kind) each."""

    def __init__(self, plan: Plan, experiment: Experiment, predictor: Predictor, done: Collection[tuple] = ()):
        self.plan, self.predictor = plan, predictor
        self.order = plan.order(experiment.seed, experiment.order)
        self.due = [turn for turn in self.order if (turn.cell.key, turn.number, turn.kind) not in done]
        left = Counter(turn.cell.key for turn in self.due if turn.kind != "count")
        counted = {turn.cell.key for turn in self.due if turn.kind == "count" and not turn.cell.refused}
        self.lines = []
        for cell in plan.cells:
            skipped = cell.refused
            later = None if skipped else predictor.seconds(cell)
            first = later and (predictor.seconds(cell, first=True) or later)
            begun = (cell.key, 0, "timed") in done
            counting = predictor.count(cell) if cell.key in counted else 0.0
            self.lines.append(Line(cell, left[cell.key], begun, skipped, first, later, counting))
        asking = [line.cell for line in self.lines if line.left and not line.skipped]
        self.truths = plan.truths_of(asking) - plan.truths_of(line.cell for line in self.lines if line.begun)

    @cached_property
    def seconds(self) -> float:
        """The predicted duration (s) of all due repetitions that can be predicted, with the truths that they need."""
        processes = sum((line.seconds or 0.0) + (line.counting or 0.0) for line in self.lines)
        return processes + len(self.truths) * self.predictor.truth

    @property
    def sources(self) -> dict[str, int]:
        """The number of cells by the source of their prediction."""
        return Counter(line.later.source for line in self.lines if line.seconds)

    @property
    def unknown(self) -> dict[str, int]:
        """The number of cells without a prediction, by variant."""
        return Counter(line.cell.entry.name for line in self.lines if line.seconds is None)

    @property
    def uncounted(self) -> dict[str, int]:
        """The number of cells whose count has no prediction, by variant."""
        return Counter(line.cell.entry.name for line in self.lines if line.counting is None)

    def cut(self, budget: float) -> tuple[int, int] | None:
        """How many processes fit in `budget` (s), and how many whole rounds of the plan these are.

        As in race.py, a first process begins as long as there is time, another only if it is predicted to end in time.
        None if a cell has no prediction.
        """
        if self.unknown or self.uncounted:
            return None
        lines = {line.cell.key: line for line in self.lines}
        clock, fitting, truths = 0.0, 0, set(self.truths)
        for cell, number, kind in self.due:
            line, first = lines[cell.key], number == 0 and kind == "timed"
            prediction = line.first if first else line.later
            seconds = 0.0 if line.skipped else line.counting if kind == "count" else prediction.seconds
            if clock + (seconds if number or kind == "count" else 0.0) >= budget:
                break
            needed = truths & self.plan.truths_of([cell])
            clock, fitting, truths = clock + seconds + len(needed) * self.predictor.truth, fitting + 1, truths - needed
        missing = self.due[fitting:]
        return fitting, min((turn.number for turn in missing if turn.kind != "count"), default=self.rounds)

    @property
    def rounds(self) -> int:
        """The number of rounds of the plan."""
        return max(cell.processes for cell in self.plan.cells)

    def record(self, budget: float = math.inf) -> dict:
        """For --json."""
        plan, cut = self.plan, self.cut(budget)
        return {
            "cells": [_record(line) for line in self.lines],
            "repetitions": len(self.due),
            "seconds": None if self.unknown or self.uncounted else self.seconds,
            "sources": self.sources,
            "unknown": self.unknown,
            "uncounted": self.uncounted,
            "left_out": [{"constraint": constraint, "cells": count} for constraint, count in plan.left_out],
            "warnings": list(plan.warnings),
            "pair": pair_facts(plan.pair, plan.pair_reason),
            "fitting": cut and {"repetitions": cut[0], "rounds": cut[1]},
        }


def make(plan: Plan, experiment: Experiment, results: Path, run: Path | None = None) -> Forecast:
    """The forecast from runs of this machine in the folder `results`. run: the run to be resumed, if any.

    UserError if that run cannot be resumed.
    """
    _, records = resume.check(run, plan) if run and not store.is_blank(run) else ({}, [])
    predictor = predict.Predictor([*predict.history(results, but=run), *records])
    done = {(record["cell"], record["repetition"], record["pass"]) for record in records}
    return Forecast(plan, experiment, predictor, done)


def _record(line: Line) -> dict:
    cell, expected = line.cell, line.later
    return {
        "cell": cell.key,
        "variant": cell.entry.name,
        "scene": cell.scene,
        "point": cell.point,
        "objects": cell.objects,
        "lights": cell.lights,
        "processes": cell.processes,
        "frames": cell.parameters.frames,
        "left": line.left,
        "skipped": line.skipped,
        "first_seconds": line.first and line.first.seconds,
        "seconds": expected and expected.seconds,
        "source": expected and expected.source,
    }
