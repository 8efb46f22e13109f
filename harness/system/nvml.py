"""Defines how each value is read from NVML, and the reasons why one is unavailable."""

import itertools
import statistics
from collections.abc import Callable
from dataclasses import dataclass

import psutil

AVAILABLE = "available"
SHORTEST_PERIOD, LONGEST_PERIOD = 1 / 6, 1.0  # s that a value of utilisation covers, by product

# Numbers of nvml.h, which not every release of nvidia-ml-py names.
UTILISATION_SAMPLES = 1
CLOCK_SM, CLOCK_MEMORY = 1, 2
SENSOR = 0
POWER_INSTANT = 186
VALUES = ("dVal", "uiVal", "ulVal", "ullVal", "sllVal", "siVal", "usVal")  # of the union nvmlValue_t, by its type
THROTTLE = {
    0x01: "idle", 0x02: "application clocks", 0x04: "software power cap", 0x08: "hardware slowdown", 0x10: "sync boost",
    0x20: "software thermal slowdown", 0x40: "hardware thermal slowdown", 0x80: "hardware power brake",
    0x100: "display clocks",
}  # fmt: skip
FUNCTION_NOT_FOUND = 13
REFUSALS = {  # errors that will recur at the next tick
    2: "not for this device (Invalid Argument)",
    3: "not supported by this device",
    4: "no permission",
    FUNCTION_NOT_FOUND: "not known to this driver or this nvidia-ml-py",
}
PASSING = {6: "no new sample in its buffer"}

HOST_PIDS = "NVML lists processes that do not exist here, perhaps by their numbers on the container's host (--pid host)"
NO_PROCESS = "NVML lists no process of the renderer"
NO_TICK = "the process ended before the first tick"
TOO_SOON = f"no new value: the device makes one every {SHORTEST_PERIOD:.2g} s to {LONGEST_PERIOD:g} s"


class Untold(Exception):
    """NVML's answer lacks the value; the text says why."""


@dataclass(frozen=True)
class Way:
    """A call of NVML. take: returns the value from its answer; window: s that the value covers."""

    call: str
    arguments: tuple = ()
    take: Callable = lambda answer, gpu: answer
    window: float = 0.0
    of_part: bool = False  # the call is for the MIG part, if there is one

    @property
    def name(self) -> str:
        return f"field {POWER_INSTANT}" if self.call == "nvmlDeviceGetFieldValues" else self.call


class Column:
    """A value, read in the first of its ways that works. refused: a reason why it is never read."""

    def __init__(self, *ways: Way, refused: str = ""):
        self.ways = list(ways)  # without those that driver or device refuse
        self.reasons = dict.fromkeys([refused] if refused else [])  # in order, each once
        self.used = None  # the way of the last value

    def read(self, gpu, *more):
        """The value now; None if it is unavailable. more: arguments of the call, before the way's own."""
        for way in tuple(self.ways):
            try:
                call = getattr(gpu.nvml, way.call, None)
                if call is None:
                    raise gpu.nvml.NVMLError(FUNCTION_NOT_FOUND)
                value = way.take(call(gpu.part if way.of_part else gpu.device, *more, *way.arguments), gpu)
            except Untold as error:
                self.reasons[str(error)] = None
            except gpu.errors as error:
                code = getattr(error, "value", FUNCTION_NOT_FOUND)
                self.reasons[f"{way.name}: {REFUSALS.get(code) or PASSING.get(code) or error}"] = None
                if code in REFUSALS:
                    self.ways.remove(way)
            else:
                self.used = way
                return value
        return None

    @property
    def state(self) -> str:
        """ "available" once there was a value, else the reasons."""
        return AVAILABLE if self.used else "; ".join(self.reasons) or NO_TICK

    @property
    def source(self) -> dict | None:
        """The NVML call of the values, and the seconds that each covers; None without values."""
        return {"call": self.used.name, "window_s": self.used.window} if self.used else None


class Utilisation:
    """The percentage of a sample period in which a kernel ran. The device makes one value in each period, which is
    returned once, when it is new.

    Values are from the device's buffer of samples; if that is empty or refused, from a reading once in the longest
    period.
    """

    def __init__(self):
        self.buffer = Column(Way("nvmlDeviceGetSamples", take=_samples))
        self.reading = Column(Way("nvmlDeviceGetUtilizationRates", take=lambda rates, gpu: rates.gpu))
        self.stamps = []  # us, on NVML's own clock
        self.last = None  # time (s) of the last value, or of the first call
        self.counted = False

    def read(self, gpu) -> float | None:
        """The value, if there is a new one."""
        fresh = self.buffer.read(gpu, UTILISATION_SAMPLES, self.stamps[-1] if self.stamps else 0) or []
        self.stamps += [stamp for stamp, _ in fresh]
        if self.last is None:  # the buffer has values from before the first call
            self.last = gpu.now
        elif fresh:
            self.last, self.counted = gpu.now, True
            return statistics.fmean(value for _, value in fresh)
        elif gpu.now - self.last >= LONGEST_PERIOD:
            self.last = gpu.now
            return self.reading.read(gpu)
        return None

    @property
    def state(self) -> str:
        if self.counted or self.reading.used:
            return AVAILABLE
        if not self.reading.reasons:  # not called yet
            return NO_TICK if self.last is None else TOO_SOON
        return "; ".join([*self.buffer.reasons, *self.reading.reasons])

    @property
    def source(self) -> dict | None:
        if self.reading.used:
            calls = ["nvmlDeviceGetSamples"] * self.counted + ["nvmlDeviceGetUtilizationRates"]
            return {"call": " and ".join(calls), "window_s": LONGEST_PERIOD}
        if not self.counted:
            return None
        gaps = [(b - a) * 1e-6 for a, b in itertools.pairwise(self.stamps)]
        window = max(SHORTEST_PERIOD, statistics.median(gaps)) if gaps else LONGEST_PERIOD
        return {"call": "nvmlDeviceGetSamples", "window_s": window}


def columns() -> dict[str, Column | Utilisation]:
    """A new column for each name of gpu.SERIES."""
    return {
        "gpu_percent": Utilisation(),
        "gpu_memory_bytes": Column(Way("nvmlDeviceGetMemoryInfo", (), lambda memory, gpu: memory.used, of_part=True)),
        "gpu_process_memory_bytes": Column(
            Way("nvmlDeviceGetComputeRunningProcesses", (), _process_memory, of_part=True)
        ),
        "gpu_power_w": Column(
            Way("nvmlDeviceGetFieldValues", ([POWER_INSTANT],), _instant_power),
            Way("nvmlDeviceGetPowerUsage", (), _thousandth, window=1.0),  # a mean from Ampere on
        ),
        "gpu_energy_j": Column(Way("nvmlDeviceGetTotalEnergyConsumption", (), _thousandth)),
        "gpu_clock_mhz": Column(Way("nvmlDeviceGetClockInfo", (CLOCK_SM,))),
        "gpu_memory_clock_mhz": Column(Way("nvmlDeviceGetClockInfo", (CLOCK_MEMORY,))),
        "gpu_temperature_c": Column(
            Way("nvmlDeviceGetTemperatureV", (SENSOR,)), Way("nvmlDeviceGetTemperature", (SENSOR,))
        ),
        "gpu_throttle": Column(
            Way("nvmlDeviceGetCurrentClocksEventReasons", (), _throttle),
            Way("nvmlDeviceGetCurrentClocksThrottleReasons", (), _throttle),  # its older name
        ),
    }


IDENTITY = {
    "name": Way("nvmlDeviceGetName"),
    "uuid": Way("nvmlDeviceGetUUID", of_part=True),
    "memory_bytes": Way("nvmlDeviceGetMemoryInfo", (), lambda memory, gpu: memory.total, of_part=True),
    "power_limit_w": Way("nvmlDeviceGetEnforcedPowerLimit", (), lambda milliwatts, gpu: milliwatts / 1000),
    "max_clock_mhz": Way("nvmlDeviceGetMaxClockInfo", (CLOCK_SM,)),
    "max_memory_clock_mhz": Way("nvmlDeviceGetMaxClockInfo", (CLOCK_MEMORY,)),
    "persistence": Way("nvmlDeviceGetPersistenceMode", (), lambda on, gpu: "on" if on else "off"),
    "ecc": Way("nvmlDeviceGetEccMode", (), lambda modes, gpu: "on" if modes[0] else "off"),
}


def _thousandth(value: int, gpu) -> float:
    return value / 1000


def _instant_power(fields, gpu) -> float:
    (field,) = fields
    if field.nvmlReturn != 0:
        raise gpu.nvml.NVMLError(field.nvmlReturn)
    return getattr(field.value, VALUES[field.valueType]) / 1000


def _samples(answer, gpu) -> list[tuple[int, float]]:
    """(stamp, value), oldest first."""
    kind, samples = answer
    return sorted((sample.timeStamp, getattr(sample.sampleValue, VALUES[kind])) for sample in samples)


def _process_memory(listed, gpu) -> int:
    own = [process.usedGpuMemory for process in listed if process.pid in gpu.pids]
    if not own:
        raise Untold(NO_PROCESS if all(psutil.pid_exists(process.pid) for process in listed) else HOST_PIDS)
    if None in own:
        raise Untold("NVML does not report the memory of single processes here")
    return sum(own)


def _throttle(reasons: int, gpu) -> str:
    bits = [1 << n for n in range(reasons.bit_length()) if reasons >> n & 1]
    return "; ".join(THROTTLE.get(bit, hex(bit)) for bit in bits) or "none"
