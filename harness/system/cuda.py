"""Asks the CUDA driver for devices, once a process and only on demand."""

import functools
import os

SIMULATOR = "RAYRACE_CUDASIM"
MISSING = f"no CUDA device (simulator: {SIMULATOR}=1)"
DRIVERS = ("libcuda.so.1", "libcuda.so", "nvcuda.dll")


def simulated() -> bool:
    """Are renderers of device cuda to run in the simulator, whether there is a device or not?"""
    return os.environ.get(SIMULATOR) == "1"


@functools.cache
def devices() -> int:
    """How many devices the driver shows; 0 without a driver."""
    import ctypes

    count = ctypes.c_int(0)
    for name in DRIVERS:
        try:
            driver = ctypes.CDLL(name)
            found = driver.cuInit(0) == 0 and driver.cuDeviceGetCount(ctypes.byref(count)) == 0
        except (OSError, AttributeError):  # no such library; another one of that name
            continue
        return count.value if found else 0
    return 0
