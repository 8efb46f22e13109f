"""Names and identities of the rows of a run, and the row of a repetition that nobody ran."""

import json

# What a process tells, and what is found out about it.
MEASURED = (
    *("wall_s", "phases", "frames_s", "frame_renders", "frame_parts", "cpu", "memory", "rays"),
    *("used", "versions", "device", "measurer", "series"),
)
JUDGED = "picture", "accuracy", "error", "bound", "stability"
CONTRADICTED = (
    "its marks contradict "  # begins why a row is unranked whose times cannot be (harness/race/contradiction.py)
)
AROUND = "shapes", "lights", "unranked", "peaks", "disturbed", "gpu", "build", "took_s", "host"


def identity(told: dict) -> tuple[str, str, str]:
    """Returns the identity of a cell in the experiment, from its facts or a row: variant, scene, point."""
    return told["variant"], told["scene"], json.dumps(told["point"], sort_keys=True)


def key(record: dict) -> tuple:
    """Returns the key of a repetition, which no two valid rows share."""
    return *identity(record), record["repetition"], record["pass"]


def lost(cell: dict, number: int, kind: str, status: str, reason: str, started: str) -> dict:
    """The row of a repetition of a cell, by its facts, that nobody ran. started: when it was asked for."""
    nothing = dict.fromkeys((*MEASURED, *JUDGED, *AROUND))
    told = {"repetition": number, "pass": kind, "status": status, "reason": reason, "started": started, "warnings": []}
    return {**cell, **nothing, **told, "lost": True}
