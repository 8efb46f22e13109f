"""What is written down of one repetition (store.py): who ran, what it said, and what was measured."""

from pathlib import Path

from harness import events, repetition
from harness.plan import Cell
from harness.registry import Entry

BAD = ("failed", "timeout", "killed", "wrong picture")
CPU_TOLERANCE = 0.10  # between wait4 and the measurer's series
PHASE_TOLERANCE = 0.02  # of the wall time that no phase covers

EXHIBIT = "exhibit: "
SIMULATED = "ran in the CUDA simulator: its times say nothing about a GPU"


def facts(cell: Cell) -> dict:
    """Who does what."""
    entry = cell.entry
    return {
        "cell": cell.key,
        "variant": entry.name,
        "renderer": entry.renderer.manifest.name,
        "renderer_version": entry.renderer.version,
        "technology": entry.renderer.manifest.technology,
        "scene": cell.scene,
        "scene_version": cell.scene_version,
        "point": cell.point,
        "parameters": cell.parameters.values(),
        "needs": list(cell.needs),
    }


def unranked(entry: Entry, said: events.Said) -> str | None:
    """None, or why the row takes no part in any comparison."""
    if entry.variant.exhibit:
        return EXHIBIT + entry.variant.exhibit
    return SIMULATED if simulated(entry, said) else None


def simulated(entry: Entry, said: events.Said) -> bool:
    return entry.simulated or bool((said.device or {}).get("simulated"))


def is_as_meant(record: dict) -> bool:
    """Is it an exhibit's picture that is wrong, as it was made to be?"""
    return record["status"] == "wrong picture" and (record["unranked"] or "").startswith(EXHIBIT)


def failed(record: dict) -> bool:
    """Did something go wrong that should not?"""
    return record["status"] in BAD and not is_as_meant(record)


def measured(result: repetition.Result, series: Path) -> dict:
    """The measured part of a record."""
    outcome, said = result.outcome, result.said
    empty = (
        *("wall_s", "phases", "frames_s", "frame_parts", "cpu", "memory", "rays"),
        *("used", "versions", "device", "measurer", "series"),
    )
    record = {**dict.fromkeys(empty), "warnings": [] if result.status != "ok" else list(said.faults)}
    if outcome is None or outcome.failed:
        return record
    phases = cover(said, outcome.spawned, outcome.exited)
    record |= {
        "wall_s": outcome.wall_s,
        "phases": phases,
        "frames_s": [frame["end"] - frame["start"] for frame in said.frames],
        "frame_parts": [frame["parts"] for frame in said.frames],
        "cpu": {"user_s": outcome.user_s, "system_s": outcome.system_s, "series_s": last_cpu(series)},
        "memory": memory(said, outcome),
        "rays": said.rays,
        "used": said.used,
        "versions": said.versions,
        "device": said.device,
        "measurer": outcome.measurer,
        "series": f"series/{series.name}" if series.exists() else None,
    }
    missing = 1 - sum(end - start for _, start, end in phases) / outcome.wall_s
    if result.status == "ok" and abs(missing) > PHASE_TOLERANCE:
        record["warnings"].append(f"its phases leave {missing:.1%} of the wall time uncovered")
    doubt = cpu_doubt(record["cpu"], outcome)
    if doubt:
        record["warnings"].append(doubt)
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


def last_cpu(series: Path) -> float | None:
    """CPU time (s) in the last whole row of a series; None if it has none."""
    try:
        whole, _, _ = series.read_text(encoding="utf-8").rpartition("\n")
    except OSError:
        return None
    rows = whole.splitlines()[1:]
    return float(rows[-1].split(",")[1]) if rows else None


def cpu_doubt(cpu: dict, outcome) -> str | None:
    """How wait4 and the series differ by more than the last, unseen tick explains."""
    if cpu["series_s"] is None or outcome.measurer is None:
        return None
    total = cpu["user_s"] + cpu["system_s"]
    unseen = outcome.measurer["interval_s"] * 2 * max(1, total / outcome.wall_s)
    if abs(total - cpu["series_s"]) > max(CPU_TOLERANCE * total, unseen):
        return f"CPU time: wait4 says {total:.3g} s, the measurer saw {cpu['series_s']:.3g} s"
    return None


def memory(said: events.Said, outcome) -> dict:
    """The renderer's own peak where it tells it, else wait4's, which cannot be below the launcher's floor."""
    own = said.memory or {}
    if own.get("peak_bytes"):
        names = ("peak_bytes", "render_peak_bytes", "peak_virtual_bytes", "method")
        return {
            **{name: own.get(name) for name in names},
            "floor_bytes": None,
            "wait4_peak_bytes": outcome.wait4_peak_bytes,
        }
    return {
        "peak_bytes": outcome.wait4_peak_bytes,
        "render_peak_bytes": None,
        "peak_virtual_bytes": None,
        "method": "wait4",
        "floor_bytes": outcome.wait4_floor_bytes,
        "wait4_peak_bytes": outcome.wait4_peak_bytes,
    }
