"""As `hyperfine --export-json` writes it (versions 1.x): what each ranked cell's processes took from start to end.

hyperfine times commands, so a time is the wall time (s) of one process: start, compilation, upload, all frames, exit.
It is no time of a frame, and grows with the number of frames that the experiment asks for. Processes that found
compiled code in their cache are a result apart from those that did not. mean, stddev, median, min and max are of
`times`; user and system are means of CPU seconds; memory_usage_byte has the peak of each process. (hyperfine's
src/benchmark/benchmark_result.rs.)
"""

import json
import statistics

from reports.run import naming
from reports.run.results import Cell, Results


def text(results: Results, cells: dict[str, Cell]) -> str:
    """The file for the ranked cells."""
    split = [part for cell in cells.values() for part in cell.by_cache()]
    found = [_result(name, cell) for name, cell in zip(naming.names(split), split, strict=True)]
    return json.dumps({"results": found}, indent=2) + "\n"


def _result(name: str, cell: Cell) -> dict:
    times = cell.values("wall_s")
    memory = cell.values("peak_bytes")
    result = {
        "command": name,
        "mean": statistics.mean(times),
        "stddev": statistics.stdev(times) if len(times) > 1 else None,
        "median": statistics.median(times),
        "user": _mean(cell, "user_s"),
        "system": _mean(cell, "system_s"),
        "min": min(times),
        "max": max(times),
        "times": times,
        "exit_codes": [0] * len(times),  # of every process that is ok (renderers/README.md)
    }
    if len(memory) == len(times):
        result["memory_usage_byte"] = [round(value) for value in memory]
    if cell.swept:
        result["parameters"] = {key: str(value) for key, value in cell.swept.items()}
    return result


def _mean(cell: Cell, column: str) -> float | None:
    values = cell.values(column)
    return statistics.mean(values) if values else None
