"""A repetition as one flat row: every number of it is one number, the steady time the mean of the later frames."""

MEMORY = "peak_bytes", "render_peak_bytes", "peak_virtual_bytes", "floor_bytes"
ACCURACY = "reference", "max_outside", "max_inside", "rmse", "bad_pixels", "mask_fraction", "tolerance"
GPU = "upload_s", "kernel_s", "download_s", "end_to_end_s"
COLUMNS = (
    "scene", "point", "variant", "technology", "repetition", "pass", "status", "reason", "unranked", "wall_s",
    "first_s", "steady_s", "steady_frames", "compile_s", "compile_cache", "build_s", "user_s", "system_s", "rays",
    "rays_per_s", *GPU, *MEMORY, "memory_method", *ACCURACY, "not_judged", "warnings",
)  # fmt: skip


def row(record: dict) -> dict:
    """A record as a flat row, its point apart; what it does not tell is left out, which pandas makes NaN."""
    frames = record["frames_s"] or []
    steady = frames[1:]
    steady_s = sum(steady) / len(steady) if steady else None
    rays = record["rays"] and sum(record["rays"][kind] for kind in ("primary", "reflected", "transmitted", "shadow"))
    compile_s, upload_s = (_phase(record, name) for name in ("compile", "upload"))
    methods = (record["used"] or {}).get("methods") or {}
    memory, accuracy = record["memory"] or {}, record["accuracy"] or {}
    return {
        **{name: record[name] for name in ("scene", "variant", "technology", "repetition", "status", "reason")},
        "pass": record.get("pass") or "timed",
        "unranked": record.get("unranked"),
        "wall_s": record["wall_s"],
        **{name: (record["cpu"] or {}).get(name) for name in ("user_s", "system_s")},
        **{name: memory.get(name) for name in MEMORY},
        **{name: accuracy.get(name) for name in ACCURACY},
        "memory_method": memory.get("method"),
        "first_s": frames[0] if frames else None,
        "steady_s": steady_s,
        "steady_frames": len(steady),
        "compile_s": compile_s,
        "compile_cache": methods.get("compile_cache"),
        "build_s": (record["build"] or {}).get("seconds"),
        "rays": rays,
        "rays_per_s": rays * len(steady) / sum(steady) if rays and steady else None,
        "upload_s": upload_s,
        "kernel_s": _part(record, "kernel"),
        "download_s": _part(record, "download"),
        "end_to_end_s": None if upload_s is None or steady_s is None else upload_s + steady_s,
        "not_judged": _not_judged(record),
        "warnings": "; ".join(record["warnings"]),
    }


def _phase(record: dict, phase: str) -> float | None:
    """s of a phase; None if it has none of that name."""
    found = [end - start for name, start, end in record["phases"] or [] if name == phase]
    return sum(found) if found else None


def _part(record: dict, name: str) -> float | None:
    """Mean s of a part of its steady frames; None if one of them does not tell it."""
    parts = (record.get("frame_parts") or [])[1:]
    if not parts or any(told is None or told.get(name) is None for told in parts):
        return None
    return sum(told[name] for told in parts) / len(parts)


def _not_judged(record: dict) -> str | None:
    """Why the picture of a record has no verdict; None if it has one, or if there is no picture."""
    if record["accuracy"] is None:
        return "the judge was not asked" if record["status"] == "ok" else None
    return record["accuracy"].get("unavailable")
