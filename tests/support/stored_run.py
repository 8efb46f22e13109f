"""A small run as it is stored, made up: its run.json and its rows, of one machine or of a cluster."""

import json

SCENE = "scenes/a.txt"
PARAMETERS = {
    "kind": "image", "width": 4, "height": 4, "region": "0,0,4,4", "depth": 3, "shadows": 0, "sampler": "one",
    "samples": 1, "adaptive_depth": 3, "adaptive_threshold": 0.1, "lens_radius": 0.0, "focal_distance": 1.0,
    "feelers": 0, "glossy_rays": 0, "glossy_weight": "plain", "seed": 1, "walk": "least", "accel": "auto",
    "arithmetic": "linear", "sphere": "robust", "triangle": "watertight", "slab": "branch", "merge": "tolerant",
    "offset": "bounded", "fresnel": "clamped", "phong": "clamped", "renormalise": "on", "kernel": "needed",
    "vector": "off", "floating_point": "strict", "cutoff": 0.0, "sample_x": 0.5, "sample_y": 0.5,
    "precision": "float64", "epsilon": 1e-15, "threads": 1, "frames": 2, "least_frame": 0.001, "scene_memory": "auto",
    "block_width": 16, "block_height": 16, "total_threads": 0, "max_registers": 0,
}  # fmt: skip
ENVIRONMENT = {
    "host": "h", "os": "an OS", "kernel": "1", "cpu": "a processor", "architecture": "x86_64",
    "cores": {"usable": 2, "logical": 2, "physical": 2}, "frequency": "unavailable: none", "caches": {"L1": "1K"},
    "virtual_machine": "yes", "memory_bytes": 8e9, "swap_bytes": 0, "disk": "a disk", "gpu": "unavailable: no driver",
    "governor": "performance", "turbo": "off", "load": [0.0, 0.0, 0.0], "pressure": "unavailable: none",
    "python": "CPython 3", "compilers": {"c++": "g++"}, "packages": {"numpy": "2"}, "commit": "abc",
}  # fmt: skip
EXPERIMENT = {
    "title": "a run", "scenes": [SCENE], "renderers": ["cpp", "numba", "python"], "processes": 2, "frames": 2,
    "timeout": 600.0, "seed": 1, "order": "interleaved", "where": [], "image": {"width": 4, "height": 4, "depth": 3},
    "case": [], "generate": None, "stress": [], "sweep": {"depth": [3]}, "points": [], "measure": {"interval": 0.05},
    "reference": None, "theory": {}, "override": {}, "slurm": {}, "dask": None,
}  # fmt: skip
VARIANTS = "cpp", "numba", "python"
POINT = {"depth": 3}


def _copy(told):
    return json.loads(json.dumps(told))


def _cell(variant):
    return {
        "cell": f"key-{variant}", "variant": variant, "renderer": variant, "renderer_version": "v", "technology": "T",
        "lines": 9, "scene": SCENE, "scene_version": "s", "point": POINT, "parameters": PARAMETERS, "needs": ["sphere"],
    }  # fmt: skip


def facts(of=None):
    """run.json; of: None for a run of one machine, the number of a part, or "cluster" for the run that they are of."""
    batches = [{"cells": [[name, SCENE, '{"depth": 3}'] for name in VARIANTS], "pair": None} for _ in range(3)]
    told = {
        "format": 1, "title": "a run", "experiment": EXPERIMENT, "started": "2026-01-01T00:00:00.000+00:00",
        "command": ["rayrace", "run", "a.toml"], "environment": ENVIRONMENT, "order": [], "stability": {},
        "pair": {"cell": "key-cpp", "label": "cpp, a, depth 3"}, "left_out": [{"constraint": "depth <= 4", "cells": 2}],
        "cells": [_cell(variant) for variant in VARIANTS],
        "ended": {"at": "2026-01-01T00:01:00.000+00:00", "load": [0.0, 0.0, 0.0], "pressure": "unavailable: none"},
    }  # fmt: skip
    if of == "cluster":
        told["executor"] = {"name": "slurm", "batches": batches}
    elif of is not None:
        told["environment"] = {**ENVIRONMENT, "host": f"h{of}"}
        told["job"] = {"name": f"000{of}-1", "partition": "p"}
        told["speed"] = {"float64": [1e9, 2e9], "bytes": [1e9]}
    return _copy(told)


def job_lines():
    """jobs.jsonl: of three jobs, of which one has not run what it should."""
    told = []
    for number in range(3):
        told.append({"job": f"000{number}-1", "number": number, "submitted": "2026-01-01T00:00:00.000+00:00"})
        end = {"ended": "2026-01-01T00:02:00.000+00:00", "host": f"h{number}", "status": "", "reason": ""}
        told.append(
            {"job": f"000{number}-1", **end, **({"status": "killed", "reason": "no memory"} if number == 2 else {})}
        )
    return told


def rows(number=None):
    """repetitions.jsonl: two good processes of each of two variants, and one that failed."""
    told = [_row(variant, n, (0.5 + n / 10, 0.25, 0.3)) for n in range(2) for variant in VARIANTS[:2]]
    told[1]["pass"] = "pair"
    none = dict.fromkeys((
        "wall_s", "phases", "frames_s", "frame_renders", "frame_parts", "cpu", "memory", "rays", "used", "versions",
        "device", "measurer", "series", "picture", "agreement", "error", "bound", "stability",
    ))  # fmt: skip
    failed = {**_row("python", 0, ()), **none, "status": "failed", "reason": "exit 1: no"}
    return _copy([*told, failed])


def _row(variant, number, frames):
    return {
        "cell": f"key-{variant}", "variant": variant, "renderer": variant, "renderer_version": "v", "technology": "T",
        "scene": SCENE, "scene_version": "s", "point": POINT, "parameters": PARAMETERS, "needs": ["sphere"],
        "repetition": number, "pass": "timed", "status": "ok", "reason": "", "started": "2026-01-01T00:00:00",
        "lights": 1, "unranked": None, "peaks": {"one": {"float64": 1e9}, "all": {"float64": 2e9}}, "wall_s": 2.0,
        "shapes": {"sphere": 1, "box": 0, "polygon": 0, "ellipsoid": 0, "triangle": 0, "csg": 0}, "took_s": 3.0,
        "phases": [["start", 0.0, 0.1], ["compile", 0.1, 0.3], ["render", 0.3, 1.9], ["exit", 1.9, 2.0]],
        "frames_s": list(frames), "frame_renders": [1] * len(frames),
        "frame_parts": [{"kernel": 0.1, "download": 0.01}, None, None],
        "cpu": {"user_s": 1.5, "system_s": 0.5, "series_s": 2.0, "orphans": 0, "orphans_s": 0.0},
        "memory": {
            "peak_bytes": 2_000_000, "render_peak_bytes": None, "peak_virtual_bytes": 9_000_000, "method": "VmHWM",
            "at_least_bytes": None, "floor_bytes": None, "wait4_peak_bytes": 2_000_000,
        },
        "rays": {"primary": 10, "reflected": 5, "transmitted": 0, "shadow": 5, "non_finite": 0},
        "used": {"features": ["sphere"], "methods": {"compile_cache": "cold", "walk": "stack", "walk_rows": 3}},
        "versions": {"compiler": "g++ 12", "flags": "-O3"},
        "device": {"name": "d", "simulated": False, "compute_capability": [9, 0], "memory_bytes": 80_000_000},
        "measurer": {
            "ticks": 9, "missed": 0, "interval_s": 0.05, "interval_p50_s": 0.05, "interval_p99_s": 0.06, "cpu_s": 0.01,
            "saw_end": True, "resolution_s": 0.02, "processes": 1, "mark_bytes": 1, "pss_peak_bytes": None,
            "gpu": {"gpu_percent": "no driver"}, "gpu_sources": {}, "integral_s": 2.0, "wait4_s": 2.0,
        },
        "series": f"series/{variant}.csv", "warnings": ["CPU time: off"],
        "disturbed": {"steal_s": 0, "other_cpu_s": 0.1, "waited_s": 0.0, "swapped_pages": 0, "held_back_s": 0,
                      "throttled": {"unavailable": "none"}},
        "gpu": {"utilisation_percent": 98.0, "power_w": {"unavailable": "x"}, "throttled": ["heat"]},
        "build": {"seconds": 6.5, "compiler": "g++ 12", "command": ["c++", "-O3"]},
        "picture": {"file": f"pictures/{variant}.npy", "sha256": "0" * 64},
        "agreement": {
            "reference": "judge", "reference_file": "pictures/r.reference.npy", "mask_file": None, "wrong": None,
            "max_outside": 2e-15, "max_inside": None, "rmse": 1e-16, "relative_mse": 1e-30, "bad_pixels": 0.0,
            "mask_fraction": 0.25, "tolerance": 1e-9,
        },
        "error": {
            "truth": "judge", "against": "scene", "depth": 16, "truth_file": "pictures/t.truth.npy", "samples": 64,
            "change": 1e-6, "uncertainty": 1e-3, "standard_error_file": "pictures/t.standard_error.npy",
            "certificate": {"unavailable": "not asked for"}, "rmse": 0.02, "rmse_standard_error": 1e-5, "max": 0.5,
            "bad_pixels": 0.125, "relative_mse": 1e-3, "mask_fraction": 0.25, "psnr_db": 30.0,
            "ssim": {"unavailable": "small"}, "flip": 0.1, "flip_file": "pictures/x.flip.npy",
        },
        "bound": {"radiance": 2.0, "max": 0.1, "mean": 0.01, "dropped_file": "pictures/x.dropped.npy"},
        "stability": None,
    }  # fmt: skip


def write(folder, told, records, jobs=None, parts=()):
    """A run of these facts and rows; jobs: lines of jobs.jsonl; parts: (name, facts, rows) of each."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in texts(told, records, jobs).items():
        (folder / name).write_bytes(text)
    for name, its, mine in parts:
        write(folder / "parts" / name, its, mine)


def texts(told, records, jobs=None):
    found = {"run.json": as_bytes(told), "repetitions.jsonl": b"".join(as_bytes(row) + b"\n" for row in records)}
    return found if jobs is None else {**found, "jobs.jsonl": b"".join(as_bytes(line) + b"\n" for line in jobs)}


def as_bytes(told):
    return told if isinstance(told, bytes) else json.dumps(told).encode()


def write_series(folder, records):
    """The series of the rows, of two samples each: a report needs them."""
    (folder / "series").mkdir(exist_ok=True)
    for record in records:
        if record["series"]:
            (folder / record["series"]).write_text("t,cpu_s\n0.1,0\n1.9,2\n")
