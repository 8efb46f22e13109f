"""Counts the floating-point operations of a frame, by a build of the renderer whose numbers count them.

They are those of the source, one ray after another on one thread: what a vector, a compiler or a clever search leaves
out is not taken off, so programs of different speed are held to the same work.
"""

import dataclasses
from pathlib import Path

from harness.plan.plan import Cell
from harness.race.host import Host
from harness.renderer.registry import Entry, Renderer


def count(cell: Cell, arrays: dict, host: Host, cache: Path) -> dict | None:
    """Returns the counts of events.OPERATIONS, {unavailable: reason}, or None for a renderer without such a build."""
    told = cell.entry.renderer.manifest
    if cell.refused or not told.operations or not told.build:
        return None
    build = told.build.model_copy(update={"command": (*told.build.command, *told.operations.options)})
    renderer = Renderer(cell.entry.renderer.folder, told.model_copy(update={"build": build}))
    entry = Entry(renderer, cell.entry.variant, cell.entry.label)
    one = dataclasses.replace(cell.parameters, threads=1, vector="off", frames=0, least_frame=0.0)
    result = host.run(entry, arrays, one, cell.needs, timeout=cell.timeout, limits=cell.limits, cache=cache)
    if result.status != "ok":
        return {"unavailable": f"{result.status}: {result.reason}"}
    return result.said.operations or {"unavailable": "the build that counts reported no operations"}
