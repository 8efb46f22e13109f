"""Estimates how much the speed of a machine changed between two runs, which no interval of either run contains."""

import json
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import islice

from harness.errors import UserError
from harness.statistics import statistics
from harness.store import store
from reports.compare import runs, witness
from reports.paper import quantity
from reports.run import ranking, results
from reports.run.results import Cell, Results

LEAST_RUNS = 11  # the range of 11 normal variates is above the difference of two others 19 times in 20
MOST_RUNS = 50  # that are read, the newest first
REMEDY = "hold one version against the other in one run: rayrace run EXPERIMENT --against COMMIT"


@dataclass(frozen=True)
class Drift:
    """value: the relative difference in time that may be the machine's, None if unknown. source: where it is from, or
    why it is unknown."""

    value: float | None
    source: str


def between(a: Results, b: Results, pairs: list[tuple[Cell, Cell]]) -> Drift:
    """Returns the drift between two runs. pairs: cells of both that are compared.

    It is measured by cells that have not changed, else by earlier runs of equal cells in the same folders.
    """
    if changed := [*runs.machine(a, b), *runs.software(a, b)]:
        return Drift(None, f"unknown: machine or software changed ({changed[0]})")
    same = [pair for pair in pairs if unchanged(a, b, *pair) and not any(cell.unranked for cell in pair)]
    columns = [witness.of((a, cell_a), (b, cell_b)).column for cell_a, cell_b in same]
    ratios = [ranking.unpaired(cell_b, cell_a, column) for (cell_a, cell_b), column in zip(same, columns, strict=True)]
    bounded = [ratio for ratio in ratios if ratio.low is not None]
    if bounded:
        value = max(statistics.difference(end) for ratio in bounded for end in (ratio.low, ratio.high))
        return Drift(value, f"{quantity.percentage(value)}, by {_count(len(bounded), 'cell')} that did not change")
    spreads = _spreads(a, b)
    if spreads:
        value = max(largest for largest, _ in spreads)
        return Drift(
            value, f"{quantity.percentage(value)}, by {max(count for _, count in spreads)} runs of equal cells"
        )
    return Drift(
        None, f"unknown: no cell is of the same renderer in both, nor in {LEAST_RUNS} runs beside them; {REMEDY}"
    )


def unchanged(a: Results, b: Results, cell_a: Cell, cell_b: Cell) -> bool:
    """Whether two cells are of the same renderer, scene and parameters; of unknown versions they are not."""
    identity, other = (_identity(*both) for both in ((a, cell_a), (b, cell_b)))
    return identity is not None and identity == other


def _identity(run: Results, cell: Cell) -> str | None:
    record = run.record(cell) or {}
    identity = [record.get(name) for name in ("variant", "renderer_version", "scene_version", "parameters")]
    return None if identity[1] is None else json.dumps(identity, sort_keys=True)


def _spreads(a: Results, b: Results) -> list[tuple[float, int]]:
    """Returns, of each cell that enough runs have, the largest ratio of two medians less 1, and the number of runs."""
    medians: dict[str, list[float]] = {}
    wanted = {cell["cell"] for run in (a, b) for cell in run.facts["cells"]}
    loaded = [a, b, *islice(_beside(a, b, wanted), MOST_RUNS)]
    for run in loaded:
        for cell in run.cells:
            identity = None if cell.unranked else _identity(run, cell)
            if identity is not None:
                medians.setdefault(identity, []).append(cell.steady.value)
    return [(max(some) / min(some) - 1, len(some)) for some in medians.values() if len(some) >= LEAST_RUNS]


def _beside(a: Results, b: Results, wanted: set[str]) -> Iterable[Results]:
    """Yields the runs beside two runs, the newest first, of the same machine and with any of the cells `wanted`."""
    places = dict.fromkeys(run.folder.resolve().parent for run in (a, b))
    folders = {run.folder.resolve() for run in (a, b)}
    machine = set(store.facts_of(a.folder)["hosts"])
    for path in sorted((p for place in places for p in place.glob("*/run.json")), reverse=True):
        if path.parent in folders:
            continue
        try:
            facts = store.facts_of(path.parent)
            if set(facts.get("hosts", ())) == machine and wanted & {cell["cell"] for cell in facts["cells"]}:
                yield results.load(path.parent)
        except UserError:  # it is none, or damaged, or of several hosts
            continue


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' * (number != 1)}"
