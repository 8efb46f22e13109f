"""Arrays of the job as nested lists, and back, without NumPy: this renderer is the standard library alone.

Source: the .npy format, version 1.0 (NumPy Enhancement Proposal 1).
"""

import ast
import sys
from array import array

MAGIC = b"\x93NUMPY\x01\x00"
CODES = {"<f8": "d", "<i4": "i", "<u4": "I"}


def read(path):
    """The array at `path`: a list of rows if it has two dimensions, a flat list if it has one."""
    with open(path, "rb") as file:
        if file.read(8) != MAGIC:
            raise ValueError(f"{path}: not a .npy file of version 1.0")
        header = ast.literal_eval(file.read(int.from_bytes(file.read(2), "little")).decode("latin-1"))
        if header["descr"] not in CODES or header["fortran_order"]:
            raise ValueError(f"{path}: expected <f8, <i4 or <u4 in C order, found {header}")
        values = array(CODES[header["descr"]])
        values.frombytes(file.read())
    if sys.byteorder == "big":
        values.byteswap()
    shape = header["shape"]
    if len(shape) == 1:
        return values.tolist()
    rows, columns = shape
    return [values[row * columns : (row + 1) * columns].tolist() for row in range(rows)]


def write(path, values, shape):
    """Write the floats of `values`, in C order, as float64 of `shape`."""
    header = repr({"descr": "<f8", "fortran_order": False, "shape": shape}).encode("latin-1")
    header += b" " * (-(len(MAGIC) + 2 + len(header) + 1) % 64) + b"\n"
    data = array("d", values)
    if sys.byteorder == "big":
        data.byteswap()
    with open(path, "wb") as file:
        file.write(MAGIC + len(header).to_bytes(2, "little") + header + data.tobytes())
