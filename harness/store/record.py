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


def largest(accuracy: dict) -> float | None:
    """Returns the largest error of a judged picture over all pixels, inside the mask and outside; None if unknown."""
    sides = accuracy.get("max_outside"), accuracy.get("max_inside")
    return max((side for side in sides if side is not None), default=None)


def errors(rmse: float | None, worst: float | None, beyond: float | None) -> str:
    """The errors over all pixels in words: RMSE, largest, share of pixels with a channel off by more than 1/255.

    Of first hits, which have no RMSE: the largest error of a distance, and the share of rays that hit something else.
    """
    if worst is None:
        return "error unavailable"
    if rmse is None:
        share = "how many hit something else is unavailable"
        if beyond is not None:
            share = f"{percent(beyond)} of rays hit something else" if beyond else "no ray hits something else"
        return f"largest error of a distance {worst:.3g}, {share}"
    share = "share beyond 1/255 unavailable"
    if beyond is not None:
        share = f"{percent(beyond)} of pixels beyond 1/255" if beyond else "no pixel beyond 1/255"
    return f"RMSE {rmse:.2g}, largest error {worst:.3g}, {share}"


def percent(share: float) -> str:
    return f"{100 * share:.2g} %" if share else "none"
