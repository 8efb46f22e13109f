"""Asks the CUDA driver for devices, once in a process and only on demand."""

import functools
import os

SIMULATOR = "RAYRACE_CUDASIM"
NO_DEVICE = "no CUDA device"
MISSING = f"{NO_DEVICE} (simulator: {SIMULATOR}=1)"
DRIVERS = ("libcuda.so.1", "libcuda.so", "nvcuda.dll")


def simulated() -> bool:
    """Whether renderers of device cuda run in the simulator, even if there is a device."""
    return os.environ.get(SIMULATOR) == "1"


@functools.cache
def devices() -> int:
    """The number of devices that the driver reports; 0 without a driver."""
    import ctypes

    count = ctypes.c_int(0)
    for name in DRIVERS:
        try:
            driver = ctypes.CDLL(name)
            success = driver.cuInit(0) == 0 and driver.cuDeviceGetCount(ctypes.byref(count)) == 0
        except (OSError, AttributeError):  # no such library, or another one of that name
            continue
        return count.value if success else 0
    return 0
