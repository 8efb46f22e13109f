"""Finds out whether there is a driver of OpenCL, without loading one: that starts threads."""

import importlib.util
import os
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
