"""NVML for tests: the module pynvml, replaying a trace against the clock.

Put this folder first on PYTHONPATH, and the real measurer and harness replay $NVML_TRACE, else trace.json beside this
file, which tells its keys. test_gpu.py compares names and signatures with the real module.
"""

import functools
import json
import math
import os
import sys
import time
from pathlib import Path
from time import sleep
from types import SimpleNamespace

TRACE = json.loads(Path(os.environ.get("NVML_TRACE") or Path(__file__).with_name("trace.json")).read_text())
ORIGIN = TRACE["origin_s"] if TRACE["origin_s"] is not None else time.monotonic()
ROWS = [dict(zip(TRACE["columns"], row, strict=True)) for row in TRACE["rows"]]
STAMP = 7_000_000_000  # us: NVML's stamps are on a clock of its own
IS_MEASURER = "harness.process.measurer" in sys.orig_argv

NVML_SUCCESS = 0
CODES = {
    "InvalidArgument": (2, "Invalid Argument"),
    "NotSupported": (3, "Not Supported"),
    "NoPermission": (4, "Insufficient Permissions"),
    "NotFound": (6, "Not Found"),
    "DriverNotLoaded": (9, "Driver Not Loaded"),
    "LibraryNotFound": (12, "NVML Shared Library Not Found"),
    "FunctionNotFound": (13, "Function Not Found"),
    "GpuIsLost": (15, "GPU is lost"),
}


class NVMLLibraryMismatchError(Exception):
    pass


class NVMLError(Exception):
    def __init__(self, value):
        super().__init__(value)
        self.value = value

    def __str__(self):
        return dict(CODES.values())[self.value]


def _refuse(name):
    if name in TRACE["errors"]:
        kind = TRACE["errors"][name]
        raise NVMLLibraryMismatchError("too old") if kind == "LibraryMismatch" else NVMLError(CODES[kind][0])


def _seconds():
    return time.monotonic() - ORIGIN


def _at(seconds):
    """The row in force at a time of the trace, which repeats."""
    place = seconds % TRACE["period_s"]
    return [row for row in ROWS if row["t_s"] <= place][-1]


def integral(column, end):
    """Of a column from 0 to `end` (s)."""
    edges = [row["t_s"] for row in ROWS] + [TRACE["period_s"]]
    period, place = divmod(end, TRACE["period_s"])

    def upto(place):
        return sum(row[column] * max(0.0, min(b, place) - a) for row, a, b in zip(ROWS, edges, edges[1:], strict=False))

    return period * upto(TRACE["period_s"]) + upto(place)


def _percent(end):
    """Share of the sample period before `end` in which a kernel ran."""
    start = max(0.0, end - TRACE["sample_period_s"])
    return round(100 * (integral("busy", end) - integral("busy", start)) / (end - start)) if end > start else 0


def _value(number):
    return SimpleNamespace(uiVal=number, dVal=math.nan)


def nvmlInit():
    _refuse("nvmlInit")


def nvmlSystemGetDriverVersion():
    _refuse("nvmlSystemGetDriverVersion")
    return TRACE["driver"]


def nvmlDeviceGetCount():
    return len(TRACE["uuids"])


def nvmlDeviceGetHandleByIndex(index):
    _refuse("nvmlDeviceGetHandleByIndex")
    if index >= len(TRACE["uuids"]):
        raise NVMLError(2)
    return TRACE["uuids"][index]


def nvmlDeviceGetHandleByUUID(uuid):
    if uuid != TRACE["mig_part"]:
        raise NVMLError(6)
    return uuid


def nvmlDeviceGetDeviceHandleFromMigDeviceHandle(migDevice):
    return TRACE["uuids"][0]


def nvmlDeviceGetMigMode(device):
    _refuse("nvmlDeviceGetMigMode")
    return [int(TRACE["mig_part"] is not None)] * 2


def nvmlDeviceGetName(handle):
    return TRACE["name"]


def nvmlDeviceGetUUID(handle):
    return handle


def nvmlDeviceGetEnforcedPowerLimit(handle):
    _refuse("nvmlDeviceGetEnforcedPowerLimit")
    return TRACE["power_limit_w"] * 1000


def nvmlDeviceGetMaxClockInfo(handle, type):
    return TRACE["max_clocks_mhz"][type]


def nvmlDeviceGetPersistenceMode(handle):
    return 1


def nvmlDeviceGetEccMode(handle):
    _refuse("nvmlDeviceGetEccMode")
    return [1, 1]


def nvmlDeviceGetMemoryInfo(handle, version=None):
    _refuse("nvmlDeviceGetMemoryInfo")
    return SimpleNamespace(total=TRACE["memory_bytes"], used=_at(_seconds())["memory_bytes"])


def nvmlDeviceGetComputeRunningProcesses(handle):
    _refuse("nvmlDeviceGetComputeRunningProcesses")
    memory = _at(_seconds())["process_bytes"]
    pid = TRACE["process"]
    if pid == "file":
        file = Path(os.environ["HOME"]) / "renderer.pid"
        pid = int(file.read_text() or 0) if file.exists() else None
    return [] if pid is None or not memory else [SimpleNamespace(pid=pid, usedGpuMemory=memory)]


def nvmlDeviceGetSamples(device, sampling_type, timeStamp):
    _refuse("nvmlDeviceGetSamples")
    period = TRACE["sample_period_s"]
    newest = math.floor(_seconds() / period)
    all_stamps = [(STAMP + round(n * period * 1e6), n * period) for n in range(max(1, newest - 50), newest + 1)]
    fresh = [(stamp, end) for stamp, end in all_stamps if stamp > timeStamp]
    if not fresh or sampling_type != 1:
        raise NVMLError(6)
    return 1, [SimpleNamespace(timeStamp=stamp, sampleValue=_value(_percent(end))) for stamp, end in fresh]


def nvmlDeviceGetUtilizationRates(handle):
    _refuse("nvmlDeviceGetUtilizationRates")
    return SimpleNamespace(gpu=_percent(_seconds()), memory=0)


def nvmlDeviceGetFieldValues(handle, fieldIds):
    _refuse("nvmlDeviceGetFieldValues")
    told = []
    for _ in fieldIds:
        code = CODES[TRACE["errors"]["field 186"]][0] if "field 186" in TRACE["errors"] else 0
        told.append(SimpleNamespace(nvmlReturn=code, valueType=1, value=_value(_at(_seconds())["power_w"] * 1000)))
    assert list(fieldIds) == [186]
    return told


def nvmlDeviceGetPowerUsage(handle):
    """The mean of the last second."""
    _refuse("nvmlDeviceGetPowerUsage")
    end = max(_seconds(), 1.0)
    return round(1000 * (integral("power_w", end) - integral("power_w", end - 1)))


def nvmlDeviceGetTotalEnergyConsumption(handle):
    _refuse("nvmlDeviceGetTotalEnergyConsumption")
    first_sample[:] = first_sample or [_seconds()]  # nobody else asks for energy
    step = TRACE["energy_step_s"]
    return round(1000 * (1e6 + integral("power_w", math.floor(_seconds() / step) * step)))


def nvmlDeviceGetClockInfo(handle, type):
    _refuse("nvmlDeviceGetClockInfo")
    return _at(_seconds())[{1: "sm_mhz", 2: "memory_mhz"}[type]]


def nvmlDeviceGetTemperatureV(handle, sensor, version=None):
    _refuse("nvmlDeviceGetTemperatureV")
    return _at(_seconds())["temperature_c"]


def nvmlDeviceGetTemperature(handle, sensor):
    _refuse("nvmlDeviceGetTemperature")
    return _at(_seconds())["temperature_c"]


def nvmlDeviceGetCurrentClocksEventReasons(handle):
    _refuse("nvmlDeviceGetCurrentClocksEventReasons")
    return _at(_seconds())["reasons"]


def nvmlDeviceGetCurrentClocksThrottleReasons(handle):
    _refuse("nvmlDeviceGetCurrentClocksThrottleReasons")
    return _at(_seconds())["reasons"]


first_sample = []  # the time of it (s)


def _is_lost(fault):
    """Whether from_s have passed: in the measurer since its first sample, however long it took to get there."""
    if not IS_MEASURER or fault["from_s"] < 0:
        return _seconds() >= fault["from_s"]
    return first_sample and _seconds() - first_sample[0] >= fault["from_s"]


def _mortal(call):
    """`call`, which fails from some time on; what is worse than an error happens in the measurer alone."""

    @functools.wraps(call)
    def ask(*arguments, **named):
        fault = TRACE.get("fault")
        if fault and _is_lost(fault):
            if fault["kind"] in CODES:
                raise NVMLError(CODES[fault["kind"]][0])
            if IS_MEASURER:
                sleep(1000) if fault["kind"] == "hangs" else os.abort()
        return call(*arguments, **named)

    return ask


for _name in [name for name in globals() if name.startswith("nvml")]:
    globals()[_name] = _mortal(globals()[_name])
for _name in TRACE["absent"]:
    del globals()[_name]
