"""Defines the keys and identities of the rows of a run, and the row of a repetition that no job ran."""

import json

# Keys by origin: from the process and its measurer; verdicts on its result; everything else.
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
    """The identity of a cell in the experiment: variant, scene, point. told: facts of the cell, or a row."""
    return told["variant"], told["scene"], json.dumps(told["point"], sort_keys=True)


def key(record: dict) -> tuple:
    """The key of a repetition, which no two valid rows share."""
    return *identity(record), record["repetition"], record["pass"]


def lost(cell: dict, number: int, kind: str, status: str, reason: str, started: str) -> dict:
    """The row of a repetition that no job ran. cell: its facts; kind: the pass; started: ISO time of its submission."""
    nothing = dict.fromkeys((*MEASURED, *JUDGED, *AROUND))
    told = {"repetition": number, "pass": kind, "status": status, "reason": reason, "started": started, "warnings": []}
    return {**cell, **nothing, **told, "lost": True}
