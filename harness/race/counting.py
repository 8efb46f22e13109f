"""The pass "count": counts the instructions of a steady frame of each cell, after every timed repetition of a run.

Three jobs with ever more frames are counted whole. What one takes more than the one before is due to its frames alone:
start-up, compiling and the first two frames, which all of them have, cancel out.
"""

import dataclasses
import itertools
import math
import platform
from pathlib import Path

from harness.plan.plan import Cell
from harness.process.repetition import Result
from harness.process.scratch import scratch
from harness.race.host import Host
from harness.renderer.parameters import Parameters
from harness.renderer.registry import Entry, Renderer
from harness.statistics.steady import rough
from harness.system import counters
from harness.system.counters import Tool

JOBS = 3
LEAST, MOST = 0.02, 200  # s that the frames between two jobs take at least when nothing is counted; so many at most
SIDE = 64  # pixels of a picture in Valgrind, at most
SAME = "PYTHONHASHSEED=0"  # else sets and tables of Python take other steps in each process
KINDS = "primary", "reflected", "transmitted", "shadow"


def count(cell: Cell, arrays: dict, host: Host, cache: Path) -> tuple[str, str, dict | None]:
    """Returns status, reason and `counts` of a row (store.py). cache: a folder for the code that is compiled for it.

    Absent counts are "unavailable", whatever went wrong: the timed repetitions tell of the renderer.
    """
    if cell.refused:
        return "unavailable" if cell.entry.unavailable else "unsupported", cell.refused, None
    if cell.entry.variant.device != "cpu":
        return "unavailable", "it runs on another device, whose instructions are not counted", None
    tool = counters.find()
    if not isinstance(tool, Tool):
        return "unavailable", tool, None
    parameters = dataclasses.replace(cell.parameters, least_frame=0.0)
    parameters = smaller(parameters) if tool.slow else parameters
    options, environment = special(cell.entry) if tool.slow else ((), {})

    def run(frames: int, words: list[str]) -> Result:
        entry = under(cell.entry, options, environment, words)
        job = dataclasses.replace(parameters, frames=frames)
        return host.run(entry, arrays, job, cell.needs, timeout=cell.timeout, limits=cell.limits, cache=cache)

    plain = run(1, [])  # compiles what later jobs find in the cache, and tells how long a frame takes
    if plain.status != "ok":
        return "unavailable", f"before it was counted: {plain.status}: {plain.reason}", None
    step = math.ceil(min(MOST, LEAST / max(rough(plain.said.frames_s), LEAST / MOST)))
    jobs = []
    for number in range(JOBS):
        with scratch() as here:
            result = run(1 + number * step, tool.words(here))
            if result.status != "ok":
                return "unavailable", f"in {tool.name}: {result.status}: {result.reason}", None
            read = tool.read(here)
        if isinstance(read, str):
            return "unavailable", read, None
        jobs.append(read)
    counted = steady(jobs, step)
    if counted["instructions"] <= 0:
        return "unavailable", "a job with more frames took fewer instructions: it does other work beside them", None
    x0, y0, x1, y1 = parameters.bounds()
    rays = result.said.rays
    traced = len(arrays["rays"]) if parameters.kind == "rays" else rays and sum(rays[kind] for kind in KINDS)
    return "ok", "", {
        "tool": tool.name, "version": tool.version, "width": x1 - x0, "height": y1 - y0, "rays": traced,
        "smaller": None if parameters.bounds() == cell.parameters.bounds() else "Valgrind is slow",
        "options": list(options), "environment": environment, **counted,
    }  # fmt: skip


def steady(jobs: list[dict[str, int]], step: int) -> dict:
    """Returns the counts of one frame, from those of whole jobs with `step` frames more each, and their spread.

    spread: by what share the instructions between two jobs differ at most; None where they are not positive.
    """
    frames = (len(jobs) - 1) * step
    counts = {name: (jobs[-1][name] - jobs[0][name]) / frames for name in jobs[0] if all(name in job for job in jobs)}
    steps = [after["instructions"] - before["instructions"] for before, after in itertools.pairwise(jobs)]
    return {**counts, "spread": max(steps) / min(steps) - 1 if min(steps) > 0 else None}


def smaller(parameters: Parameters) -> Parameters:
    """The same view with at most SIDE x SIDE pixels in the picture or its region; rays as they are."""
    x0, y0, x1, y1 = parameters.bounds()
    most = max(x1 - x0, y1 - y0)
    if parameters.kind == "rays" or most <= SIDE:
        return parameters
    width, height = (max(1, size * SIDE // most) for size in (parameters.width, parameters.height))
    region = parameters.region
    if region:
        left, top = (min(edge * SIDE // most, size - 1) for edge, size in ((x0, width), (y0, height)))
        wide, high = (max(1, length * SIDE // most) for length in (x1 - x0, y1 - y0))
        region = left, top, min(left + wide, width), min(top + high, height)
    return dataclasses.replace(parameters, width=width, height=height, region=region)


def special(entry: Entry) -> tuple[tuple[str, ...], dict[str, str]]:
    """The words for a build, and the environment, with which a renderer uses nothing that Valgrind does not know."""
    settings = entry.renderer.manifest.count.get(platform.machine())
    return (settings.options, dict(settings.environment)) if settings else ((), {})


def under(entry: Entry, options: tuple[str, ...], environment: dict[str, str], words: list[str]) -> Entry:
    """`entry` built with more options, in an environment, and with words before its command; its frames have no
    checksums, which are no part of a frame."""
    manifest, variant = entry.renderer.manifest, entry.variant
    set_to = [SAME, *(f"{name}={value}" for name, value in environment.items())]
    started = variant.model_copy(update={"command": ("env", *set_to, *words, *variant.command), "contract": 1})
    if options and manifest.build:
        build = manifest.build.model_copy(update={"command": (*manifest.build.command, *options)})
        manifest = manifest.model_copy(update={"build": build})
    return Entry(Renderer(entry.renderer.folder, manifest), started, entry.label)


def operations(cell: Cell, arrays: dict, host: Host, cache: Path) -> dict | None:
    """Counts the floating-point operations of a frame, by a build of the renderer whose numbers count them.

    Returns the counts of events.OPERATIONS, {unavailable: reason}, or None for a renderer without such a build. They
    are those of the source, one ray after another on one thread: what a vector, a compiler or a clever search leaves
    out is not taken off, so programs of different speed are held to the same work.
    """
    manifest = cell.entry.renderer.manifest
    if cell.refused or not manifest.operations or not manifest.build:
        return None
    build = manifest.build.model_copy(update={"command": (*manifest.build.command, *manifest.operations.options)})
    renderer = Renderer(cell.entry.renderer.folder, manifest.model_copy(update={"build": build}))
    entry = Entry(renderer, cell.entry.variant, cell.entry.label)
    parameters = dataclasses.replace(cell.parameters, threads=1, vector="off", frames=0, least_frame=0.0)
    result = host.run(entry, arrays, parameters, cell.needs, timeout=cell.timeout, limits=cell.limits, cache=cache)
    if result.status != "ok":
        return {"unavailable": f"{result.status}: {result.reason}"}
    return result.said.operations or {"unavailable": "the build that counts reported no operations"}
