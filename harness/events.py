"""What a renderer said: its JSON Lines, read with suspicion."""

import json
import math
from dataclasses import dataclass, field
from pathlib import Path

LIMIT = 64 * 2**20  # bytes of output that are read


@dataclass
class Said:
    """The events of one process. `faults` lists what did not keep to the contract."""

    phases: list[dict] = field(default_factory=list)
    frames: list[dict] = field(default_factory=list)
    rays: dict | None = None
    memory: dict | None = None
    versions: dict | None = None
    used: dict | None = None
    output: str | None = None
    error: str | None = None
    faults: list[str] = field(default_factory=list)


def read(path: Path) -> Said:
    """Read the lines in the file at `path`. Never raises for what is in them."""
    said = Said()
    with open(path, "rb") as file:
        text = file.read(LIMIT + 1)
    if len(text) > LIMIT:
        said.faults.append(f"printed more than {LIMIT} bytes")
        text = text[:LIMIT]
    for number, line in enumerate(text.decode("utf-8", errors="replace").splitlines(), 1):
        if not line.strip():
            continue
        try:
            event = json.loads(line)
            kind = event.pop("event")
            _take(said, kind, event)
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
            if len(said.faults) < 10:
                said.faults.append(f"line {number} of its output is no event of the contract: {line[:80]!r}")
    return said


def _take(said: Said, kind: str, event: dict) -> None:
    if kind in ("phase", "frame"):
        start, end = float(event["start"]), float(event["end"])
        if not (math.isfinite(start) and start <= end < math.inf):
            raise ValueError("stamps out of order")
        if kind == "phase":
            said.phases.append({"name": str(event["name"]), "start": start, "end": end})
        else:
            said.frames.append({"index": int(event["index"]), "start": start, "end": end})
    elif kind == "rays":
        said.rays = {
            name: _count(event[name]) for name in ("primary", "reflected", "transmitted", "shadow", "non_finite")
        }
    elif kind in ("memory", "versions", "used"):
        setattr(said, kind, dict(event))
    elif kind == "output":
        said.output = str(event["file"])
    elif kind == "error":
        said.error = str(event["reason"])
    else:
        raise ValueError("unknown event")


def _count(value) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise ValueError("not a count")
    return value


def tidy(said: Said, spawned: float, exited: float) -> None:
    """Find stamps that cannot be: outside the life of the process, frames outside `render`. Adds to `faults`."""
    slack = 1e-3
    for mark in (*said.phases, *said.frames):
        if mark["start"] < spawned - slack or mark["end"] > exited + slack:
            said.faults.append(f"a stamp lies outside the life of the process: {mark}")
            return
    render = [p for p in said.phases if p["name"] == "render"]
    for frame in said.frames:
        if render and not (render[0]["start"] - slack <= frame["start"] and frame["end"] <= render[-1]["end"] + slack):
            said.faults.append(f"frame {frame['index']} lies outside the phase render")
            return
