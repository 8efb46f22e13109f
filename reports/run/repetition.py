"""Flattens the record of a repetition to one row; times of frames become the median over its steady frames."""

from statistics import median

from harness.statistics import statistics, steady
from harness.store import record as rows

MEMORY = "peak_bytes", "render_peak_bytes", "peak_virtual_bytes", "floor_bytes"
AGREEMENT = "reference", "max_outside", "max_inside", "rmse", "relative_mse", "bad_pixels", "mask_fraction", "tolerance"
LARGEST = "largest_error"  # of all pixels, inside the mask and outside
ERRORS = "rmse", LARGEST, "bad_pixels"  # of all pixels
SEEN = "psnr_db", "ssim", "flip"  # harness/picture/perception.py; no_ssim, say, is the reason why ssim is missing
NOT_SEEN = tuple(f"no_{name}" for name in SEEN)
# The columns of `error`, the distance from the truth, by the name in the record.
ERROR = {
    "rmse": "error_rmse", "max": "error_max", "bad_pixels": "error_bad_pixels", "flip": "error_flip",
    "max_outside": "error_max_outside", "standard_error": "standard_error", "pictures": "truth_pictures",
}  # fmt: skip
BOUND = {"max": "bound_max", "mean": "bound_mean"}  # of the error of a cut-off
GPU = "upload_s", "kernel_s", "download_s", "end_to_end_s"
FRAMES = "steady_state", "steady_note", "steady_frames", "warmup_frames", "outlier_frames"
# The columns of the measurer's audit of itself, by the name in the record.
AUDITED = {
    "interval_p50_s": "tick_p50_s", "interval_p99_s": "tick_p99_s", "ticks": "ticks", "missed": "missed_ticks",
    "cpu_s": "measurer_cpu_s",
}  # fmt: skip
AUDIT = "measured_cpu_s", "cpu_off", *AUDITED.values()
DISTURBED = "steal_s", "other_cpu_s", "waited_s", "swapped_pages", "held_back_s", "throttled"  # system/trouble.py
# Known only of processes in a steady state.
OF_STEADY = "steady_s", "rays_per_s", "search_s", "kernel_s", "download_s", "end_to_end_s"
COLUMNS = (
    "host", "cell", "scene", "point", "variant", "technology", "repetition", "pass", "status", "reason", "unranked",
    "wall_s", "first_s", "steady_s", *FRAMES, "compile_s", "compile_cache", "build_s", "user_s", "system_s", "cpu_s",
    "rays", "rays_per_s", "search_s", *GPU, *MEMORY, "memory_method", *AGREEMENT, LARGEST, *SEEN, *NOT_SEEN,
    "not_judged", *ERROR.values(), "no_error", "no_error_flip", *BOUND.values(), *AUDIT, *DISTURBED, "warnings",
)  # fmt: skip
CPU_DOUBT = "CPU time:"  # begins the warning of a row whose measured CPU time is off by too much (harness/race/row.py)


def row(record: dict) -> dict:
    """Returns a record as a row without its swept point; pandas makes missing values NaN.

    Of a process without a steady state all later frames count, and the cell decides whether to use them.
    warmup_frames: before the steady state, frame 0 included. outlier_frames: among the steady ones.
    measured_cpu_s: from the measurer's series; cpu_off: it differs from wait4's by too much.
    """
    frames = record["frames_s"] or []
    found = steady.find(frames)
    kept = frames[found.start :]
    steady_s = median(kept) if kept else None
    rays = record["rays"] and sum(record["rays"][kind] for kind in ("primary", "reflected", "transmitted", "shadow"))
    compile_s, upload_s = (_phase(record, name) for name in ("compile", "upload"))
    methods = (record["used"] or {}).get("methods") or {}
    cpu, memory, agreement = record["cpu"] or {}, record["memory"] or {}, record["agreement"] or {}
    audit = record["measurer"] or {}
    error, bound = record.get("error") or {}, record.get("bound") or {}  # which runs of older versions lack
    return {
        **{name: record[name] for name in ("cell", "scene", "variant", "technology", "repetition", "status", "reason")},
        "host": record.get("host"),
        "pass": record.get("pass") or "timed",
        "unranked": record.get("unranked"),
        "wall_s": record["wall_s"],
        **{name: cpu.get(name) for name in ("user_s", "system_s")},
        "cpu_s": cpu["user_s"] + cpu["system_s"] if cpu else None,
        **{name: memory.get(name) for name in MEMORY},
        **{name: agreement.get(name) for name in AGREEMENT},
        LARGEST: rows.largest(agreement),
        **_known(agreement, SEEN),
        **{f"no_{name}": _reason(agreement.get(name)) for name in SEEN},
        **{column: _number(error.get(name)) for name, column in ERROR.items()},
        "no_error": error.get("unavailable"),
        "no_error_flip": _reason(error.get("flip")),
        **{column: bound.get(name) for name, column in BOUND.items()},
        "memory_method": memory.get("method"),
        "first_s": frames[0] if frames else None,
        "steady_s": steady_s,
        "steady_state": found.state if frames else None,
        "steady_note": found.note or None,
        "steady_frames": len(kept),
        "warmup_frames": found.warm_up,
        "outlier_frames": sum(statistics.outliers(kept)) if kept else None,
        "compile_s": compile_s,
        "compile_cache": methods.get("compile_cache"),
        "build_s": (record["build"] or {}).get("seconds"),
        "rays": rays,
        "rays_per_s": rays / steady_s if rays and steady_s else None,
        "search_s": _part(record, "search", found.start),
        "upload_s": upload_s,
        "kernel_s": _part(record, "kernel", found.start),
        "download_s": _part(record, "download", found.start),
        "end_to_end_s": None if upload_s is None or steady_s is None else upload_s + steady_s,
        "not_judged": _not_judged(record),
        **{column: audit.get(name) for name, column in AUDITED.items()},
        "measured_cpu_s": cpu.get("series_s"),
        "cpu_off": any(text.startswith(CPU_DOUBT) for text in record["warnings"]),
        **_known(record.get("disturbed") or {}, DISTURBED),
        "warnings": "; ".join(record["warnings"]),
    }


def _phase(record: dict, phase: str) -> float | None:
    """Returns the time of a phase, s; None if the record has none of that name."""
    found = [end - start for name, start, end in record["phases"] or [] if name == phase]
    return sum(found) if found else None


def _part(record: dict, name: str, start: int) -> float | None:
    """Returns the median time of a part of the frames from `start` on, s; None if one of them lacks it."""
    parts = [(part or {}).get(name) for part in (record.get("frame_parts") or [])[start:]]
    return None if not parts or None in parts else median(parts)


def _known(table: dict, names: tuple[str, ...]) -> dict:
    """Returns values of a table whose unknown ones are {"unavailable": reason}."""
    return {name: _number(table.get(name)) for name in names}


def _number(value):
    return None if isinstance(value, dict) else value


def _reason(value) -> str | None:
    return value["unavailable"] if isinstance(value, dict) else None


def _not_judged(record: dict) -> str | None:
    """Returns why the judge gave no verdict on a picture; None if it gave one, or if there is no picture."""
    if record["agreement"] is None:
        return "the judge was not asked" if record["status"] == "ok" else None
    return record["agreement"].get("unavailable")
