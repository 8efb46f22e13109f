import sys
from types import ModuleType, SimpleNamespace

import pytest

from harness.gpu import SERIES, Gpu


@pytest.fixture
def nvml(monkeypatch):
    """A pynvml of one device that tells everything."""
    module = ModuleType("pynvml")
    module.NVMLError = type("NVMLError", (Exception,), {})
    module.NVML_CLOCK_SM = 1
    module.nvmlInit = lambda: None
    module.nvmlDeviceGetHandleByIndex = lambda index: f"handle {index}"
    module.nvmlDeviceGetName = lambda handle: "H"
    module.nvmlSystemGetDriverVersion = lambda: "550"
    module.nvmlDeviceGetUUID = lambda handle: "GPU-1"
    module.nvmlDeviceGetMemoryInfo = lambda handle: SimpleNamespace(total=100, used=40)
    module.nvmlDeviceGetUtilizationRates = lambda handle: SimpleNamespace(gpu=63)
    module.nvmlDeviceGetPowerUsage = lambda handle: 71500
    module.nvmlDeviceGetClockInfo = lambda handle, clock: 1980 if clock == 1 else 0
    monkeypatch.setitem(sys.modules, "pynvml", module)
    return module


def fails(module):
    def fail(*_):
        raise module.NVMLError("Not Supported")

    return fail


def test_all_told(nvml):
    gpu = Gpu()
    assert gpu.unavailable is None
    assert dict(zip(SERIES, gpu.sample(), strict=True)) == {
        "gpu_percent": 63, "gpu_memory_bytes": 40, "gpu_power_w": 71.5, "gpu_clock_mhz": 1980,
    }  # fmt: skip
    assert gpu.identity() == {"name": "H", "driver": "550", "uuid": "GPU-1", "memory_bytes": 100}


@pytest.mark.parametrize(
    ("question", "column"),
    [("UtilizationRates", 0), ("MemoryInfo", 1), ("PowerUsage", 2), ("ClockInfo", 3)],
)
def test_what_is_not_told_is_none_and_the_rest_is_there(nvml, question, column):
    setattr(nvml, f"nvmlDeviceGet{question}", fails(nvml))
    sample = Gpu().sample()
    assert [n for n, value in enumerate(sample) if value is None] == [column]


@pytest.mark.parametrize("call", ["nvmlInit", "nvmlDeviceGetHandleByIndex"])
def test_no_driver_or_device(nvml, call):
    setattr(nvml, call, fails(nvml))
    gpu = Gpu()
    assert gpu.unavailable == "no NVIDIA driver or device: Not Supported"
    assert gpu.sample() == (None,) * len(SERIES) and gpu.identity() is None


def test_no_library(monkeypatch):
    monkeypatch.setitem(sys.modules, "pynvml", None)
    assert Gpu().unavailable == "nvidia-ml-py is not installed (pip install nvidia-ml-py)"
    assert Gpu().sample() == (None,) * len(SERIES)
