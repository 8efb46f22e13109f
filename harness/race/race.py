"""Runs a plan: one repetition at a time, each judged and stored before the next begins."""

import math
import statistics
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from harness.errors import UserError
from harness.experiment.experiment import Experiment
from harness.machine import environment
from harness.plan import resume
from harness.plan.plan import Cell, Plan, Turn
from harness.plan.predict import Predictor
from harness.process.repetition import METHODS
from harness.process.scratch import scratch
from harness.race import enough, load_pass, stopping
from harness.race.bench import Bench, timestamp
from harness.race.host import Host, ThisHost
from harness.renderer.registry import Entry, usable_cores
from harness.store import confined, store
from harness.store.alone import only_one
from harness.store.record import killed_by_others

STATE = ("load", "pressure", "frequency", "governor", "turbo")  # of the environment, again when a run has ended
REMEDY = "what had finished is kept; start a new run with what is there now"

# tell(cell, record, done, all, seconds left or None), begins(cell, done, all, seconds left or None)
Tell = Callable[[Cell, dict, int, int, float | None], None]
Begins = Callable[[Cell, int, int, float | None], None]
Keeps = Callable[[list[dict]], None]


def run(
    experiment: Experiment,
    plan: Plan,
    entries: dict[str, Entry],
    folder: Path,
    tell: Tell = lambda *_: None,
    resumed: bool = False,
    budget: float = math.inf,
    host: Host | None = None,
    earlier: Iterable[dict] = (),
    part: dict | None = None,
    elsewhere: Iterable[dict] = (),
    begins: Begins = lambda *_: None,
    kept: Keeps = lambda _: None,
    gate: dict | None = None,
) -> list[dict]:
    """Run every repetition of the plan into `folder`. Returns the records.

    begins: is called before each repetition; tell: after it. kept: is called with the records that a resumed run has.
    resumed: the folder holds a run that was cut off; only what it lacks is run (resume.py). budget: seconds after which
    no repetition begins, nor one that is predicted to end later; as all cells have their turn before any has its
    second, every cell then has fewer repetitions. earlier: rows of other runs, to predict from. part, elsewhere: for
    one part of a run (part.py), what run.json says of the part, and the rows of other parts, which are not run again.
    gate: what run.json says of the gate that the run is held to, {slower_percent, budget}.
    UserError if a renderer is edited meanwhile, or if another process works on the folder.
    """
    where = host or ThisHost()
    if resumed:
        confined.check_to_write(folder)
    else:
        folder.mkdir(parents=True, exist_ok=True)
    with only_one(folder), where.exclusive():
        hooks = tell, begins, kept
        more = {"gate": gate, **(part or {})}
        return _run(experiment, plan, entries, folder, hooks, resumed, budget, where, earlier, more, list(elsewhere))


def describe(experiment: Experiment, plan: Plan) -> dict:
    """Returns the content of run.json when a run begins."""
    return {
        "title": experiment.title,
        "experiment": experiment.model_dump(),
        "started": timestamp(),
        "command": ["rayrace", *sys.argv[1:]],
        "environment": environment.capture(),
        "order": experiment.order,
        "pair": {"cell": plan.pair.key, "label": plan.pair.label} if plan.pair else {"unavailable": plan.pair_reason},
        "against": [{"variant": name, "other": other} for name, other in plan.against],
        "left_out": [{"constraint": constraint, "cells": count} for constraint, count in plan.left_out],
        "warnings": list(plan.warnings),
        "stability": {cell.stressed.row.name: cell.stressed.row.facts() for cell in plan.cells if cell.stressed},
        "cells": [cell.facts() for cell in plan.cells],
    }


def _run(experiment, plan, entries, folder, hooks, resumed, budget, host, earlier, more, elsewhere) -> list[dict]:
    facts = {**describe(experiment, plan), **more}
    records, (*per_turn, kept) = [], hooks
    if resumed and not store.is_blank(folder):
        facts, records = _go_on(facts, *resume.check(folder, plan))
        records = [record for record in records if not killed_by_others(record)]
        kept(records)
    run_store = store.Run(folder)
    try:
        run_store.describe(**facts)
        with scratch() as caches, host.untimed() as untimed:
            bench = Bench(plan, entries, run_store, caches, experiment.measure.interval, host, untimed)
            loop = _Loop(experiment, plan, bench, records, per_turn, host.clock() + budget, earlier, elsewhere)
            loop.run()
        state = environment.capture()
        ended = {"at": timestamp(), **{name: state[name] for name in STATE}}
        run_store.describe(**facts, enough=loop.enough, ended=ended)
    finally:
        run_store.close()
    return records


class _Loop:
    """The turns of a run that are due, one after the other."""

    def __init__(
        self,
        experiment: Experiment,
        plan: Plan,
        bench: Bench,
        records: list[dict],
        hooks: tuple[Tell, Begins],
        end: float,
        earlier,
        elsewhere,
    ):
        self.plan, self.bench, self.records, self.end = plan, bench, records, end
        self.tell, self.begins = hooks
        self.clock = bench.host.clock
        self.gpu_load, self.until = experiment.measure.gpu_load, experiment.measure.until
        self.elsewhere = elsewhere
        self.there = {(record["cell"], record["repetition"], record["pass"]) for record in [*elsewhere, *records]}
        self.due = [
            turn for turn in plan.order(experiment.seed, experiment.order)
            if (turn.cell.key, turn.number, turn.kind) not in self.there
        ]  # fmt: skip
        # Nothing is timed under stress: jobs that can share a process come one after the other.
        self.due.sort(key=lambda turn: _kernel(turn.cell) if turn.cell.stressed else ())
        self.left = Counter(turn.cell.key for turn in self.due if turn.kind != "count")
        self.uncounted = {turn.cell.key: turn.cell for turn in self.due if turn.kind == "count"}
        self.total = len(records) + len(self.due)
        self.idle = {cell.key for cell in plan.cells if cell.refused}
        self.predictor = Predictor([*earlier, *elsewhere, *records])
        self.left_s, self.looked = None, -math.inf
        self.enough: int | None = None  # rounds after which all ratios were known well enough
        for record in records:
            if record["picture"]:
                bench.pictures.setdefault(record["cell"], record["picture"]["sha256"])

    def run(self) -> None:
        """Each turn, stored as it ends; then the load pass, if the budget has let all have their turn."""
        _build([turn.cell for turn in self.due if turn.cell.stressed and turn.cell.refused is None])
        last, looks = None, set(enough.looks(max((turn.number for turn in self.due), default=0)))
        for turn in self.due:
            if turn.kind != "count":
                if turn.number != last and turn.number in looks and self.enough is None:
                    self._look()
                last = turn.number
                if self.enough is not None:
                    continue
            if not self._fits(turn):
                return
            self._take(turn)
        more = [
            cell for cell in load_pass.cells(self.plan, [*self.elsewhere, *self.records], self.gpu_load)
            if (cell.key, 0, "load") not in self.there
        ]  # fmt: skip
        self.total += len(more)
        for cell in more:
            if self.clock() >= self.end:
                return
            self._take(Turn(cell, 0, "load"))

    def _look(self) -> None:
        """Are all ratios known well enough? What is left is then not due, but for counts."""
        self.enough = enough.rounds(self.until, self.plan, [*self.elsewhere, *self.records])
        if self.enough is not None:
            self.left.clear()
            self.total = len(self.records) + len(self.uncounted)

    def _fits(self, turn: Turn) -> bool:
        """Is there time for it? A first repetition is begun as long as there is any."""
        if turn.kind == "count":
            return self.clock() + (self.predictor.count(turn.cell) or 0.0) < self.end
        if turn.number == 0 or math.isinf(self.end):
            return self.clock() < self.end
        expected = self.predictor.seconds(turn.cell)
        return self.clock() + (expected.seconds if expected else 0.0) < self.end

    def _take(self, turn: Turn) -> None:
        stopping.heed_again()
        _must_be_unchanged(turn.cell)
        self.begins(turn.cell, len(self.records), self.total, self._time_left())
        record = self.bench.repeat(*turn)
        _must_be_unchanged(turn.cell)  # else nobody knows which of the two has run
        self.bench.store.append(record)
        self.records.append(record)
        self.there.add((turn.cell.key, turn.number, turn.kind))
        if turn.kind == "count":
            del self.uncounted[turn.cell.key]
        else:
            self.left[turn.cell.key] -= 1
        self.predictor.add(record)
        self.tell(turn.cell, record, len(self.records), self.total, self._time_left())

    def _time_left(self) -> float | None:
        """Predicts the seconds of what is due, at most those of the budget; None before any of it can be predicted.

        What cannot be predicted yet takes the mean of what can. Worked out once a second.
        """
        if self.clock() - self.looked > 1:
            cells = [cell for cell in self.plan.cells if self.left[cell.key] > 0 and cell.key not in self.idle]
            parts = [self._seconds(cell, self.left[cell.key]) for cell in cells]
            parts += [self.predictor.count(cell) for key, cell in self.uncounted.items() if key not in self.idle]
            predicted = [part for part in parts if part is not None]
            if predicted or not parts:
                unknown = (len(parts) - len(predicted)) * (statistics.mean(predicted) if predicted else 0.0)
                left_s = sum(predicted) + unknown + len(self._truths_left()) * self.predictor.truth
                self.left_s = max(0.0, min(left_s, self.end - self.clock()))
            self.looked = self.clock()
        return self.left_s

    def _truths_left(self) -> set[tuple]:
        """The truths that no repetition has made yet."""
        cells = [cell for cell in self.plan.cells if cell.key not in self.idle]
        begun = [cell for cell in cells if (cell.key, 0, "timed") in self.there]
        return self.plan.truths_of(cell for cell in cells if self.left[cell.key]) - self.plan.truths_of(begun)

    def _seconds(self, cell: Cell, count: int) -> float | None:
        """Predicted for `count` more repetitions of a cell."""
        later = self.predictor.seconds(cell)
        if later is None:
            return None
        begun = (cell.key, 0, "timed") in self.there
        first = later if begun else self.predictor.seconds(cell, first=True) or later
        return first.seconds + (count - 1) * later.seconds


def _build(cells: list[Cell]) -> None:
    """Build all that cells under stress need, on all cores, as nothing is timed: a build that fails fails each cell."""
    with ThreadPoolExecutor(usable_cores()) as pool:
        try:
            for cell in {_kernel(cell): cell for cell in cells if cell.entry.renderer.manifest.build}.values():
                pool.submit(cell.entry.renderer.build, cell.parameters, cell.needs)
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def _kernel(cell: Cell) -> tuple:
    """What a compiled kernel of a cell depends on, in an order for sorting."""
    methods = [str(getattr(cell.parameters, name)) for name in ("kind", *METHODS)]
    return cell.entry.name, *methods, cell.needs


def _must_be_unchanged(cell: Cell) -> None:
    changed = cell.entry.renderer.changed()
    if changed:
        files = ", ".join(map(str, changed))
        raise UserError(f"{cell.entry.name} was edited during the run: {files}", remedy=REMEDY)


def _go_on(now: dict, before: dict, records: list[dict]) -> tuple[dict, list[dict]]:
    """Returns the content of run.json of a resumed run, and its rows."""
    keys = {cell["cell"] for cell in before["cells"]}
    again = {name: now[name] for name in ("started", "command", "experiment", "order", "pair", "left_out")}
    return {
        **{name: value for name, value in before.items() if name not in ("format", "hosts", "enough", "ended")},
        "stability": {**now["stability"], **before.get("stability", {})},
        "against": now["against"] or before.get("against", []),
        "gate": now["gate"] or before.get("gate"),
        "cells": [*before["cells"], *(cell for cell in now["cells"] if cell["cell"] not in keys)],
        "resumed": [*before.get("resumed", []), again],
    }, records


def new_folder(title: str, parent: Path) -> Path:
    """A folder of its own for a new run: the time, and the experiment's name."""
    stamp = time.strftime("%Y%m%d-%H%M%S")
    for extra in ("", *(f"-{n}" for n in range(2, 100))):
        folder = parent / f"{stamp}-{title}{extra}"
        try:
            folder.mkdir(parents=True)
            return folder
        except FileExistsError:
            continue
    raise FileExistsError(f"{parent}/{stamp}-{title}")
