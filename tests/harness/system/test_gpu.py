"""Gpu, fed by a trace of NVML's answers (tests/support/nvml) whose clock the tests set."""

import importlib.util
import inspect
import json
import os
import statistics
import sys
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import pytest

from harness.system import gpu as gpu_module
from harness.system import nvml as columns
from harness.system.gpu import SERIES, Gpu

FAKE = Path(__file__).parents[2] / "support" / "nvml" / "pynvml.py"
TRACE = json.loads(FAKE.with_name("trace.json").read_text())
INTERVAL = 0.05


@pytest.fixture
def nvml(tmp_path, monkeypatch):
    """nvml(errors={..}) puts a trace with these changes in place of pynvml; `.now` is its time."""
    monkeypatch.delenv("CUDA_VISIBLE_DEVICES", raising=False)

    def replace(**changes):
        path = tmp_path / "trace.json"
        path.write_text(json.dumps({**TRACE, "origin_s": 0.0, "process": os.getpid(), **changes}))
        monkeypatch.setenv("NVML_TRACE", str(path))
        spec = importlib.util.spec_from_file_location("pynvml", FAKE)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        module.now = 0.0
        module.time = SimpleNamespace(monotonic=lambda: module.now)
        monkeypatch.setitem(sys.modules, "pynvml", module)
        return module

    return replace


def watch(module, seconds, pids=None, start=2.0):
    """A Gpu that was sampled for so long, and its rows as dicts with their time."""
    module.now = start
    gpu, rows = Gpu(), []
    for tick in range(round(seconds / INTERVAL)):
        module.now = start + tick * INTERVAL + 1e-4
        values = gpu.sample(frozenset(pids or [os.getpid()]), module.now)
        rows.append({"t": module.now, **dict(zip(SERIES, values, strict=True))})
    return gpu, rows


def told(rows, column):
    return [row[column] for row in rows if row[column] is not None]


def test_all_told(nvml):
    module = nvml()
    gpu, rows = watch(module, 3.2)
    assert gpu.unavailable is None and gpu.states() == dict.fromkeys(SERIES, "available")
    for name, column, factor in (
        ("gpu_memory_bytes", "memory_bytes", 1),
        ("gpu_process_memory_bytes", "process_bytes", 1),
        ("gpu_power_w", "power_w", 1),
        ("gpu_clock_mhz", "sm_mhz", 1),
        ("gpu_memory_clock_mhz", "memory_mhz", 1),
        ("gpu_temperature_c", "temperature_c", 1),
    ):
        assert told(rows, name) == [module._at(row["t"])[column] * factor for row in rows], name
    used = rows[-1]["gpu_energy_j"] - rows[0]["gpu_energy_j"]
    integral = module.integral("power_w", rows[-1]["t"]) - module.integral("power_w", rows[0]["t"])
    assert used == pytest.approx(integral, abs=2 * 600 * TRACE["energy_step_s"]) and integral > 1000
    assert set(told(rows, "gpu_throttle")) == {"none", "idle", "software power cap; software thermal slowdown"}
    assert gpu.sources()["gpu_power_w"] == {"call": "field 186", "window_s": 0.0}
    assert set(gpu.sources()) == set(SERIES)


def test_utilisation_is_told_once_when_it_is_new(nvml):
    """Polled three times a period; what the buffer held before the first tick is not counted."""
    gpu, rows = watch(nvml(), 3.2)
    values = told(rows, "gpu_percent")
    assert rows[0]["gpu_percent"] is None and len(values) == pytest.approx(3.2 / 0.16, abs=1)
    busy = (0.9 * 0.3 + 1.0 * 0.3 + 0.2 * 0.2) / 0.8
    assert statistics.fmean(values) == pytest.approx(100 * busy, abs=4) and len(set(values)) > 2
    assert gpu.sources()["gpu_percent"] == {"call": "nvmlDeviceGetSamples", "window_s": pytest.approx(1 / 6)}


def test_several_new_samples_in_one_tick_are_averaged(nvml):
    """A measurer that was held up for four periods has missed no sample."""
    module = nvml(rows=[[0.0, 0.5, 1, 1, 1, 1, 1, 1, 0]])
    gpu, _ = watch(module, 0.1)
    module.now += 4 * 0.16
    assert dict(zip(SERIES, gpu.sample(frozenset(), module.now), strict=True))["gpu_percent"] == 50


def test_a_dry_buffer_is_replaced_by_a_reading_a_second(nvml):
    gpu, rows = watch(nvml(errors={"nvmlDeviceGetSamples": "NotFound"}), 5.2)
    times = [row["t"] for row in rows if row["gpu_percent"] is not None]
    assert len(times) == 5 and all(0.999 < b - a < 1.001 + INTERVAL for a, b in pairwise(times))
    assert gpu.states()["gpu_percent"] == "available"
    assert gpu.sources()["gpu_percent"] == {"call": "nvmlDeviceGetUtilizationRates", "window_s": 1.0}


def test_a_buffer_that_runs_dry_half_way(nvml):
    module = nvml()
    gpu, rows = watch(module, 2)
    module.TRACE["errors"]["nvmlDeviceGetSamples"] = "NotFound"
    later = []
    for tick in range(60):
        module.now = 4 + tick * INTERVAL
        later.append(gpu.sample(frozenset(), module.now)[0])
    assert told(rows, "gpu_percent") and len([value for value in later if value is not None]) == 3
    assert gpu.sources()["gpu_percent"] == {
        "call": "nvmlDeviceGetSamples and nvmlDeviceGetUtilizationRates",
        "window_s": 1.0,
    }


def test_utilisation_of_a_run_that_is_too_short(nvml):
    gpu, _ = watch(nvml(errors={"nvmlDeviceGetSamples": "NotFound"}), 0.5)
    assert gpu.states()["gpu_percent"] == columns.TOO_SOON
    assert Gpu().states()["gpu_percent"] == columns.NO_TICK


REFUSED = {
    "NotSupported": "not supported by this device",
    "NoPermission": "no permission",
    "FunctionNotFound": "not known to this driver or this nvidia-ml-py",
    "LibraryMismatch": "not known to this driver or this nvidia-ml-py",
    "GpuIsLost": "GPU is lost",
}


@pytest.mark.parametrize("kind", REFUSED)
@pytest.mark.parametrize(
    ("calls", "empty"),
    [
        (("nvmlDeviceGetSamples", "nvmlDeviceGetUtilizationRates"), ["gpu_percent"]),
        (("nvmlDeviceGetMemoryInfo",), ["gpu_memory_bytes"]),
        (("nvmlDeviceGetComputeRunningProcesses",), ["gpu_process_memory_bytes"]),
        (("field 186", "nvmlDeviceGetPowerUsage"), ["gpu_power_w"]),
        (("nvmlDeviceGetTotalEnergyConsumption",), ["gpu_energy_j"]),
        (("nvmlDeviceGetClockInfo",), ["gpu_clock_mhz", "gpu_memory_clock_mhz"]),
        (("nvmlDeviceGetTemperatureV", "nvmlDeviceGetTemperature"), ["gpu_temperature_c"]),
        (
            ("nvmlDeviceGetCurrentClocksEventReasons", "nvmlDeviceGetCurrentClocksThrottleReasons"),
            ["gpu_throttle"],
        ),
    ],
)
def test_what_is_not_told_has_its_reason_and_the_rest_is_there(nvml, calls, empty, kind):
    if kind == "LibraryMismatch":
        calls = ["nvmlDeviceGetFieldValues" if call == "field 186" else call for call in calls]
    gpu, rows = watch(nvml(errors=dict.fromkeys(calls, kind)), 2.2)
    states = gpu.states()
    assert [name for name in SERIES if not told(rows, name)] == empty
    assert [name for name in SERIES if states[name] != "available"] == empty
    names = ["field 186" if call == "nvmlDeviceGetFieldValues" else call for call in calls]
    for name in empty:
        assert states[name] == "; ".join(f"{call}: {REFUSED[kind]}" for call in names)
        assert name not in gpu.sources()


@pytest.mark.parametrize("how", ["refused", "absent"])
def test_older_names_and_calls_are_fallen_back_to(nvml, how):
    new = ["nvmlDeviceGetFieldValues", "nvmlDeviceGetTemperatureV", "nvmlDeviceGetCurrentClocksEventReasons"]
    module = nvml(absent=new) if how == "absent" else nvml(errors=dict.fromkeys(new, "FunctionNotFound"))
    gpu, rows = watch(module, 2)
    assert gpu.states() == dict.fromkeys(SERIES, "available")
    assert gpu.sources()["gpu_power_w"] == {"call": "nvmlDeviceGetPowerUsage", "window_s": 1.0}
    assert gpu.sources()["gpu_temperature_c"]["call"] == "nvmlDeviceGetTemperature"
    assert gpu.sources()["gpu_throttle"]["call"] == "nvmlDeviceGetCurrentClocksThrottleReasons"
    assert all(300 < value < 500 for value in told(rows, "gpu_power_w"))


@pytest.mark.parametrize(
    ("process", "memory", "reason"),
    [
        (2**22 + 1, 100, columns.HOST_PIDS),  # no process has such a number
        (os.getppid(), 100, columns.NO_PROCESS),
        (None, 100, columns.NO_PROCESS),
        (os.getpid(), None, "NVML does not report the memory of single processes here"),
    ],
    ids=("of the host", "another", "none", "its memory is not told"),
)
def test_processes_that_cannot_be_matched(nvml, process, memory, reason):
    """In a container the numbers may be the host's."""
    module = nvml(process=process)
    if memory is None:
        listed = [SimpleNamespace(pid=process, usedGpuMemory=None)]
        module.nvmlDeviceGetComputeRunningProcesses = lambda handle: listed
    gpu, rows = watch(module, 0.2)
    assert not told(rows, "gpu_process_memory_bytes")
    assert gpu.states()["gpu_process_memory_bytes"] == reason
    assert gpu.states()["gpu_memory_bytes"] == "available"


def test_memory_of_descendants_counts(nvml):
    gpu, rows = watch(nvml(), 0.2, pids=[1, os.getpid()])
    assert told(rows, "gpu_process_memory_bytes") and gpu.states()["gpu_process_memory_bytes"] == "available"


@pytest.mark.parametrize(
    ("visible", "uuid"),
    [
        (None, "GPU-11111111-aaaa"),
        ("0,1", "GPU-11111111-aaaa"),
        ("1", "GPU-22222222-bbbb"),
        (" 1 ,0", "GPU-22222222-bbbb"),
        ("GPU-22222222-bbbb", "GPU-22222222-bbbb"),
        ("GPU-2", "GPU-22222222-bbbb"),  # CUDA takes the start of one
    ],
)
def test_which_gpu(nvml, visible, uuid, monkeypatch):
    nvml()
    if visible is not None:
        monkeypatch.setenv("CUDA_VISIBLE_DEVICES", visible)
    assert Gpu().identity()["uuid"] == uuid


@pytest.mark.parametrize("visible", ["", "-1", "7", "GPU-3", "nonsense"])
def test_no_gpu_is_visible(nvml, visible, monkeypatch):
    nvml()
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", visible)
    assert Gpu().unavailable.startswith("no NVIDIA device: ")
    assert Gpu().states() == dict.fromkeys(SERIES, Gpu().unavailable)


WHOLE = ["gpu_percent", "gpu_power_w", "gpu_energy_j"]


@pytest.mark.parametrize(
    ("visible", "empty"),
    [
        ("MIG-33333333-cccc", dict.fromkeys(WHOLE, gpu_module.OF_ALL_PARTS)),
        (
            "0",
            dict.fromkeys(WHOLE, gpu_module.OF_ALL_PARTS)
            | dict.fromkeys(["gpu_memory_bytes", "gpu_process_memory_bytes"], gpu_module.UNNAMED_PART),
        ),
    ],
)
def test_mig(nvml, visible, empty, monkeypatch):
    """What is of all parts together is not told of one."""
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", visible)
    gpu, rows = watch(nvml(mig_part="MIG-33333333-cccc"), 1.5)
    assert {name: state for name, state in gpu.states().items() if state != "available"} == empty
    assert [name for name in SERIES if not told(rows, name)] == [name for name in SERIES if name in empty]
    identity = gpu.identity()
    assert identity["mig"] == "on" and identity["uuid"] == (visible if len(visible) > 1 else "GPU-11111111-aaaa")


def test_identity(nvml):
    nvml(errors={"nvmlDeviceGetEccMode": "NotSupported"})
    assert Gpu().identity() == {
        "name": "Trace of a GPU", "driver": "570.0", "uuid": "GPU-11111111-aaaa", "memory_bytes": 80_000_000_000,
        "power_limit_w": 700, "max_clock_mhz": 1980, "max_memory_clock_mhz": 2619, "mig": "off", "persistence": "on",
        "ecc": "unavailable: nvmlDeviceGetEccMode: not supported by this device",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("call", "kind", "reason"),
    [
        ("nvmlInit", "LibraryNotFound", "no NVIDIA driver: NVML Shared Library Not Found"),
        ("nvmlInit", "DriverNotLoaded", "no NVIDIA driver: Driver Not Loaded"),
        ("nvmlInit", "NoPermission", "no permission to use NVML: Insufficient Permissions"),
        ("nvmlDeviceGetHandleByIndex", "NotFound", "no NVIDIA device: Not Found"),
        ("nvmlDeviceGetHandleByIndex", "NoPermission", "no NVIDIA device: Insufficient Permissions"),
    ],
)
def test_no_driver_or_device(nvml, call, kind, reason):
    nvml(errors={call: kind})
    gpu = Gpu()
    assert gpu.unavailable == reason
    assert gpu.sample(frozenset(), 0.0) == (None,) * len(SERIES) and gpu.identity() is None and gpu.sources() == {}
    assert gpu.states() == dict.fromkeys(SERIES, reason)


def test_no_library(monkeypatch):
    monkeypatch.setitem(sys.modules, "pynvml", None)
    assert Gpu().unavailable == "nvidia-ml-py is not installed (pip install 'rayrace[gpu]')"
    assert Gpu().sample(frozenset(), 0.0) == (None,) * len(SERIES)


def test_the_trace_answers_as_the_real_module_does(nvml):
    """Names, parameters and numbers of errors."""
    real = pytest.importorskip("pynvml")
    module = nvml()
    names = [name for name in vars(module) if name.startswith("nvml") and callable(getattr(module, name))]
    assert len(names) > 20
    for name in names:
        mine, theirs = (list(inspect.signature(getattr(where, name)).parameters) for where in (module, real))
        assert mine == theirs, name
    for kind, (code, text) in module.CODES.items():
        error = real.NVMLError(code)
        assert type(error).__name__ == f"NVMLError_{kind}"
        assert str(error) == text and error.value == code
    assert not issubclass(real.NVMLLibraryMismatchError, real.NVMLError)
    ways = [way for column in columns.columns().values() for way in getattr(column, "ways", [])]
    ways += [*columns.IDENTITY.values(), columns.Way("nvmlDeviceGetSamples")]
    assert all(hasattr(real, way.call) and hasattr(module, way.call) for way in ways)
    assert (real.NVML_FI_DEV_POWER_INSTANT, real.NVML_GPU_UTILIZATION_SAMPLES) == (186, 1)
    assert (real.NVML_CLOCK_SM, real.NVML_CLOCK_MEM, real.NVML_TEMPERATURE_GPU) == (1, 2, 0)
    assert tuple(name for name, _ in real.c_nvmlValue_t._fields_) == columns.VALUES
    for bit, name in ((0x04, "SwPowerCap"), (0x20, "SwThermalSlowdown"), (0x80, "HwPowerBrakeSlowdown")):
        assert getattr(real, f"nvmlClocksEventReason{name}") == bit
