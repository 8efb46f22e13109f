"""Flattens the record of a repetition to one row; times of frames become the median over its steady frames."""

from statistics import fmean as mean
from statistics import median

from harness.statistics import statistics, steady
from harness.store import record as rows

MEMORY = "peak_bytes", "render_peak_bytes", "peak_virtual_bytes", "floor_bytes"
RMSE, LARGEST, BEYOND = ERRORS = "error_rmse", "error_max", "error_bad_pixels"
# The columns of `error`, the distance from the truth, by the name in the record.
ERROR = {
    "rmse": RMSE, "rmse_standard_error": "error_rmse_standard_error", "below": "error_below", "max": LARGEST,
    "bad_pixels": BEYOND,
    "relative_mse": "error_relative_mse", "flip": "error_flip", "ssim": "error_ssim", "psnr_db": "error_psnr_db",
    "uncertainty": "uncertainty", "samples": "truth_samples",
}  # fmt: skip
# Of harness/picture/perception.py; no_error_ssim, say, is the reason why error_ssim is missing.
SEEN = {name: f"no_{ERROR[name]}" for name in ("flip", "ssim", "psnr_db")}
AGREEMENT = "agrees", "not_judged", "agreement_mask_fraction"
BOUND = {"max": "bound_max", "mean": "bound_mean"}  # of the error of a cut-off
GPU = "upload_s", "kernel_s", "download_s", "end_to_end_s"
FRAMES = "steady_state", "steady_note", "change", "steady_frames", "warmup_frames", "outlier_frames"
# The columns of the measurer's audit of itself, by the name in the record.
AUDITED = {
    "interval_p50_s": "tick_p50_s", "interval_p99_s": "tick_p99_s", "ticks": "ticks", "missed": "missed_ticks",
    "cpu_s": "measurer_cpu_s",
}  # fmt: skip
AUDIT = "measured_cpu_s", "cpu_off", *AUDITED.values()
DISTURBED = "steal_s", "other_cpu_s", "waited_s", "swapped_pages", "held_back_s", "throttled"  # system/trouble.py
# measurer_s is among those of the measurer's audit.
# Known only of processes in a steady state.
STEADY, MEAN, CPU = "steady_s", "steady_mean_s", "steady_cpu_s"  # of a frame: median, mean, CPU time
OF_STEADY = STEADY, MEAN, CPU, "rays_per_s", "search_s", "trace_s", "kernel_s", "download_s", "end_to_end_s"
COLUMNS = (
    "host", "cell", "scene", "point", "variant", "technology", "repetition", "pass", "status", "reason", "unranked",
    "wall_s", "first_s", STEADY, MEAN, CPU, *FRAMES, "compile_s", "compile_cache", "build_s",
    "user_s", "system_s", "cpu_s", "rays", "rays_per_s", "search_s", "trace_s", *GPU, *MEMORY, "memory_method",
    *AGREEMENT, *ERROR.values(), "against", "no_error", *SEEN.values(), *BOUND.values(), *AUDIT, *DISTURBED,
    "warnings",
)  # fmt: skip
CPU_DOUBT = "CPU time:"  # begins the warning of a row whose measured CPU time is off by too much (harness/race/row.py)


def row(record: dict) -> dict:
    """Returns a record as a row without its swept point; pandas makes missing values NaN.

    Of a process without a steady state all later frames count, and the cell decides whether to use them. change: the
    time of its late frames over that of its early ones.
    warmup_frames: before the steady state, frame 0 included. outlier_frames: among the steady ones.
    measured_cpu_s: from the measurer's series; cpu_off: it differs from wait4's by too much. against: what its error is
    held against, in words, "" for the truth of the scene. agrees: whether it agrees with its reference; None where
    not_judged says why.
    """
    frames = record["frames_s"] or []
    steady_frames = steady.find(frames)
    kept, steady_s = steady_frames.frames, steady_frames.seconds
    rays = record["rays"] and sum(record["rays"][kind] for kind in ("primary", "reflected", "transmitted", "shadow"))
    compile_s, upload_s = (_phase(record, name) for name in ("compile", "upload"))
    methods = (record["used"] or {}).get("methods") or {}
    cpu, memory, agreement = record["cpu"] or {}, record["memory"] or {}, record["agreement"] or {}
    audit = record["measurer"] or {}
    error, bound = _error(record), record.get("bound") or {}  # which runs of older versions lack
    not_judged = _not_judged(record)
    return {
        **{name: record[name] for name in ("cell", "scene", "variant", "technology", "repetition", "status", "reason")},
        "host": record.get("host"),
        "pass": record.get("pass") or "timed",
        "unranked": record.get("unranked"),
        "wall_s": record["wall_s"],
        **{name: cpu.get(name) for name in ("user_s", "system_s")},
        "cpu_s": cpu["user_s"] + cpu["system_s"] if cpu else None,
        **{name: memory.get(name) for name in MEMORY},
        "agrees": None if not_judged or not agreement else not agreement.get("wrong"),
        "not_judged": not_judged,
        "agreement_mask_fraction": agreement.get("mask_fraction"),
        **{column: _number(error.get(name)) for name, column in ERROR.items()},
        "against": rows.basis(error) if error and "unavailable" not in error else None,
        "no_error": error.get("unavailable"),
        **{column: _reason(error.get(name)) for name, column in SEEN.items()},
        **{column: bound.get(name) for name, column in BOUND.items()},
        "memory_method": memory.get("method"),
        "first_s": frames[0] if frames else None,
        STEADY: steady_s,
        MEAN: mean(kept) if kept else None,
        CPU: cpu.get("frame_s"),
        "steady_state": steady_frames.state if frames else None,
        "steady_note": steady_frames.note or None,
        "change": steady_frames.change,
        "steady_frames": len(kept),
        "warmup_frames": steady_frames.warm_up,
        "outlier_frames": sum(statistics.outliers(kept)) if kept else None,
        "compile_s": compile_s,
        "compile_cache": methods.get("compile_cache"),
        "build_s": (record["build"] or {}).get("seconds"),
        "rays": rays,
        "rays_per_s": rays / steady_s if rays and steady_s else None,
        "search_s": _part(record, "search", steady_frames.start),
        "trace_s": _part(record, "trace", steady_frames.start),
        "upload_s": upload_s,
        "kernel_s": _part(record, "kernel", steady_frames.start),
        "download_s": _part(record, "download", steady_frames.start),
        "end_to_end_s": None if upload_s is None or steady_s is None else upload_s + steady_s,
        **{column: audit.get(name) for name, column in AUDITED.items()},
        "measured_cpu_s": cpu.get("series_s"),
        "cpu_off": any(text.startswith(CPU_DOUBT) for text in record["warnings"]),
        **_known(record.get("disturbed") or {}, DISTURBED),
        "warnings": "; ".join(record["warnings"]),
    }


def _error(record: dict) -> dict:
    """Returns `error` of a record, by the keys of this version.

    Before 0.2 the uncertainty of a truth was `standard_error`, and the error of first hits stood in their agreement.
    """
    error, agreement = record.get("error") or {}, record["agreement"] or {}
    if not error and record["parameters"].get("kind") == "rays" and agreement:
        values = {"max": rows.largest(agreement), "bad_pixels": agreement.get("bad_pixels")}
        return {"against": "hits", **values} if "unavailable" not in agreement else agreement
    if "standard_error" in error:
        error = {**error, "uncertainty": error["standard_error"]}
    return {**error, "below": rows.below(error)} if "rmse" in error else error


def _phase(record: dict, phase: str) -> float | None:
    """Returns the time of a phase, s; None if the record has none of that name."""
    spans = [end - start for name, start, end in record["phases"] or [] if name == phase]
    return sum(spans) if spans else None


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
