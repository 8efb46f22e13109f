"""Reads an array of a stored run, which may be a stranger's: no pickle, and no more numbers than the file has."""

import hashlib
import math
import os
from pathlib import Path
from typing import BinaryIO

import numpy as np

from harness.store import confined

LARGEST = 1 << 29  # bytes of an array: a picture of 4,700 x 4,700 pixels in float64
OTHER = "its bytes are not those that were judged (another SHA-256)"


def load(path: Path, sha256: str | None = None) -> np.ndarray:
    """Returns the array in an .npy file. sha256: of its numbers in memory.

    ValueError if it is no array, promises other than its file has, is too large, or is not the one of `sha256`.
    """
    with confined.opened(path) as file:
        shape, fortran, dtype = header(file)
        if dtype.kind not in "biuf":
            raise ValueError(f"an array of {dtype}")
        size, there = math.prod(shape) * dtype.itemsize, os.fstat(file.fileno()).st_size - file.tell()
        if size != there:
            raise ValueError(f"its header promises {size:,} bytes, and it has {there:,}")
        if size > LARGEST:
            raise ValueError(f"an array of {size:,} bytes, where rayrace reads {LARGEST:,} at most")
        array = np.frombuffer(file.read(size), dtype).reshape(shape, order="F" if fortran else "C")
    if sha256 is not None and hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest() != sha256:
        raise ValueError(OTHER)
    return array


def header(file: BinaryIO) -> tuple[tuple[int, ...], bool, np.dtype]:
    """Reads the header of an .npy file: shape, whether it is in Fortran's order, type. ValueError if it has none."""
    version = np.lib.format.read_magic(file)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    try:
        return read(file)
    except Exception as error:  # of any kind: numpy parses the header as Python
        raise ValueError(f"no header of an array: {error}") from None
