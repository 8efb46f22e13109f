"""Checks whether the GPU is fit to measure: findings for the doctor."""

from harness.system import nvml, opencl
from harness.system.finding import UNAVAILABLE, Finding, judged, unknown
from harness.system.gpu import Gpu

FREE = ("none", "idle", "application clocks")  # throttle reasons that do not slow work down
CLOCK = nvml.Way("nvmlDeviceGetClockInfo", (nvml.CLOCK_SM,))
USERS = nvml.Way("nvmlDeviceGetComputeRunningProcesses", (), lambda listed, gpu: len(listed), of_part=True)


def findings() -> list[Finding]:
    """All findings about GPUs, and the devices of OpenCL."""
    return [*of_nvidia(), of_opencl()]


def of_opencl() -> Finding:
    devices = opencl.devices()
    if isinstance(devices, str):
        return unknown("OpenCL devices", devices)
    return Finding("good", "OpenCL devices", "; ".join(f"{number}: {name}" for number, name in enumerate(devices)))


def of_nvidia() -> list[Finding]:
    gpu = Gpu()
    if gpu.unavailable:
        return [unknown("GPU", gpu.unavailable, "without an NVIDIA driver the GPU columns stay empty")]
    facts = gpu.identity()
    device = f"{facts['name']}, driver {facts['driver']}"
    return [Finding("good", "GPU", device), persistence(facts["persistence"]), clocks(gpu, facts), users(gpu)]


def persistence(value: str) -> Finding:
    what = "GPU persistence"
    if value.startswith(UNAVAILABLE):
        return unknown(what, value)
    return judged(value == "on", what, value, "the first process waits for the driver: sudo nvidia-smi -pm 1")


def clocks(gpu: Gpu, facts: dict) -> Finding:
    what, now, throttle = "GPU clocks", nvml.Column(CLOCK), nvml.columns()["gpu_throttle"]
    mhz, reasons = now.read(gpu), throttle.read(gpu)
    if mhz is None or reasons is None:
        return unknown(what, now.state if mhz is None else throttle.state)
    state = f"{mhz} of {facts['max_clock_mhz']} MHz now, held back by: {reasons}"
    good = all(reason in FREE for reason in reasons.split("; "))
    return judged(good, what, state, "cool it, or fix the clock: sudo nvidia-smi -lgc MHZ (-rgc undoes it)")


def users(gpu: Gpu) -> Finding:
    what, column = "other programs on the GPU", nvml.Column(USERS)
    count = column.read(gpu)
    if count is None:
        return unknown(what, column.state)
    return judged(count == 0, what, f"{count} processes", "end them: nvidia-smi lists them")
