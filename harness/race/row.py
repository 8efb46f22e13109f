"""The measured part of a row: times, CPU, memory, warnings, and whether the row may be ranked."""

from pathlib import Path

import psutil

from harness.process import repetition
from harness.race.series import ticks
from harness.renderer import events
from harness.renderer.limits import amount
from harness.renderer.registry import Entry
from harness.statistics import steady
from harness.store.record import EXHIBIT, MEASURED, percentage

CPU_TOLERANCE = 0.10  # between wait4 and the measurer's series
CPU_RESOLUTION = 0.02  # s, of the series, where its measurer does not tell
SAME_MARK = 10**6  # bytes: two readings of one high-water mark, of which the later sees the exit too, differ by less
AT_MOST = "wait4 (at most)"  # the peak is below what wait4 can tell; at_least_bytes is the other bound
PHASE_TOLERANCE = 0.02  # of the wall time that no phase covers

OF_COST = "exhibit of a cost: "  # its picture must be right
STRESSED = EXHIBIT + "put under stress, to see where it breaks"
SIMULATED = "ran in the CUDA simulator: its times say nothing about a GPU"


def unranked(entry: Entry, said: events.Said) -> str | None:
    """None, or why the row takes no part in any comparison, whatever its times are (contradiction.py)."""
    if entry.variant.exhibit:
        return (OF_COST if entry.variant.exhibit_of == "cost" else EXHIBIT) + entry.variant.exhibit
    return SIMULATED if simulated(entry, said) else None


def simulated(entry: Entry, said: events.Said) -> bool:
    return entry.simulated or bool((said.device or {}).get("simulated"))


def is_processor(device: dict | None) -> bool:
    """Is the device that a renderer reported a processor (OpenCL's may be)?"""
    return (device or {}).get("type") == "cpu"


def measured(result: repetition.Result, series: Path) -> dict:
    """The measured part of a record."""
    outcome, said = result.outcome, result.said
    record = {**dict.fromkeys(MEASURED), "warnings": [] if result.status != "ok" else list(said.faults)}
    if outcome is None or outcome.failed:
        return record
    phases = cover(said, outcome.spawned, outcome.exited)
    record |= {
        "wall_s": outcome.wall_s,
        "phases": phases,
        "frames_s": said.frames_s,
        "frame_renders": [frame["renders"] for frame in said.frames],
        "frame_parts": [frame["parts"] for frame in said.frames],
        "cpu": _cpu(outcome, said, series) if outcome.alone else None,
        "memory": memory(said, outcome) if outcome.alone else None,
        "rays": said.rays,
        "used": said.used,
        "versions": said.versions,
        "device": said.device,
        "measurer": outcome.measurer,
        "series": f"series/{series.name}" if series.exists() else None,
    }
    if outcome.measurer:
        used = outcome.user_s + outcome.system_s
        record["measurer"] = {**outcome.measurer, "integral_s": record["cpu"]["series_s"], "wait4_s": used}
    missing = 1 - sum(end - start for _, start, end in phases) / outcome.wall_s
    if result.status == "ok" and outcome.alone and abs(missing) > PHASE_TOLERANCE:
        record["warnings"].append(f"its phases leave {percentage(missing)} of the wall time uncovered")
    if record["series"] and outcome.measurer is None:
        record["warnings"].append("its measurer gave no account of itself: the series may not be whole")
    if outcome.alone:
        record["warnings"] += filter(None, [cpu_doubt(record["cpu"], outcome), memory_doubt(said, outcome)])
    return record


def cover(said: events.Said, spawned: float, exited: float) -> list[list]:
    """Phases as [name, start, end] since `spawned`, with `start` before the first and `exit` after the last.

    What lies between phases is left uncovered: the renderer must account for it.
    """
    marks = [[p["name"], p["start"] - spawned, p["end"] - spawned] for p in said.phases]
    wall = exited - spawned
    if not marks:
        return [["start", 0.0, wall]]
    return [["start", 0.0, marks[0][1]], *marks, ["exit", marks[-1][2], wall]]


def _cpu(outcome, said: events.Said, series: Path) -> dict:
    return {**cpu(outcome, series), "frame_s": frame_cpu(said, outcome.spawned, series)}


def cpu(outcome, series: Path) -> dict:
    """CPU seconds of a process and its descendants, what the series says, and the part of the orphans."""
    unknown = {"unavailable": "the system gives orphans to another process"} if outcome.orphans is None else None
    return {
        "user_s": outcome.user_s,
        "system_s": outcome.system_s,
        "series_s": last_cpu(series),
        "orphans": unknown or outcome.orphans,
        "orphans_s": unknown or outcome.orphans_s,
    }


def last_cpu(series: Path) -> float | None:
    """CPU time (s) in the last whole row of a series; None if it has none."""
    rows = ticks(series)
    return float(rows[-1]["cpu_s"]) if rows else None


def frame_cpu(said: events.Said, spawned: float, series: Path) -> float | None:
    """CPU time (s) of one render of the steady frames, between the first and the last reading of a series within them;
    None if it has no two.

    A program that is interrupted uses no CPU time meanwhile. A render that is going on at a reading counts as the part
    of its wall time that is over.
    """
    frames = said.frames[steady.find(said.frames_s).start :]
    if not frames:
        return None
    times = [(spawned + float(reading["t"]), float(reading["cpu_s"])) for reading in ticks(series)]
    inside = [(at, used) for at, used in times if frames[0]["start"] <= at <= frames[-1]["end"]]
    if len(inside) < 2:
        return None
    (begun, before), (ended, after) = inside[0], inside[-1]
    renders = _renders(frames, ended) - _renders(frames, begun)
    return (after - before) / renders if renders else None


def _renders(frames: list[dict], at: float) -> float:
    """How many renders of some frames are done at a time, on the clock of theirs."""
    shares = (min(1.0, max(0.0, (at - frame["start"]) / (frame["end"] - frame["start"]))) for frame in frames)
    return sum(frame["renders"] * share for frame, share in zip(frames, shares, strict=True))


def cpu_doubt(cpu: dict, outcome) -> str | None:
    """How wait4 and the series, which both know the end, differ by more than its resolution explains."""
    if cpu["series_s"] is None or outcome.measurer is None:
        return None
    total = cpu["user_s"] + cpu["system_s"]
    resolution = outcome.measurer.get("resolution_s") or CPU_RESOLUTION
    if abs(total - cpu["series_s"]) > max(CPU_TOLERANCE * total, resolution):
        return f"CPU time: wait4 says {total:.3g} s, the measurer saw {cpu['series_s']:.3g} s"
    return None


def memory_doubt(said: events.Said, outcome) -> str | None:
    """None, or why the peak that a renderer tells cannot be: none of its processes had so much, or no machine has."""
    own = said.memory or {}
    peak = max(own.get("peak_bytes") or 0, own.get("render_peak_bytes") or 0)
    most = outcome.wait4_peak_bytes or psutil.virtual_memory().total
    if peak <= most + SAME_MARK:
        return None
    return f"it tells a peak memory of {amount(peak)}, which is none: the largest of its processes had {amount(most)}"


def memory(said: events.Said, outcome) -> dict:
    """The peak of a process and its descendants, by the method that knows the most of it; sizes in bytes.

    What the renderer tells of itself, if that can be; wait4's, of the largest single process, which cannot be below the
    launcher's floor; PSS, the largest sum over a family that the measurer saw at a tick, with its files in memory.
    """
    own, audit = {} if memory_doubt(said, outcome) else said.memory or {}, outcome.measurer or {}
    wait4, floor, pss = outcome.wait4_peak_bytes, outcome.wait4_floor_bytes, audit.get("pss_peak_bytes")
    sampled = "PSS, with files in memory" if audit.get("files_peak_bytes") else "PSS"
    ways = [(own.get("peak_bytes"), SAME_MARK, own.get("method")), (pss, 0, sampled)]
    if wait4 > floor + SAME_MARK:
        ways.append((wait4, 0, "wait4"))
    elif not own.get("peak_bytes"):
        ways.append((wait4, 0, AT_MOST))
    peak, _, method = max((way for way in ways if way[0]), key=lambda way: way[0] + way[1])
    seen = max(audit.get("mark_bytes") or 0, pss or 0)
    return {
        "peak_bytes": peak,
        "render_peak_bytes": own.get("render_peak_bytes"),
        "peak_virtual_bytes": max(own.get("peak_virtual_bytes") or 0, audit.get("vms_peak_bytes") or 0) or None,
        "method": method,
        "at_least_bytes": seen if seen and method == AT_MOST else None,
        "floor_bytes": floor if method in ("wait4", AT_MOST) else None,
        "wait4_peak_bytes": wait4,
    }
