"""Exports the steady frame of each ranked cell for github-action-benchmark, tool "customSmallerIsBetter".

A JSON list of {name, unit, value, range, extra} (its src/extract.ts, `BenchmarkResult`). value: median over processes
of the steady time, s. range: text, its 95 % interval; left out where there is none. extra: text, what else is to know.
"""

import json

from reports.run.results import Cell, Results


def text(results: Results, cells: dict[str, Cell]) -> str:
    """Returns the text of the file for the ranked cells, by name."""
    return json.dumps([_result(results, name, cell) for name, cell in cells.items()], indent=1) + "\n"


def _result(results: Results, name: str, cell: Cell) -> dict:
    found = cell.steady
    interval = {} if found.low is None else {"range": f"{found.low:.6g} .. {found.high:.6g}"}
    record, environment = results.record(cell), results.facts["environment"]
    extra = [
        f"steady frame, median over {found.processes} processes"
        + (f", {found.note}" if found.low is None else ", 95 % interval"),
        f"{cell.errors}; agreement {cell.agreement}",
        f"renderer {record['renderer_version']}, commit {environment['commit']}",
        f"{environment['cpu']}, {environment['os']}",
    ]
    return {"name": name, "unit": "s", "value": found.value, **interval, "extra": "\n".join(extra)}
