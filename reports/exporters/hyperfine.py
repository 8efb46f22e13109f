"""As `hyperfine --export-json` writes it (versions 1.x): the whole processes of each ranked cell, or their frames.

hyperfine times commands, so unless frames are asked for a time is the wall time (s) of one process: start, compilation,
upload, all frames, exit. It grows with the number of frames that the experiment asks for. Processes that found
compiled code in their cache are a result apart from those that did not. Of frames a time is the steady frame (s) of one
process. The command says which it is: the format has no other place for it. mean, stddev, median, min and max are of
`times`; user and system are means of CPU seconds, and null of a frame, for which they are not known;
memory_usage_byte has the peak of each process. (hyperfine's src/benchmark/benchmark_result.rs.)
"""

import json
import statistics

from reports.run import naming
from reports.run.results import Cell, Results

PROCESS, FRAME = "process", "frame"


def text(results: Results, cells: dict[str, Cell], what: str) -> str:
    """The file for the ranked cells. what: PROCESS or FRAME."""
    if what == FRAME:
        entries = [_result(name, cell, cell.rounds("steady_s"), what) for name, cell in cells.items()]
    else:
        split = [part for cell in cells.values() for part in cell.by_cache()]
        names = naming.names(split)
        entries = [_result(name, cell, cell.rounds("wall_s"), what) for name, cell in zip(names, split, strict=True)]
    return json.dumps({"results": entries}, indent=2) + "\n"


def _result(name: str, cell: Cell, rounds: dict[int, float], what: str) -> dict:
    """rounds: the time of each process, s, by the number of its repetition."""
    times, peaks = list(rounds.values()), cell.rounds("peak_bytes")
    memory = [peaks[number] for number in rounds if number in peaks]
    whole = what == PROCESS
    result = {
        "command": f"{name} [{'whole process' if whole else 'steady frame'}]",
        "mean": statistics.mean(times),
        "stddev": statistics.stdev(times) if len(times) > 1 else None,
        "median": statistics.median(times),
        "user": _mean(cell, "user_s") if whole else None,
        "system": _mean(cell, "system_s") if whole else None,
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
