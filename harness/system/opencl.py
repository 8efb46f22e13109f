"""Finds out which drivers and devices of OpenCL there are, without loading a driver into this process."""

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

MISSING = "no OpenCL driver: install that of your GPU, or PoCL for the processor (Debian: apt install pocl-opencl-icd)"
FOLDER = "OCL_ICD_VENDORS"  # of the loader that PyOpenCL has; where it looks for drivers
USUAL = Path("/etc/OpenCL/vendors")
PACKAGES = ("pocl_binary_distribution", "pocl")  # of PyPI, which PyOpenCL finds too


def drivers() -> bool:
    """Whether a driver is registered. True where the system has another way to register them than Linux."""
    if os.name != "posix" or os.uname().sysname != "Linux":
        return True
    given = os.environ.get(FOLDER)
    if given and Path(given).is_file():
        return True
    folder = Path(given) if given else USUAL
    if any(folder.glob("*.icd")):
        return True
    return not given and any(importlib.util.find_spec(name) for name in PACKAGES)


# In a process of its own, as drivers start threads and may crash.
LIST = """
import json, pyopencl
print(json.dumps([device.name.strip() for platform in pyopencl.get_platforms() for device in platform.get_devices()]))
"""
TIMEOUT = 60.0  # s


def devices() -> list[str] | str:
    """Names of the devices, in the order of their numbers; or why there are none."""
    if not importlib.util.find_spec("pyopencl"):
        return "no Python module pyopencl (pip install 'rayrace[opencl]')"
    if not drivers():
        return MISSING
    try:
        done = subprocess.run([sys.executable, "-c", LIST], capture_output=True, text=True, timeout=TIMEOUT)
    except subprocess.TimeoutExpired:
        return f"a driver did not answer in {TIMEOUT:g} s"
    if done.returncode:
        return (done.stderr.strip().splitlines() or [f"a driver ended the process: status {done.returncode}"])[-1]
    return json.loads(done.stdout) or MISSING
