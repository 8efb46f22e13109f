"""Exports a Parquet file: a row for each repetition of any status and pass, and run.json as the file's metadata.

The columns are those of repetitions.csv in a report, what identifies the row, `point.` and `parameters.` with the
swept values and the job's parameters, `counts.` of what was counted in a frame, and the lists `frames_s` and
`frame_renders`. Unknown values are null, and a column without a known value has the type null. A column with values
of several types is text, each value as JSON.
"""

import json
from pathlib import Path

from harness.errors import UserError
from harness.system import output
from reports.run import repetition
from reports.run.results import Results

COUNTS = "instructions", "cycles", "branches", "branch_misses", "cache_misses", "rays", "spread", "tool", "version"
IDENTITY = "cell", "renderer", "renderer_version", "scene_version", "started", "took_s", "frames_s", "frame_renders"


def write(results: Results, out: Path) -> None:
    """Writes the file `out`. UserError if pyarrow is not installed."""
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError as error:
        raise UserError(f"parquet needs pyarrow: {error}", remedy="pip install 'rayrace[parquet]'") from None
    outlying = results.repetitions["outlier"].tolist()
    rows = [_row(record, is_out) for record, is_out in zip(results.records, outlying, strict=True)]
    columns = {name: _column(pyarrow, [row.get(name) for row in rows]) for name in _names(rows)}
    about = {"rayrace export": "a row for each repetition", "rayrace run.json": json.dumps(results.facts)}
    output.write(out, lambda file: parquet.write_table(pyarrow.table(columns, metadata=about), file), own=False)


def _row(record: dict, is_out: bool) -> dict:
    return {
        **{name: record.get(name) for name in IDENTITY},
        **{f"{group}.{key}": value for group in ("point", "parameters") for key, value in record[group].items()},
        **repetition.row(record),
        **{f"counts.{key}": value for key, value in (record.get("counts") or {}).items() if key in COUNTS},
        "outlier": is_out,
    }


def _names(rows: list[dict]) -> list[str]:
    """Returns the names of all columns in the order in which they first appear."""
    return list(dict.fromkeys(name for row in rows for name in row))


def _column(pyarrow, values: list):
    try:
        return pyarrow.array(values)
    except (pyarrow.ArrowInvalid, pyarrow.ArrowTypeError):
        return pyarrow.array([None if value is None else json.dumps(value) for value in values])
