"""Reads arrays as lists of rows and writes the picture, with the standard library alone: PyPy has no NumPy.

Source: the .npy format, version 1.0 (NumPy Enhancement Proposal 1).
"""

import ast
import sys
from array import array

MAGIC = b"\x93NUMPY\x01\x00"
KINDS = {"<f8": "d", "<i4": "i"}


def read(path):
    """The array at `path`: rows, or numbers if it has one dimension."""
    with open(path, "rb") as file:
        if file.read(len(MAGIC)) != MAGIC:
            raise ValueError(f"{path}: not a .npy file of version 1.0")
        header = ast.literal_eval(file.read(int.from_bytes(file.read(2), "little")).decode("latin-1"))
        numbers = array(KINDS[header["descr"]], file.read())
    if sys.byteorder == "big":
        numbers.byteswap()
    *rows, width = header["shape"]
    numbers = numbers.tolist()
    return [numbers[row * width : (row + 1) * width] for row in range(rows[0])] if rows else numbers


def write(path, numbers, shape):
    """Write numbers, in C order, as float64 of `shape`."""
    header = repr({"descr": "<f8", "fortran_order": False, "shape": shape}).encode("latin-1")
    header += b" " * (-(len(MAGIC) + len(header) + 3) % 64) + b"\n"
    data = array("d", numbers)
    if sys.byteorder == "big":
        data.byteswap()
    with open(path, "wb") as file:
        file.write(MAGIC + len(header).to_bytes(2, "little") + header)
        data.tofile(file)
