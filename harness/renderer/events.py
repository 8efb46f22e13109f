"""Reads the JSON Lines that a renderer prints, and rejects what cannot be true."""

import itertools
import json
import math
import re
from dataclasses import dataclass, field
from pathlib import Path

import orjson

from harness.errors import printable
from harness.renderer import places

LIMIT = 64 * 2**20  # bytes of output that are read
FAULTS = 10  # after so many, the rest is not read
WORDS = 500  # characters of a text that are kept
PARTS = 20  # of a frame
PHASES = 1000
TEXT = 2**16  # characters of what is kept as it was said
LEAST = 1e-9  # s: nothing renders a picture in less, however small
CLOCKS = 0.01  # by which the clock of a device may differ from the system's

DEVICE_COUNTS = ("multiprocessors", "memory_bytes", "shared_bytes_per_block", "registers_per_multiprocessor")
DEVICE_NUMBERS = ("clock_mhz", "peak_fp32_flops", "peak_fp64_flops")

# Of a build that counts floating-point operations; functions: powers, sines, logarithms.
OPERATIONS = "sums", "products", "divisions", "roots", "functions"
KERNEL_COUNTS = (
    *("registers", "shared_bytes", "local_bytes", "constant_bytes", "spill_store_bytes", "spill_load_bytes"),
    *("threads_per_block", "float64_instructions", "contracted"),
)
KERNEL_NUMBERS = ("occupancy", "compile_s", "assemble_s")


@dataclass
class Said:
    """The events of one process. `faults` lists what did not keep to the contract."""

    phases: list[dict] = field(default_factory=list)
    frames: list[dict] = field(default_factory=list)
    rays: dict | None = None
    operations: dict | None = None
    memory: dict | None = None
    versions: dict | None = None
    used: dict | None = None
    device: dict | None = None
    kernels: list[dict] = field(default_factory=list)
    output: str | None = None
    dropped: str | None = None
    error: str | None = None
    end: int | None = None  # status of a job of a list
    faults: list[str] = field(default_factory=list)

    @property
    def frames_s(self) -> list[float]:
        """Durations of the frames in order, s; divided by its renders, where a frame is a batch."""
        return [(frame["end"] - frame["start"]) / frame["renders"] for frame in self.frames]


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
            take(said, line, number)
            if len(said.faults) == FAULTS:
                break
    return said


def take(said: Said, line: bytes, number: int) -> None:
    """Add the event in line `number` of a renderer's output to `said`. Never raises for what is in it."""
    if not line.strip():
        return
    try:
        event = json.loads(line)
        kind = event.pop("event")
        _take(said, kind, event)
    except (ValueError, OverflowError, KeyError, TypeError, AttributeError, RecursionError):
        start = line[:80].decode("utf-8", errors="replace").rstrip()
        if len(said.faults) < FAULTS:
            said.faults.append(f"line {number} of its output is no event of the contract: {start!r}")


def words(value) -> str:
    """Text of a renderer on one line that can be printed and stored: not too long, no half characters."""
    text = " ".join(str(value).split())
    text = text if len(text) <= WORDS else text[:WORDS] + " ..."
    return printable(text.encode("utf-8", errors="replace").decode("utf-8"))


def _take(said: Said, kind: str, event: dict) -> None:
    if kind in ("phase", "frame"):
        start, end = float(event["start"]), float(event["end"])
        if not (start <= end and math.isfinite(end - start)):
            raise ValueError("stamps out of order")
        if kind == "phase":
            if len(said.phases) == PHASES:
                raise ValueError("too many phases")
            said.phases.append({"name": words(event["name"]), "start": start, "end": end})
        else:
            frame = {"index": _count(event["index"]), "start": start, "end": end}
            frame |= {"parts": _parts(event.get("parts")), "renders": _renders(event)}
            said.frames.append(frame | {"checksums": _checksums(event, frame["renders"])})
    elif kind == "rays":
        said.rays = {
            name: _count(event[name]) for name in ("primary", "reflected", "transmitted", "shadow", "non_finite")
        }
    elif kind == "operations":
        said.operations = {name: _count(event[name]) for name in OPERATIONS}
    elif kind == "memory":
        said.memory = {
            name: None if event.get(name) is None else _count(event[name])
            for name in ("peak_bytes", "render_peak_bytes", "peak_virtual_bytes")
        }
        said.memory["method"] = words(event.get("method") or "not told")
    elif kind == "device":
        said.device = _device(event)
    elif kind == "kernel":
        said.kernels.append(_kernel(event))
    elif kind in ("versions", "used"):
        if len(json.dumps(event, allow_nan=False)) > TEXT:  # ValueError: no JSON could hold it
            raise ValueError("too much")
        setattr(said, kind, _kept(event))
    elif kind == "output":
        said.output = words(event["file"])
        said.dropped = None if event.get("dropped") is None else words(event["dropped"])
    elif kind == "error":
        said.error = words(event["reason"])
    elif kind == "end":
        said.end = _count(event["status"])
    else:
        raise ValueError("unknown event")


def _kept(event: dict) -> dict:
    """Returns the renderer's own keys of an event, if a run with them can be read again (store.py): orjson takes no
    half characters and nothing nested too deep, and reports look into `methods`."""
    orjson.loads(json.dumps([[[[event]]]]))
    methods = event.get("methods") or {}
    if any(isinstance(value, list | dict) for value in methods.values()):
        raise ValueError("a method is no value")
    return event


def _count(value) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 2**63:
        raise ValueError("not a count")
    return value


def _number(value) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < math.inf:
        raise ValueError("not a number from 0")
    return float(value)


def _renders(event: dict) -> int:
    """How many renders of the picture a frame consists of."""
    renders = _count(event.get("renders", 1))
    if renders == 0:
        raise ValueError("a frame of nothing")
    return renders


def _checksums(event: dict, renders: int) -> str | None:
    """The checksums of a frame's pictures (FRM-2), one after the other; None of a renderer of contract 1."""
    checksums = event.get("checksums")
    if checksums is not None and not (
        re.fullmatch("[0-9a-f]*", checksums) and len(checksums) == places.DIGITS * renders
    ):
        raise ValueError("not the checksums of its renders")
    return checksums


def _parts(parts) -> dict | None:
    """Seconds of one render by the name of a part."""
    if parts is None:
        return None
    if len(parts) > PARTS:
        raise ValueError("too many parts")
    return {words(name): _number(seconds) for name, seconds in parts.items()}


def _device(event: dict) -> dict:
    """Reads what a renderer reports of its device; null for what it leaves out."""
    if not isinstance(event["simulated"], bool):
        raise ValueError("neither true nor false")
    major_minor = event.get("compute_capability")
    if major_minor is not None:
        major_minor = [_count(number) for number in major_minor]
        if len(major_minor) != 2:
            raise ValueError("not a compute capability")
    device = {"name": words(event["name"]), "simulated": event["simulated"], "compute_capability": major_minor}
    for names, kind in ((DEVICE_COUNTS, _count), (DEVICE_NUMBERS, _number), (("driver", "type"), words)):
        device |= {name: None if event.get(name) is None else kind(event[name]) for name in names}
    return device


def _kernel(event: dict) -> dict:
    """Reads the resources that a compiled kernel takes of a GPU."""
    kernel = {name: words(event[name]) for name in ("name", "target")}
    kernel |= {name: _count(event[name]) for name in KERNEL_COUNTS}
    return kernel | {name: None if event.get(name) is None else _number(event[name]) for name in KERNEL_NUMBERS}


def tidy(said: Said, spawned: float, exited: float) -> None:
    """Find stamps that cannot be: outside the life of the process, out of order, frames outside `render` or too short
    to be any, parts of a frame that are longer than it.

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
    for frame in said.frames:
        if (frame["end"] - frame["start"]) / frame["renders"] < LEAST:
            said.faults.append(f"frame {frame['index']} is too short for {frame['renders']} renders: {frame}")
            return
        parts = sum((frame["parts"] or {}).values()) * frame["renders"]
        if parts > (frame["end"] - frame["start"]) * (1 + CLOCKS) + slack:
            said.faults.append(f"the parts of frame {frame['index']} are longer than it: {frame}")
            return
