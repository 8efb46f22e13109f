"""Exports the steady frame of each ranked cell for github-action-benchmark, tool "customSmallerIsBetter".

A JSON list of {name, unit, value, range, extra} (its src/extract.ts, `BenchmarkResult`). value: median over processes
of the steady time, s. range: text, its 95 % interval; left out where there is none. extra: text, what else is to know.
A cell whose instructions were counted has a second result.
"""

import json

from reports.run.results import Cell, Missing, Results


def text(results: Results, cells: dict[str, Cell]) -> str:
    """Returns the text of the file for the ranked cells, by name."""
    entries = []
    for name, cell in cells.items():
        entries += [_result(results, name, cell), *_counted(results, name, cell)]
    return json.dumps(entries, indent=1) + "\n"


def _counted(results: Results, name: str, cell: Cell) -> list[dict]:
    counts = results.counts(cell)
    if isinstance(counts, Missing):
        return []
    extra = (
        f"of a steady frame of {counts['width']} x {counts['height']} pixels, by {counts['tool']} {counts['version']}"
    )
    unit = "instructions"
    return [{"name": f"{name}, {unit}", "unit": unit, "value": counts["instructions"], "extra": extra}]


def _result(results: Results, name: str, cell: Cell) -> dict:
    estimate = cell.steady
    interval = {} if estimate.low is None else {"range": f"{estimate.low:.6g} .. {estimate.high:.6g}"}
    record, environment = results.record(cell), results.facts["environment"]
    extra = [
        f"steady frame, median over {estimate.processes} processes"
        + (f", {estimate.note}" if estimate.low is None else ", 95 % interval"),
        f"{cell.errors}; agreement {cell.agreement}",
        f"renderer {record['renderer_version']}, commit {environment['commit']}",
        f"{environment['cpu']}, {environment['os']}",
    ]
    return {"name": name, "unit": "s", "value": estimate.value, **interval, "extra": "\n".join(extra)}
