"""A row of a run as a table of names and values (store.py): what it is called, and what one has that nobody ran."""

import json

# What a process tells, and what is found out about it.
MEASURED = (
    *("wall_s", "phases", "frames_s", "frame_renders", "frame_parts", "cpu", "memory", "rays"),
    *("used", "versions", "device", "measurer", "series"),
)
JUDGED = "picture", "accuracy", "error", "bound", "stability"
AROUND = "shapes", "lights", "unranked", "peaks", "disturbed", "gpu", "build", "took_s", "host"


def identity(told: dict) -> tuple[str, str, str]:
    """What an experiment calls a cell, of its facts or of a row, whatever is behind the names."""
    return told["variant"], told["scene"], json.dumps(told["point"], sort_keys=True)


def key(record: dict) -> tuple:
    """Of a repetition: no two rows that stand have the same."""
    return *identity(record), record["repetition"], record["pass"]


def lost(cell: dict, number: int, kind: str, status: str, reason: str, started: str) -> dict:
    """The row of a repetition of a cell, by its facts, that nobody ran. started: when it was asked for."""
    nothing = dict.fromkeys((*MEASURED, *JUDGED, *AROUND))
    told = {"repetition": number, "pass": kind, "status": status, "reason": reason, "started": started, "warnings": []}
    return {**cell, **nothing, **told, "lost": True}
