"""A small synthetic run with numbers that can be checked by hand."""

import hashlib
import json
from zlib import crc32

import matplotlib.pyplot as plt
import numpy as np
import pytest
from figure_lint import faults
from made_up_errors import DEFAULTS, OF_SCENE, error

from harness.store import store
from reports import page
from reports.page import report
from reports.paper import style
from reports.run import results

SCENE = "scenes/comparison.txt"
PARAMETERS = {
    "kind": "image", "width": 4, "height": 4, "region": "0,0,4,4", "depth": 3, "shadows": 0, "sample_x": 0.5,
    "sample_y": 0.5, "precision": "float64", "threads": 1, "frames": 2,
}  # fmt: skip
ENVIRONMENT = {
    "host": "h", "os": "an OS", "kernel": "1", "cpu": "a processor", "architecture": "x86_64",
    "cores": {"usable": 2, "logical": 2, "physical": 2}, "frequency": "unavailable: none", "caches": {"L1": "1K"},
    "virtual_machine": "yes", "memory_bytes": 8e9, "swap_bytes": 0, "disk": "a disk", "gpu": "unavailable: no driver",
    "governor": "performance", "turbo": "off", "load": [0.0, 0.0, 0.0], "pressure": "unavailable: none",
    "python": "CPython 3", "compilers": {"c++": "g++"}, "packages": {"numpy": "2"}, "commit": "abc",
}  # fmt: skip
AGREED = {
    "reference": "judge", "reference_file": "pictures/r.reference.npy", "wrong": None, "max_outside": 2e-15,
    "max_inside": None, "rmse": 0.0, "bad_pixels": 0.0,
    "mask_fraction": 0.25, "tolerance": 1e-9,
}  # fmt: skip
FACTS = (
    "cell", "variant", "renderer", "renderer_version", "technology", "scene", "point", "parameters", "needs",
)  # fmt: skip
UNKNOWN = (
    "wall_s", "phases", "frames_s", "cpu", "memory", "rays", "used", "versions", "build", "picture", "agreement",
    "error", "measurer", "series",
)  # fmt: skip
RAYS = {"primary": 10, "reflected": 5, "transmitted": 0, "shadow": 5, "non_finite": 0}


def _record(variant, number=0, frames=(0.5, 0.25, 0.75), compile_s=None, cache=None, **changes):
    """A good repetition; the frames' durations in s."""
    phases = [["start", 0.0, 0.1], ["compile", 0.1, 0.1 + compile_s]] if compile_s else [["start", 0.0, 0.1]]
    return {
        "cell": f"key-{variant}", "repetition": number, "variant": variant, "renderer": variant,
        "renderer_version": "v", "technology": "T", "scene": SCENE, "point": {}, "parameters": PARAMETERS, "needs": [],
        "status": "ok", "reason": "", "started": "2026-01-01T00:00:00", "wall_s": 2.0, "phases": phases,
        "frames_s": list(frames), "cpu": {"user_s": 1.5, "system_s": 0.5, "series_s": 2.0},
        "memory": {
            "peak_bytes": 2e6 + number * 1e6, "render_peak_bytes": None, "peak_virtual_bytes": 9e6, "method": "VmHWM",
            "floor_bytes": None,
        },
        "rays": RAYS, "used": {"features": [], "methods": {"compile_cache": cache} if cache else {}}, "versions": {},
        "build": None, "picture": {"file": f"pictures/{variant}.npy"}, "agreement": AGREED,
        "error": OF_SCENE, "measurer": None, "series": f"series/{variant}.csv", "warnings": [], **changes,
    }  # fmt: skip


def _bad(variant, status, reason, number=0, **changes):
    """A repetition that did not end well: nothing is known of it but why."""
    return _record(variant, number, status=status, reason=reason) | dict.fromkeys(UNKNOWN) | changes


DEVICE = {
    "name": "made-up GPU", "simulated": False, "compute_capability": [9, 0], "multiprocessors": 100, "clock_mhz": 1500,
    "memory_bytes": 8e10, "shared_bytes_per_block": 49152, "registers_per_multiprocessor": 65536, "driver": "1.2",
    "peak_fp32_flops": 4e13, "peak_fp64_flops": 2e13,
}  # fmt: skip
LAUNCH = {
    "precision": "float64", "accel": "none", "scene_memory": "global", "block": "16x16", "total_threads": 16,
    "blocks": 1, "max_registers": 0, "registers": 128, "local_bytes": 64, "shared_bytes": 0, "constant_bytes": 512,
    "occupancy": 0.25,
}  # fmt: skip
SEEN = {
    "utilisation_percent": 98.0, "power_w": 350.0, "energy_j": 900.0, "energy_s": 2.6, "joules_per_mray": 0.5,
    "process_memory_bytes": 3e8, "temperature_c": 50.0, "throttled": [],
}  # fmt: skip
IN_SIMULATOR = "ran in the CUDA simulator: its times say nothing about a GPU"


def _gpu_record(variant="numba-cuda", number=0, kernel_s=(0.4, 0.2, 0.2), told=None, **changes):
    """A good repetition on a GPU. Every number is made up; none was measured on a device.

    kernel_s: of each frame, of which 0.25 ms more is downloading. told: what differs in `used.methods`.
    parameters: what differs from PARAMETERS.
    """
    parameters = PARAMETERS | {"scene_memory": "global", "block_width": 16, "block_height": 16, "total_threads": 0}
    parameters |= changes.pop("parameters", {})
    made = _record(variant, number, frames=[seconds + 0.00025 for seconds in kernel_s])
    return made | {
        "parameters": parameters, "phases": [["start", 0.0, 0.2], ["upload", 0.2, 0.3], ["render", 0.3, 1.9]],
        "used": {"features": [], "methods": LAUNCH | (told or {})}, "device": DEVICE,
        "shapes": {"sphere": 48, "box": 0},
        "frame_parts": [{"kernel": seconds, "download": 0.00025} for seconds in kernel_s], "unranked": None,
        "pass": "timed", "gpu": SEEN, "picture": {"file": f"pictures/{variant}.npy"},
    } | changes  # fmt: skip


def _simulated(number=0, told=None, **changes):
    """A repetition in the CUDA simulator."""
    none = dict.fromkeys(LAUNCH) | {"block": "16x16", "total_threads": 16, "scene_memory": "global"} | (told or {})
    device = dict.fromkeys(DEVICE) | {"name": "the CUDA simulator", "simulated": True}
    gpu = {name: {"unavailable": "no NVIDIA driver"} for name in SEEN}
    return _gpu_record(number=number, told=none, **{"device": device, "gpu": gpu, "unranked": IN_SIMULATOR} | changes)


def _exhibit(variant="numba-cuda-index-fault", number=0, **changes):
    """A repetition of an exhibit, whose picture is wrong."""
    text = "exhibit: the study's figure 2.9"
    wrong = {"status": "wrong picture", "reason": "7 pixels differ", "unranked": text}
    return _gpu_record(
        variant, number, **{**wrong, "agreement": AGREED | {"bad_pixels": 0.4375, "max_outside": 0.8}} | changes
    )


@pytest.fixture
def gpu_record():
    return _gpu_record


@pytest.fixture
def simulated():
    return _simulated


@pytest.fixture
def exhibit():
    return _exhibit


@pytest.fixture
def record():
    """`_record`; a fixture, since tests cannot import each other."""
    return _record


@pytest.fixture
def bad():
    return _bad


@pytest.fixture
def make_run(tmp_path):
    """A function that writes a run of the given records and returns its folder.

    files: arrays and texts by path, in place of the pictures and series that are written otherwise. A picture without a
    SHA-256 has that of its file.
    """

    def make(records, name="run", files=None, **facts):
        folder = tmp_path / name
        run = store.Run(folder)
        experiment = {
            "processes": 1, "frames": 2, "seed": 1, "override": {}, "image": {}, "measure": {"interval": 0.05},
            **facts.pop("experiment", {}),
        }  # fmt: skip
        cells = [{key: told[key] for key in FACTS} for told in records if told["repetition"] == 0]
        described = {
            "title": "A title", "experiment": experiment, "started": "now", "command": ["rayrace", "run"],
            "environment": ENVIRONMENT, "cells": cells, **facts,
        }  # fmt: skip
        run.describe(**described)
        picture = np.linspace(0, 1, 48).reshape(4, 4, 3)
        for name in ("r.reference", "t.truth"):
            np.save(folder / "pictures" / f"{name}.npy", picture)
        for told in records:
            row = json.loads(json.dumps(told))
            if row["picture"]:
                np.save(folder / row["picture"]["file"], picture)
                stored = (files or {}).get(row["picture"]["file"], picture)
                digest = hashlib.sha256(np.ascontiguousarray(stored).tobytes()).hexdigest()
                row["picture"] = {"sha256": digest, **row["picture"]}
            if row["series"]:
                (folder / row["series"]).write_text("t,cpu_s\n0.0,0.0\n0.5,0.5\n1.5,1.0\n")
            run.append(row)
        for file, content in (files or {}).items():
            if isinstance(content, str):
                (folder / file).write_text(content)
            else:
                np.save(folder / file, content)
        run.close()
        return folder

    return make


@pytest.fixture
def load(make_run):
    """A function that loads a run of the given records."""
    return lambda records, **facts: results.load(make_run(records, **facts))


def _text(monkeypatch, run, out):
    """report.md of a run, without the page, which needs the files of the figures."""
    monkeypatch.setattr(page, "write", lambda *_: None)
    report.write(run, out)
    return (out / "report.md").read_text("utf-8")


@pytest.fixture
def report_text(make_run, tmp_path, monkeypatch):
    """A function that gives the text of the report on the given records; figures are drawn and not saved."""
    monkeypatch.setattr(style, "save", lambda figure, path: plt.close(figure))
    return lambda records, **facts: _text(monkeypatch, make_run(records, **facts), tmp_path / "report")


@pytest.fixture
def section(make_run, tmp_path, monkeypatch):
    """section(records, title): a section of their report, and its figures by name, which are drawn and not saved."""
    figures = {}

    def keep(figure, path):
        figures[path.name] = figure
        plt.close(figure)

    def find(records, title):
        monkeypatch.setattr(style, "save", keep)
        text = _text(monkeypatch, make_run(records), tmp_path)
        return text.partition(f"## {title}")[2].partition("\n## ")[0], figures

    return find


@pytest.fixture
def drawn(monkeypatch):
    """Figures by name, which are drawn, examined and not saved."""
    figures = {}

    def keep(figure, path):
        assert faults(figure) == []
        figures[path.name] = figure

    monkeypatch.setattr(style, "save", keep)
    yield figures
    plt.close("all")


@pytest.fixture
def cell(record):
    """A function that gives the records of a cell: its variant, times of its processes (s), error, and parameters."""

    def make(variant, times, rmse, sampled=True, scene="scenes/mirrors.txt", **parameters):
        key = f"{variant}-{scene[7:-4]}-{crc32(repr(sorted(parameters.items())).encode())}"
        told = {"cell": key, "scene": scene, "point": parameters, "series": None, "error": error(rmse, sampled)}
        told |= {"parameters": record("")["parameters"] | DEFAULTS | parameters}
        told |= {"picture": {"file": f"pictures/{key}.npy"}}
        return [record(variant, number, frames=[time] * 4, **told) for number, time in enumerate(times)]

    return make


@pytest.fixture
def jittered(cell):
    """A function that gives cells along n × n samples, whose error falls with n to the power -1.5."""

    def make(variant, speed, sides=(1, 2, 4, 8), sampler="jittered", **parameters):
        rng = np.random.default_rng(len(variant))
        told = []
        for n in sides:
            times = speed * n * n * rng.lognormal(0, 0.03, 6)
            told += cell(variant, times, 0.08 / n**1.5, sampler=sampler, samples=n, **parameters)
        return told

    return make


@pytest.fixture
def many(cell, jittered, bad, record):
    """A run of some thirty methods in two views, with one that failed."""
    told = []
    for variant, speed in {
        "numpy": 2.0,
        "numba": 0.1,
        "numba-parallel": 0.06,
        "cpp": 0.09,
        "cpp-threads": 0.05,
    }.items():
        told += jittered(variant, speed)
        for size, precision in ((1e-15, "float64"), (1e-3, "float32")):
            times = [speed * (1 + 0.01 * n) * (1 if precision == "float64" else 0.7) for n in range(6)]
            told += cell(variant, times, size * (1 + speed), False, "scenes/local.txt", precision=precision)
    for variant, speed in {"numba": 0.1, "cpp": 0.09}.items():
        for k in (6, 10, 14):
            told += cell(variant, [speed * (0.5 + k / 40)] * 6, 0.3 * 2**-k, False, "scenes/local.txt", cutoff=2.0**-k)
    told += cell("cpp-threads", [0.04] * 6, 0.0, False, "scenes/local.txt", floating_point="contract")
    parameters = record("")["parameters"] | DEFAULTS
    return [
        *told,
        bad("numba-cuda", "unsupported", "has no sampler", scene="scenes/local.txt", parameters=parameters),
    ]
