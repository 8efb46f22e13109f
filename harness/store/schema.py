"""Checks a stored run against a schema when it is read, as it may be a stranger's, or damaged.

It checks the types of known values, and that the values which a report needs exist. Other values may be anything.
"""

import dataclasses
from pathlib import Path
from typing import Annotated, Any, Required

from pydantic import ConfigDict, Field, Strict, TypeAdapter, ValidationError
from typing_extensions import TypedDict

from harness.errors import UserError
from harness.renderer.events import OPERATIONS
from harness.renderer.parameters import Parameters

Real = Annotated[float, Field(ge=-1e150, le=1e150, allow_inf_nan=False)]
Amount = Annotated[float, Field(ge=0, le=1e20, allow_inf_nan=False)]
Seconds = Annotated[float, Field(ge=0, le=1e12, allow_inf_nan=False)]
Long = Annotated[float, Field(gt=0, le=1e12, allow_inf_nan=False)]
Count = Annotated[int, Field(ge=0, le=2**63)]
Text = str | None
Plain = str | bool | Real | None  # a Real may be a whole number
Value = Plain | list[Plain] | dict[str, Plain]


def _some(called: str, /, **kinds):
    """A table type: each of these keys, if it exists, has this type."""
    made = TypedDict(called, kinds, total=False)
    made.__pydantic_config__ = ConfigDict(strict=True)
    return made


Unavailable = _some("Unavailable", unavailable=Required[str])
Known = Real | Unavailable | None
Phase = Annotated[tuple[str, Real, Real], Strict(False)]
Named = Annotated[tuple[str, str, str], Strict(False)]  # a cell, as record.identity() has it

_KINDS = {int: Count | None, bool: Count | bool, float: Real, str: str}
_ALL = {field.name: _KINDS.get(field.type, Value) for field in dataclasses.fields(Parameters)}
Digest = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
_REGION = Annotated[str, Field(pattern=r"^[0-9]{1,9}(,[0-9]{1,9}){3}$")]
_JUDGED = dict.fromkeys(("reference", "truth", "against", "wrong", "unavailable"), Text)
_JUDGED |= dict.fromkeys(("reference_file", "mask_file", "span_file", "flip_file"), Text)
_JUDGED |= dict.fromkeys(("truth_file", "standard_error_file"), Text)
_NUMBERS = (
    *("max_outside", "max_inside", "rmse", "relative_mse", "bad_pixels", "mask_fraction", "tolerance", "psnr_db"),
    *("ssim", "flip", "samples", "depth", "change", "unseen", "uncertainty", "max", "below"),
    "rmse_standard_error",
    *("pictures", "standard_error", "rmse_outside"),  # of versions before 0.2
)
_TICKS = ("ticks", "missed", "interval_s", "interval_p50_s", "interval_p99_s", "cpu_s", "integral_s", "wait4_s")
_CELL = {
    **dict.fromkeys(("cell", "variant", "renderer", "renderer_version", "technology", "scene", "scene_version"), str),
    "point": dict[str, Value] | None,
    "parameters": _some("Parameters", **{**_ALL, "region": _REGION}),
    "needs": list[str],
    "lines": Count | None,
    "without": _some("Without", kind=Required[str], proof=Required[str]) | None,
}
Cell = _some("Cell", **_CELL)
Row = _some(
    "Row",
    **_CELL,
    **dict.fromkeys(("pass", "status", "started", "reason"), str),
    **dict.fromkeys(("host", "unranked", "series"), Text),
    repetition=Count,
    lost=bool,
    wall_s=Long | None,
    took_s=Seconds | None,
    truth_s=Seconds | None,
    checked=_some("Checked", frame=Count, render=Count, sample=list[Real], unavailable=str) | None,
    scene_bytes=Count | None,
    shapes=dict[str, Count] | None,
    lights=Count | None,
    phases=list[Phase] | None,
    frames_s=list[Seconds] | None,
    frame_renders=list[Count] | None,
    frame_parts=list[dict[str, Seconds | None] | None] | None,
    cpu=_some(
        "Cpu", user_s=Required[Seconds], system_s=Required[Seconds], series_s=Seconds | None, frame_s=Seconds | None
    )
    | None,
    memory=_some(
        "Memory",
        **dict.fromkeys(("peak_bytes", "render_peak_bytes", "peak_virtual_bytes", "floor_bytes"), Amount | None),
        **dict.fromkeys(("at_least_bytes", "wait4_peak_bytes"), Amount | None),
        method=Text,
    )
    | None,
    rays=_some("Rays", **dict.fromkeys(("primary", "reflected", "transmitted", "shadow"), Required[Amount])) | None,
    used=_some("Used", features=list[str] | None, methods=dict[str, Plain] | None) | None,
    versions=dict[str, Any] | None,
    device=_some(
        "Device", **dict.fromkeys(("name", "type"), Text), simulated=bool | None, compute_capability=list[Count] | None
    )
    | None,
    measurer=_some("Measurer", **dict.fromkeys(_TICKS, Known), gpu=Any) | None,
    warnings=list[str],
    disturbed=dict[str, Known | list[str] | bool] | None,
    gpu=dict[str, Known | list[str]] | None,
    energy=dict[str, Known] | Unavailable | None,
    peaks=dict[str, Any] | None,
    counts=_some(
        "Counts",
        **dict.fromkeys(("tool", "version"), Required[str]),
        **dict.fromkeys(("width", "height"), Required[Annotated[int, Field(gt=0, le=2**31)]]),
        instructions=Required[Annotated[float, Field(gt=0, le=1e20, allow_inf_nan=False)]],
        **dict.fromkeys(("cycles", "branches", "branch_misses", "cache_misses"), Real),
        **dict.fromkeys(("rays", "spread"), Required[Amount | None]),
        smaller=Required[Text],
        options=Required[list[str]],
        environment=Required[dict[str, str]],
    )
    | None,
    operations=_some("Operations", **dict.fromkeys(OPERATIONS, Required[Count])) | Unavailable | None,
    build=_some("Build", seconds=Seconds, compiler=Text, command=list[str]) | None,
    picture=_some("Picture", file=Required[str], sha256=Required[Digest]) | None,
    agreement=_some("Agreement", **_JUDGED, **dict.fromkeys(_NUMBERS, Known)) | None,
    error=_some("Error", **_JUDGED, **dict.fromkeys(_NUMBERS, Known), certificate=dict[str, Any] | None) | None,
    bound=_some("Bound", radiance=Known, max=Known, mean=Known, dropped_file=Text) | None,
    stability=_some(
        "Stability",
        row=Required[str],
        level=Required[Real],
        **dict.fromkeys(("count", "failures"), Required[Count]),
        **dict.fromkeys(("error_median", "error_p99", "error_max", "expected", "limit"), Real | None),
    )
    | None,
)
Pair = _some("Pair", cell=str, label=str, unavailable=str) | None
Rung = _some("Rung", **dict.fromkeys(("name", "renderer", "changes"), Required[str]), image=dict[str, Any])
Batch = _some("Batch", cells=Required[list[Named]], pair=Required[Named | None])
Facts = _some(
    "Facts",
    **dict.fromkeys(("title", "started"), str),
    command=list[str],
    environment=_some(
        "Environment",
        **dict.fromkeys(("host", "cpu", "commit", "os", "python"), str),
        cores=dict[str, Count | str | None],
        memory_bytes=Amount | str | None,
        compilers=dict[str, Any],
        packages=dict[str, Any],
    )
    | None,
    experiment=_some(
        "Experiment",
        **dict.fromkeys(("processes", "frames"), Annotated[int, Field(ge=0, le=10**6)]),
        override=dict[str, dict[str, Any]],
        theory=dict[str, dict[str, Real]],
        image=dict[str, Any],
        measure=dict[str, Any],
        case=list[dict[str, Any]],
        ladder=list[_some("Ladder", name=Required[str], study=Text, rung=Required[list[Rung]])],
        generate=dict[str, Any] | list[dict[str, Any]] | None,
        reference=dict[str, Any] | None,
    ),
    pair=Pair,
    cells=list[Cell],
    ended=_some("Ended", at=Required[str]),
    enough=Count | None,
    against=list[_some("Against", variant=Required[str], other=Required[str])],
    gate=_some("Gate", slower_percent=Amount | None, budget=dict[str, Any] | None) | None,
    warnings=list[str],
    left_out=list[_some("LeftOut", constraint=Required[str], cells=Required[Count])],
    stability=dict[str, dict[str, Any]] | None,
    executor=_some("Executor", name=str, batches=list[Batch]),
    job=_some("Job", partition=Text),
    speed=dict[str, list[Amount]] | Unavailable,
)
Line = _some(
    "Line",
    **dict.fromkeys(("job",), Required[str]),
    number=Count,
    **dict.fromkeys(("submitted", "ended"), str),
    **dict.fromkeys(("host", "status", "reason"), Text),
)

Learnt = _some(
    "Learnt",
    **dict.fromkeys(("cell", "variant", "status"), Required[str]),
    **{"pass": str},
    repetition=Required[Count],
    **dict.fromkeys(("took_s", "truth_s", "wall_s"), Seconds | None),
    parameters=Required[_some("Work", region=Required[_REGION], depth=Required[Count], frames=Required[Count])],
    shapes=dict[str, Count] | None,
    lights=Count | None,
)

_ROW, _FACTS, _LINE, _LEARNT = map(TypeAdapter, (Row, Facts, Line, Learnt))

# Keys that the report of a run needs.
OF_RUN = "title", "experiment", "started", "command", "environment", "cells"
OF_CELL = "cell", "variant", "scene", "point", "parameters"
OF_ROW = (
    *(*OF_CELL, "technology", "repetition", "status", "reason", "started", "wall_s", "phases", "frames_s", "cpu"),
    *("memory", "rays", "used", "versions", "build", "picture", "agreement", "measurer", "series", "warnings"),
)
NEVER_NONE = "environment", "point"
OF_FRONT = "experiment", "environment", "cells", "executor"  # of a run on a cluster
OF_PART = "cell", "variant", "scene", "point", "repetition", "pass", "status", "host"
OF_EXPERIMENT = "processes", "override", "measure"


def row(record, file: Path, line: int) -> None:
    """UserError if a line of repetitions.jsonl has values of wrong types."""
    _check(_ROW, record, file, line)


def teaches(record) -> bool:
    """Whether predict.py can learn from a record, which may be of any version."""
    try:
        _LEARNT.validate_python(record)
    except ValidationError:
        return False
    return True


def facts(run, file: Path) -> None:
    """UserError if a run.json has values of wrong types, or a cell has no key."""
    _check(_FACTS, run, file)
    for number, cell in enumerate(run.get("cells", ())):
        _there(("cell",), cell, f"cells.{number}.", file)


def job(record, file: Path, line: int) -> None:
    """UserError if a line of jobs.jsonl lacks a key, or has values of wrong types."""
    _check(_LINE, record, file, line)
    _there(("number",) if "submitted" in record else ("host", "status", "reason"), record, f"line {line}: ", file)


def front(run: dict, file: Path) -> None:
    """UserError if a run.json is not of a run on a cluster."""
    _there(OF_FRONT, run, "", file)
    _there(("batches",), run["executor"], "executor.", file)
    _there(OF_EXPERIMENT, run["experiment"], "experiment.", file)
    for number, cell in enumerate(run["cells"]):
        _there(OF_CELL, cell, f"cells.{number}.", file)


def part(run: dict, records: list[dict], folder: Path) -> None:
    """UserError if a part of a run on a cluster cannot be merged with others."""
    file = Path(folder) / "run.json"
    _there(("environment", "cells"), run, "", file)
    _there(("host",), run["environment"], "environment.", file)
    for cell in run["cells"]:
        _there(OF_CELL[:4], cell, f"{cell['cell']}: ", file)
    for record in records:
        _there(OF_PART, record, f"repetition {record.get('repetition')}: ", file.with_name("repetitions.jsonl"))


def complete(run: dict, records: list[dict], folder: Path) -> None:
    """UserError if the run.json or the records of a run lack a key that a report needs."""
    file = Path(folder) / "run.json"
    _there(OF_RUN, run, "", file)
    _there(("processes", "frames", "image", "measure"), run["experiment"], "experiment.", file)
    _there(("interval",), run["experiment"]["measure"], "experiment.measure.", file)
    _there(("host", "commit", "cores"), run["environment"], "environment.", file)
    _there(("logical",), run["environment"]["cores"], "environment.cores.", file)
    for number, cell in enumerate(run["cells"]):
        _there(OF_CELL, cell, f"cells.{number}.", file)
    for pair in (run.get("pair"), *run.get("pairs", ())):
        if pair and "unavailable" not in pair:
            _there(("cell", "label"), pair, "pair.", file)
    for record in records:
        place = f"repetition {record.get('repetition')} of {record.get('variant')}: "
        _there(OF_ROW, record, place, file.with_name("repetitions.jsonl"))


def _there(names: tuple[str, ...], table: dict, place: str, file: Path) -> None:
    missing = [name for name in names if name not in table]
    if missing or (missing := [name for name in NEVER_NONE if name in names and table[name] is None]):
        raise UserError(f"{place}{missing[0]} is missing", file=file, remedy=REMEDY)


REMEDY = "it is damaged, or of another version of rayrace"


def _check(adapter: TypeAdapter, value, file: Path, line: int | None = None) -> None:
    try:
        adapter.validate_python(value)
    except ValidationError as error:
        fault = error.errors(include_url=False, include_context=False)[0]
        place = ".".join(str(step) for step in fault["loc"])
        raise UserError(
            f"{place}: {fault['msg']}" if place else fault["msg"], file=file, line=line, remedy=REMEDY
        ) from None
