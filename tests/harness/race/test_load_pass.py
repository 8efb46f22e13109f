"""The load pass: which cells it takes, what it and the timed rows say of the GPU, and a whole run against a trace.

The trace (tests/support/nvml) was written, not recorded: nothing here says anything about a device.
"""

import csv
import importlib.util
import json
import math
import statistics
import subprocess
from pathlib import Path
from types import SimpleNamespace

import pytest
from compilers import compiler

from harness.plan.plan import Cell, Plan
from harness.race import gpu_use, load_pass, row
from harness.renderer.events import Said
from harness.renderer.parameters import Parameters
from harness.store import store
from harness.system import trouble
from harness.system.gpu import SERIES
from harness.system.nvml import NO_TICK, TOO_SOON

pytestmark = pytest.mark.alone

HERE = Path(__file__).parents[1]
NVML = HERE.parent / "support" / "nvml"
RENDERER = HERE / "load_renderer"
LIBCUDA = "int cuInit(unsigned flags) { return flags; } int cuDeviceGetCount(int *n) { *n = 1; return 0; }\n"

# Which cells


def cell(device="cuda"):
    """A real Cell with a stub for its renderer."""
    entry = SimpleNamespace(variant=SimpleNamespace(device=device))
    rest = {"processes": 1, "timeout": 60.0, "point": {}, "objects": 1, "lights": 1}
    return Cell("k", entry, "scene", "version", Parameters(frames=2), (), **rest)


def record(**changes):
    return {
        "cell": "k", "status": "ok", "unranked": None, "measurer": {"gpu": {"gpu_energy_j": "available"}},
        "phases": [["load", 0, 1], ["render", 1, 1.3], ["save", 1.3, 9]], "frames_s": [0.2, 0.03, 0.05], **changes,
    }  # fmt: skip


def due(records, device="cuda", seconds=5.0):
    return load_pass.cells(Plan((cell(device),), {}), records, seconds)


def test_frames_fill_the_time():
    (longer,) = due([record(), record(frames_s=[9.0, 0.04, 0.04])])
    assert longer.parameters.frames == 125 and longer.key == "k" and longer.timeout == 70
    batches = record(frames_s=[0.02, 1e-4, 1e-4], frame_renders=[1, 50, 50])
    assert due([batches])[0].parameters.frames == 1000  # of 5 ms each
    assert due([record(frames_s=[0.3])])[0].parameters.frames == 17  # of the only frame
    for tiny in (1e-9, 0.0):
        assert due([record(frames_s=[0.0, tiny])])[0].parameters.frames == load_pass.MOST_FRAMES


@pytest.mark.parametrize(
    "changes",
    [
        {"status": "wrong picture"},
        {"status": "failed"},
        {"cell": "another"},
        {"unranked": "exhibit: looks odd"},
        {"unranked": row.SIMULATED},
        {"measurer": None},
        {"measurer": {"gpu": {"gpu_energy_j": "no NVIDIA driver"}}},
        {"phases": [["render", 0.5, 5.6]]},  # long enough by itself
        {"pass": "count", "phases": None, "frames_s": None},
    ],
)
def test_who_has_none(changes):
    assert due([record()]) and not due([record(**changes)])


def test_cpu_variants_have_none_and_zero_turns_it_off():
    assert not due([record()], "cpu") and not due([record()], seconds=0.0)


def test_a_failed_repetition_does_not_spoil_the_good_one():
    assert due([record(status="timeout", frames_s=None, phases=None), record()])


# What a row says


@pytest.fixture
def use(tmp_path):
    """The values of a render phase from 2 s to `end`, frames of 0.25 s, ticks every 0.1 s from 0 s to 8 s.

    Power rises by 1 W with each tick; the counter by 10 J.
    """

    def make(end=6.0, states=None, sources=None, rays=1000, blank=(), **said):
        path = tmp_path / "series.csv"
        with open(path, "w", newline="") as file:
            writer = csv.DictWriter(file, ("t", *SERIES))
            writer.writeheader()
            for tick in range(81):
                throttle = {30: "software power cap; idle", 70: "hardware slowdown"}.get(tick, "none")
                values = {
                    "gpu_percent": tick if tick % 4 == 0 else "", "gpu_memory_bytes": 5, "gpu_power_w": tick,
                    "gpu_process_memory_bytes": "" if tick < 10 else 7000 if tick == 15 else 300,
                    "gpu_energy_j": 10 * tick, "gpu_temperature_c": 90 if tick == 70 else 40 + tick / 100,
                    "gpu_throttle": throttle,
                }  # fmt: skip
                writer.writerow({"t": f"{tick / 10:.6f}"} | {k: "" if k in blank else v for k, v in values.items()})
            file.write("9.9,1,5,88888")  # torn, of 300
        audit = {"gpu": dict.fromkeys(SERIES, "available") | (states or {}), "interval_s": 0.1}
        audit["gpu_sources"] = {"gpu_percent": {"call": "c", "window_s": 0.5}, **(sources or {})}
        counts = {"primary": rays, "reflected": 0, "transmitted": 0, "shadow": 0, "non_finite": 0} if rays else None
        frames = [{"start": 102 + n / 4, "end": 102.25 + n / 4, "renders": 1} for n in range(round((end - 2) * 4))]
        phases = [{"name": "load", "start": 100.0, "end": 102.0}, {"name": "render", "start": 102.0, "end": 100 + end}]
        told = Said(**{"phases": phases, "frames": frames, "rays": counts, **said})
        return gpu_use.use(told, SimpleNamespace(spawned=100.0, measurer=audit), path)

    return make


def test_values_are_of_the_render_phase_alone(use):
    """Utilisation looks back by 0.5 s: what looks back to before 2 s is left out."""
    found = use(end=6.05, rays=2000)
    assert found["utilisation_percent"] == pytest.approx(sum(range(28, 61, 4)) / 9)
    assert found["power_w"] == pytest.approx(40)
    assert found["energy_j"] == pytest.approx(400) and found["energy_s"] == pytest.approx(4)
    assert found["joules_per_mray"] == pytest.approx(400 / (2000 * 16) * 1e6)
    assert found["process_memory_bytes"] == 7000  # over its life
    assert found["temperature_c"] == pytest.approx(40.6)
    assert found["throttled"] == ["software power cap"]
    assert set(found) == set(gpu_use.VALUES)


def test_parts_of_frames_count(use):
    """Ticks from 2.0 s to 3.1 s: frames of 0.25 s, 4.4 of them."""
    found = use(end=3.18)
    assert found["energy_s"] == pytest.approx(1.1)
    frames = [{"start": 102 + n / 4, "end": 102.25 + n / 4, "renders": 1} for n in range(5)]
    assert use(end=3.18, frames=frames)["joules_per_mray"] == pytest.approx(110 / 4400 * 1e6)
    batches = [{**frame, "renders": 10 if index else 1} for index, frame in enumerate(frames)]
    assert use(end=3.18, frames=batches)["joules_per_mray"] == pytest.approx(110 / (1000 + 34000) * 1e6)


def test_what_is_too_short(use):
    found = use(end=2.4)
    for name in ("utilisation_percent", "power_w", "energy_j", "energy_s", "joules_per_mray"):
        assert found[name] == {"unavailable": "too short to sample: 0.4 s of rendering, the window is 1 s"}
    assert found["temperature_c"] == pytest.approx(40.24) and found["throttled"] == []
    assert found["process_memory_bytes"] == 7000
    found = use(end=2.4, states={"gpu_percent": TOO_SOON, "gpu_energy_j": NO_TICK})
    assert found["utilisation_percent"] == found["energy_j"] == found["power_w"]
    found = use(end=3.2, sources={"gpu_power_w": {"call": "c", "window_s": 1.5}})
    assert found["power_w"] == {"unavailable": "too short to sample: 1.2 s of rendering, the window is 1.5 s"}
    assert use(end=2.0)["temperature_c"] == 40.2  # one tick
    found = use(end=2.05, phases=[{"name": "render", "start": 102.01, "end": 102.05}])
    why = {"unavailable": "too short to sample: 0.04 s of rendering, the window is 0.1 s"}
    assert found["temperature_c"] == found["throttled"] == why


@pytest.mark.parametrize("end", [2.4, 6.0])
def test_an_unavailable_column_gives_its_reason(use, end):
    for column, names in (
        ("gpu_percent", ["utilisation_percent"]),
        ("gpu_power_w", ["power_w"]),
        ("gpu_energy_j", ["energy_j", "energy_s", "joules_per_mray"]),
        ("gpu_process_memory_bytes", ["process_memory_bytes"]),
        ("gpu_temperature_c", ["temperature_c"]),
        ("gpu_throttle", ["throttled"]),
    ):
        found = use(end, states={column: "no permission"}, blank=[column])
        assert [name for name, value in found.items() if value == {"unavailable": "no permission"}] == names


def test_without_rays_phases_or_measurer(use):
    assert use(rays=None)["joules_per_mray"] == {"unavailable": "it does not count its rays"}
    assert use(rays=None)["energy_j"] == pytest.approx(400)
    assert use(frames=[])["joules_per_mray"] == {"unavailable": "no frame lies between the first and the last tick"}
    assert use(phases=[]) == gpu_use.unavailable("it told of no phase render")
    said = Said(phases=[{"name": "render", "start": 1.0, "end": 2.0}])
    dead = gpu_use.use(said, SimpleNamespace(spawned=0.0, measurer=None), Path("no such series"))
    assert dead == gpu_use.unavailable("the measurer died")


# A whole run


@pytest.fixture
def race(rayrace, experiment, tmp_path, monkeypatch):
    """race('gpu_load = "1 s"', simulator=False, **trace): the rows of a run, its folder, the module that replays."""

    def run(measure, simulator=False, **changes):
        trace = json.loads((NVML / "trace.json").read_text()) | {"origin_s": 0.0, "energy_step_s": 0.01} | changes
        (tmp_path / "trace.json").write_text(json.dumps(trace))
        env = dict.fromkeys(("HOME", "TMPDIR"), str(tmp_path))
        env |= {"PYTHONPATH": str(NVML), "NVML_TRACE": str(tmp_path / "trace.json")}
        if simulator:
            env["RAYRACE_CUDASIM"] = "1"
        else:  # what the harness asks for a device
            (tmp_path / "cuda.c").write_text(LIBCUDA)
            command = [compiler("c"), "-shared", "-fPIC", "-o", tmp_path / "libcuda.so.1", tmp_path / "cuda.c"]
            subprocess.run(command, check=True, timeout=60)
            env["LD_LIBRARY_PATH"] = str(tmp_path)
        file = experiment(["sleeper"], f'\n[measure]\ninterval = "20 ms"\n{measure}\n', processes=2, frames=3)
        out = tmp_path / "run"
        rayrace("run", file, "--renderer", RENDERER, "--out", out, env=env, code=0)
        monkeypatch.setenv("NVML_TRACE", str(tmp_path / "trace.json"))
        spec = importlib.util.spec_from_file_location("replay", NVML / "pynvml.py")
        replay = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(replay)
        return store.read(out), out, replay

    return run


def said(folder, stem):
    return [json.loads(line) for line in (folder / "logs" / f"{stem}.stdout").read_text().splitlines()]


def test_a_load_pass(race):
    (facts, rows), folder, replay = race('gpu_load = "1.4 s"')
    assert [r["pass"] for r in rows] == ["timed", "timed", "load"]  # after all that is timed
    assert [r["repetition"] for r in rows] == [0, 1, 0] and {r["status"] for r in rows} == {"ok"}
    assert facts["experiment"]["measure"]["gpu_load"] == 1.4
    assert facts["environment"]["gpu"]["name"] == "Trace of a GPU" and facts["environment"]["gpu"]["mig"] == "off"
    timed, _, load = rows
    for name in ("utilisation_percent", "power_w", "energy_j", "joules_per_mray"):
        assert timed["gpu"][name]["unavailable"].startswith("too short to sample: 0.1")
    assert timed["gpu"]["process_memory_bytes"] in (300e6, 400e6, 500e6)
    assert timed["parameters"]["frames"] == 3 and len(timed["frames_s"]) == 4
    assert (
        load["cell"] == timed["cell"]
        and load["picture"] == timed["picture"]
        and not set(load["warnings"]) - set(trouble.DOUBTS.values())
    )
    assert load["series"] != timed["series"]
    frame = statistics.median(frame for r in rows[:2] for frame in r["frames_s"][1:])  # it sleeps that long, or longer
    assert load["parameters"]["frames"] == math.ceil(1.4 / frame) and sum(load["frames_s"]) > 1
    assert load["measurer"]["gpu"] == dict.fromkeys(SERIES, "available")
    gpu = load["gpu"]

    with open(folder / load["series"], newline="") as file:
        ticks = list(csv.DictReader(file))
    _, start, end = next(phase for phase in load["phases"] if phase[0] == "render")
    ticks = [tick for tick in ticks if start <= float(tick["t"]) <= end]
    first, last = ticks[0], ticks[-1]
    assert gpu["energy_j"] == pytest.approx(float(last["gpu_energy_j"]) - float(first["gpu_energy_j"]))
    assert gpu["energy_s"] == pytest.approx(float(last["t"]) - float(first["t"]), abs=1e-5)

    # against the trace itself, on the clock of the system: a tick reads the counter a little after its stamp
    events = said(folder, f"{load['cell']}-load-0")
    phase = next(event for event in events if event.get("name") == "render")
    a, b = (float(tick["t"]) + phase["start"] - start for tick in (first, last))
    integral = replay.integral("power_w", b) - replay.integral("power_w", a)
    assert gpu["energy_j"] == pytest.approx(integral, abs=0.1 * 600) and integral > 250
    assert gpu["power_w"] == pytest.approx(integral / (b - a), rel=0.3)
    busy = 100 * (replay.integral("busy", b) - replay.integral("busy", a)) / (b - a)
    assert gpu["utilisation_percent"] == pytest.approx(busy, abs=15)

    frames = [(e["start"], e["end"]) for e in events if e["event"] == "frame"]
    inside = sum(max(0, min(y, b) - max(x, a)) / (y - x) for x, y in frames)
    assert gpu["joules_per_mray"] == pytest.approx(gpu["energy_j"] / (8 * 7 * inside) * 1e6, rel=1e-3)
    assert gpu["process_memory_bytes"] == 500e6 and gpu["temperature_c"] == 63
    assert gpu["throttled"] == ["software power cap", "software thermal slowdown"]


def test_no_driver(race):
    (_, rows), _, _ = race('gpu_load = "1.4 s"', errors={"nvmlInit": "LibraryNotFound"})
    assert [r["pass"] for r in rows] == ["timed", "timed"]
    reason = "no NVIDIA driver: NVML Shared Library Not Found"
    assert rows[0]["gpu"]["temperature_c"] == {"unavailable": reason} == rows[1]["gpu"]["process_memory_bytes"]
    assert rows[0]["measurer"]["gpu"] == dict.fromkeys(SERIES, reason)


def test_turned_off(race):
    (_, rows), _, _ = race("gpu_load = 0")
    assert [r["pass"] for r in rows] == ["timed", "timed"]
    assert rows[0]["gpu"]["energy_j"]["unavailable"].startswith("too short to sample: ")


def test_the_simulator_says_nothing_about_a_gpu(race):
    (_, rows), _, _ = race('gpu_load = "1.4 s"', simulator=True)
    assert [r["pass"] for r in rows] == ["timed", "timed"]
    assert rows[0]["gpu"] == gpu_use.unavailable(row.SIMULATED)
