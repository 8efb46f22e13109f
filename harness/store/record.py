"""Defines the keys and identities of the rows of a run, and the row of a repetition that no job ran."""

import json

from harness.process.process import UNWATCHED
from harness.process.repetition import BY_OTHERS
from harness.statistics.digits import percentage
from harness.store import clean

# Keys by origin: from the process and its measurer; verdicts on its result; everything else.
MEASURED = (
    *("wall_s", "phases", "frames_s", "frame_renders", "frame_parts", "cpu", "memory", "rays"),
    *("used", "versions", "device", "measurer", "series"),
)
JUDGED = "picture", "agreement", "error", "bound", "stability"
WHOLE = "nothing"  # what a whole scene is `without`, where others are without something
NORMAL = 1.96  # standard errors on either side of a 95 % interval
MASK = 0.01  # share of ill-conditioned pixels from which on it is told
CONTRADICTED = (
    "its marks contradict "  # begins why a row is unranked whose times cannot be (harness/race/contradiction.py)
)
# Of later frames (harness/race/frames.py): one that is false is enough; nobody knows whether they are right.
FALSE_FRAMES, UNCHECKED = f"{CONTRADICTED}its later frames: ", "frames unchecked: "
BAD = ("failed", "timeout", "killed", "wrong picture")
EXHIBIT = "exhibit: "  # begins why an exhibit of a fault is unranked: a wrong picture is what it is for
AROUND = (
    "checked",
    "shapes",
    "scene_bytes",
    "lights",
    "unranked",
    "peaks",
    "disturbed",
    "gpu",
    "build",
    "took_s",
    "truth_s",
    "host",
)


def identity(facts: dict) -> tuple[str, str, str]:
    """The identity of a cell in the experiment: variant, scene, point. facts: of the cell, or a row.

    Names are as they are read back (clean.py).
    """
    variant, scene, point = clean.cleaned([facts["variant"], facts["scene"], facts["point"]])
    return variant, scene, json.dumps(point, sort_keys=True)


def key(record: dict) -> tuple:
    """The key of a repetition, which no two valid rows share."""
    return *identity(record), record["repetition"], record["pass"]


def is_as_meant(record: dict) -> bool:
    """Is it the wrong picture of an exhibit of a fault?"""
    return record["status"] == "wrong picture" and (record.get("unranked") or "").startswith(EXHIBIT)


def failed(record: dict) -> bool:
    """Did something go wrong that should not?"""
    return record["status"] in BAD and not is_as_meant(record)


def killed_by_others(record: dict) -> bool:
    """Whether others killed the renderer of a row, or its measurer: --resume runs that repetition again."""
    status, reason = record.get("status"), record.get("reason") or ""
    return (status == "killed" and reason == BY_OTHERS) or (status == "failed" and reason.startswith(UNWATCHED))


def valid(records: list[dict]) -> list[dict]:
    """The rows without those that others killed and that were run again later. records: in the order of the file."""
    names = [(record.get("cell"), record.get("repetition"), record.get("pass")) for record in records]
    last = {name: number for number, name in enumerate(names)}
    return [
        record
        for number, (name, record) in enumerate(zip(names, records, strict=True))
        if last[name] == number or not killed_by_others(record)
    ]


def blank(cell: dict, number: int, kind: str, status: str, reason: str, started: str) -> dict:
    """A row without anything that was measured or judged. cell: its facts; kind: the pass; started: ISO time."""
    nothing = dict.fromkeys((*MEASURED, *JUDGED, *AROUND))
    row = {"repetition": number, "pass": kind, "status": status, "reason": reason, "started": started, "warnings": []}
    return {**cell, **nothing, **row}


def lost(cell: dict, number: int, kind: str, status: str, reason: str, started: str) -> dict:
    """The row of a repetition that no job ran. cell: its facts; kind: the pass; started: ISO time of its submission."""
    return {**blank(cell, number, kind, status, reason, started), "lost": True}


def largest(agreement: dict) -> float | None:
    """Returns the largest difference of a judged picture, inside the mask and outside; None if unknown."""
    sides = agreement.get("max_outside"), agreement.get("max_inside")
    return max((side for side in sides if side is not None), default=None)


def below(error: dict) -> float | None:
    """Returns what the RMSE of an `error` lies below (95 %) where its truth cannot tell it from 0, linear RGB.

    None where it can: the RMSE is more than the noise of the truth leaves uncertain in it, and more than the truth may
    lack.
    """
    if error.get("rmse") is None:
        return None
    noise, lacking = NORMAL * (error.get("rmse_standard_error") or 0.0), doubt(error)
    return error["rmse"] + noise + lacking if 0 < max(noise, lacking) >= error["rmse"] else None


def doubt(error: dict) -> float:
    """Returns what the truth of an `error` may lack, RMS, linear RGB: deeper rays, and what no sample has met."""
    return (error.get("change") or 0.0) + (error.get("unseen") or 0.0)


def rmse_of(error: dict) -> str:
    """Returns the RMSE of an `error` as text, "below" another number where its truth cannot tell it from 0."""
    most = below(error)
    return f"below {most:.2g}" if most else f"{error['rmse']:.3g}"


def errors(rmse: float | None, worst: float | None, beyond: float | None, most: float | None = None) -> str:
    """The errors over all pixels in words: RMSE, largest, share of pixels with a channel off by more than 1/255.

    most: of `below`. Of first hits, which have no RMSE: the largest error of a distance, and the share of rays that hit
    something else.
    """
    if most is not None:
        return f"RMSE below {most:.2g}, the truth's accuracy"
    if worst is None:
        return "error unavailable"
    if rmse is None:
        share = "how many hit something else is unavailable"
        if beyond is not None:
            share = f"{percentage(beyond)} of rays hit something else" if beyond else "no ray hits something else"
        return f"largest error of a distance {worst:.3g}, {share}"
    share = "share beyond 1/255 unavailable"
    if beyond is not None:
        share = f"{percentage(beyond)} of pixels beyond 1/255" if beyond else "no pixel beyond 1/255"
    return f"RMSE {rmse:.2g}, largest error {worst:.3g}, {share}"


def error_of(error: dict | None) -> str:
    """`error` of a record in words, with what it is held against where that is not the truth of the scene."""
    error = error or {"unavailable": "not judged"}
    if "unavailable" in error:
        return f"error unavailable: {error['unavailable']}"
    where = basis(error)
    return errors(error.get("rmse"), error.get("max"), error.get("bad_pixels"), below(error)) + (where and f", {where}")


def basis(error: dict) -> str:
    """What `error` of a record is held against, in words; "" for the truth of the scene (ERR-1), and for hits."""
    against = error.get("against")
    place = {"centres": "at the centres of pixels", "areas": "over the areas of pixels"}.get(against, "")
    if against is None:  # of a version before 0.2
        place = "against a picture with the same depth and places of samples"
    deep = f"at depth {error['depth']}" if error.get("depth") is not None and error.get("change") is None else ""
    return " ".join(filter(None, [place, deep]))


def agreement_of(agreement: dict | None) -> str:
    """`agreement` of a record in words: "agrees", or why not, and the share of the mask where it is more than 1 %."""
    agreement = agreement or {"unavailable": "not judged"}
    if "unavailable" in agreement:
        return f"agreement unavailable: {agreement['unavailable']}"
    share = agreement.get("mask_fraction") or 0.0
    mask = f" outside a mask of {percentage(share)} of the pixels" if share > MASK else ""
    return f"agreement ✗: {agreement['wrong']}" if agreement.get("wrong") else f"agreement ✓{mask}"
