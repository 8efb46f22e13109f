"""Exports a suite of benchmarks for pyperf (format 1.0): `pyperf compare_to`, `stats`, `hist`, `check`.

A benchmark is a ranked cell; a run of it is a process: its values are the durations (s) of its steady frames, its
warm-ups those of the frames before. The renders of a batch frame are pyperf's loops. Unknown metadata are left out.
Processor, host and Python are those of the harness.
"""

import json
import re

from harness.statistics import steady
from reports.run import repetition
from reports.run.results import Cell, Missing, Results

# Of a steady frame, as metadata: pyperf has no benchmark of counts.
COUNTS = "instructions", "cycles", "branches", "branch_misses", "cache_misses", "width", "height", "tool", "version"


def text(results: Results, cells: dict[str, Cell]) -> str:
    """The file for the ranked cells, by name."""
    benchmarks = [
        {"metadata": _about(results, name, cell), "runs": [_run(results.records[index]) for index in _steady(cell)]}
        for name, cell in cells.items()
    ]
    suite = {"version": "1.0", "metadata": _machine(results.facts["environment"]), "benchmarks": benchmarks}
    return json.dumps(suite, indent=1, allow_nan=False) + "\n"


def _steady(cell: Cell):
    """Returns the indices of its records with steady frames."""
    return cell.good.dropna(subset=["steady_s"]).index


def _machine(environment: dict) -> dict:
    """Returns the machine by pyperf's names (its doc/metadata.rst)."""
    implementation, _, version = environment["python"].partition(" ")
    return _known(
        hostname=environment["host"],
        cpu_model_name=environment["cpu"],
        cpu_count=environment["cores"]["logical"],
        platform=f"{environment['os']}, kernel {environment['kernel']}, {environment['architecture']}",
        python_implementation=implementation.lower(),
        python_version=version,
        rayrace_commit=environment["commit"],
    )


def _about(results: Results, name: str, cell: Cell) -> dict:
    record = results.record(cell)
    errors = {name: cell.error(name) for name in repetition.ERRORS}
    counts = results.counts(cell)
    counted = {} if isinstance(counts, Missing) else {f"count_{key}": counts.get(key) for key in COUNTS}
    return _known(
        name=name,
        unit="second",
        timed="steady frames",
        variant=cell.variant,
        renderer_version=record["renderer_version"],
        scene=cell.scene,
        scene_version=record.get("scene_version"),
        **{name: value for name, value in errors.items() if isinstance(value, float)},
        error_against=cell.against,
        **counted,
        agrees=None if isinstance(cell.agrees, Missing) else "yes" if cell.agrees else "no",
        **{f"parameter_{key}": value for key, value in cell.parameters.items()},
    )


def _run(record: dict) -> dict:
    """Returns one process."""
    frames, steady_frames = record["frames_s"], steady.find(record["frames_s"])
    first = steady_frames.start
    loops = record.get("frame_renders") or [1] * len(frames)
    peak = (record["memory"] or {}).get("peak_bytes")
    metadata = _known(
        loops=loops[first],
        date=record["started"],
        duration=record["wall_s"],
        mem_max_rss=None if peak is None else round(peak),
    )
    return {
        "metadata": metadata,
        "warmups": list(zip(loops[:first], frames[:first], strict=True)),
        "values": list(steady_frames.frames),
    }


def _known(**metadata) -> dict:
    """Returns the known metadata; pyperf takes numbers and text of one line that is not empty."""
    kept = {}
    for name, value in metadata.items():
        value = re.sub(r"\s+", " ", value).strip() if isinstance(value, str) else value
        if value is not None and value != "" and not str(value).startswith("unavailable"):
            kept[name] = value
    return kept
