"""The load pass: runs a GPU cell once more, with frames enough to see utilisation, power and energy.

It comes after every timed repetition of the run, and none of its times is used: seconds of full load heat a device,
and a hot device lowers its clocks.
"""

import dataclasses
import math
import statistics

from harness.plan.plan import Cell, Plan
from harness.race.row import is_processor
from harness.statistics import steady
from harness.system.nvml import AVAILABLE

MOST_FRAMES = 10**5  # each is a line of output


def cells(plan: Plan, records: list[dict], seconds: float) -> list[Cell]:
    """The cells whose good timed repetitions rendered for less than `seconds`, with the frames that fill it.

    None where `seconds` is 0 or NVML was not there, of exhibits, and of what ran in the simulator.
    """
    longer = []
    for cell in plan.cells:
        rows = (row for row in records if row["cell"] == cell.key and row.get("pass") != "count")
        good = [row for row in rows if row["status"] == "ok"]
        if good and _wanted(cell, good[0]) and statistics.median(map(_render_s, good)) < seconds:
            longer.append(_longer(cell, good, seconds))
    return longer


def _wanted(cell: Cell, row: dict) -> bool:
    if cell.entry.variant.device == "cpu" or is_processor(row.get("device")) or row["unranked"]:
        return False
    return row["measurer"] is not None and AVAILABLE in row["measurer"]["gpu"].values()


def _render_s(row: dict) -> float:
    return sum(end - start for name, start, end in row["phases"] if name == "render")


def _batch(row: dict) -> float:
    """About how long a frame takes (s), the whole batch where it is one."""
    renders = row.get("frame_renders") or [1] * len(row["frames_s"])
    return steady.rough([seconds * count for seconds, count in zip(row["frames_s"], renders, strict=True)])


def _longer(cell: Cell, good: list[dict], seconds: float) -> Cell:
    frame = statistics.median(map(_batch, good))
    frames = math.ceil(min(MOST_FRAMES, seconds / frame)) if frame else MOST_FRAMES
    return dataclasses.replace(
        cell,
        parameters=dataclasses.replace(cell.parameters, frames=frames),
        timeout=cell.timeout + 2 * seconds,
    )
