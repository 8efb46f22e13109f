"""What a renderer said: its JSON Lines, read with suspicion."""

import itertools
import json
import math
from dataclasses import dataclass, field
from pathlib import Path

LIMIT = 64 * 2**20  # bytes of output that are read
FAULTS = 10  # after so many, the rest is not read
WORDS = 500  # characters of a text that are kept


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
        for number in itertools.count(1):
            line = file.readline(LIMIT + 1)
            if file.tell() > LIMIT:
                said.faults.append(f"printed more than {LIMIT} bytes")
                break
            if not line:
                break
            if not line.strip():
                continue
            try:
                event = json.loads(line)
                kind = event.pop("event")
                _take(said, kind, event)
            except (ValueError, OverflowError, KeyError, TypeError, AttributeError, RecursionError):
                start = line[:80].decode("utf-8", errors="replace").rstrip()
                said.faults.append(f"line {number} of its output is no event of the contract: {start!r}")
                if len(said.faults) == FAULTS:
                    break
    return said


def words(value) -> str:
    """Text of a renderer on one line that can be printed and stored: not too long, no half characters."""
    text = " ".join(str(value).split())
    text = text if len(text) <= WORDS else text[:WORDS] + " ..."
    return text.encode("utf-8", errors="replace").decode("utf-8")


def _take(said: Said, kind: str, event: dict) -> None:
    if kind in ("phase", "frame"):
        start, end = float(event["start"]), float(event["end"])
        if not (math.isfinite(start) and start <= end < math.inf):
            raise ValueError("stamps out of order")
        if kind == "phase":
            said.phases.append({"name": words(event["name"]), "start": start, "end": end})
        else:
            said.frames.append({"index": _count(event["index"]), "start": start, "end": end})
    elif kind == "rays":
        said.rays = {
            name: _count(event[name]) for name in ("primary", "reflected", "transmitted", "shadow", "non_finite")
        }
    elif kind == "memory":
        said.memory = {
            name: None if event.get(name) is None else _count(event[name])
            for name in ("peak_bytes", "render_peak_bytes", "peak_virtual_bytes")
        }
        said.memory["method"] = words(event.get("method") or "not told")
    elif kind in ("versions", "used"):
        json.dumps(event, allow_nan=False)  # ValueError: no JSON could hold it
        setattr(said, kind, event)
    elif kind == "output":
        said.output = words(event["file"])
    elif kind == "error":
        said.error = words(event["reason"])
    else:
        raise ValueError("unknown event")


def _count(value) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 2**63:
        raise ValueError("not a count")
    return value


def tidy(said: Said, spawned: float, exited: float) -> None:
    """Find stamps that cannot be: outside the life of the process, out of order, frames outside `render`.

    Adds to `faults`.
    """
    slack = 1e-3
    for mark in (*said.phases, *said.frames):
        if mark["start"] < spawned - slack or mark["end"] > exited + slack:
            said.faults.append(f"a stamp lies outside the life of the process: {mark}")
            return
    for before, after in (*itertools.pairwise(said.phases), *itertools.pairwise(said.frames)):
        if after["start"] < before["end"] - slack:
            said.faults.append(f"a stamp lies before the end of the one that was said first: {before}, {after}")
            return
    render = [p for p in said.phases if p["name"] == "render"]
    for frame in said.frames:
        if render and not (render[0]["start"] - slack <= frame["start"] and frame["end"] <= render[-1]["end"] + slack):
            said.faults.append(f"frame {frame['index']} lies outside the phase render")
            return
