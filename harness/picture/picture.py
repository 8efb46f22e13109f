"""Writes pictures: .png (sRGB, 8 bits), .exr (linear, float32), .npy and .tif (linear, as rendered).

The last two are for pictures of any size: they can be written while only a small part of the picture is in memory.
"""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np

from harness.errors import UserError, missing
from harness.picture import colour
from harness.store.store import write_part

SUFFIXES = (".png", ".exr", ".npy", ".tif")
ANY_SIZE = (".tif", ".npy")
BLOCK = 256  # pixels: side of the blocks that a .tif consists of (TIFF calls them tiles), where it is not smaller
BAND = 2**24  # bytes of a .npy that are in memory at a time, if a row of pixels is not longer
CLASSIC = 2**32 - 2**25  # bytes of pixels up to which a .tif is a classic one, whose offsets have 32 bits; then BigTIFF

# crop(x0, y0, x1, y1): those pixels of a picture, half open, shape (y1 - y0, x1 - x0, 3)
Crop = Callable[[int, int, int, int], np.ndarray]


def check_suffix(path: Path) -> None:
    """UserError unless a picture can be saved at `path`."""
    if path.suffix not in SUFFIXES:
        known = f"known: {', '.join(SUFFIXES)}, .pov for a scene"
        raise UserError(f'{path}: unknown kind of picture "{path.suffix}"; {known}')
    check_folder(path)


def check_folder(path: Path) -> None:
    """UserError unless the folder of a file to be written is there."""
    if not path.parent.is_dir():
        raise UserError(f"{path.parent}: no such folder")


def save(path: Path, linear: np.ndarray, arithmetic: str = "linear") -> None:
    """Save a picture of RGB, shape (height, width, 3), row 0 on top; `arithmetic` as in the experiment."""
    if path.suffix in ANY_SIZE:
        write(path, *linear.shape[:2], linear.dtype, lambda x0, y0, x1, y1: linear[y0:y1, x0:x1])
    elif path.suffix == ".exr":
        try:
            import OpenEXR
        except ImportError:
            raise missing("OpenEXR, which writes .exr,", "exr") from None

        pixels = np.ascontiguousarray(linear, dtype=np.float32)
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        with OpenEXR.File(header, {"RGB": pixels}) as file:
            file.write(str(path))
    else:
        from PIL import Image

        Image.fromarray(colour.codes(linear, arithmetic)).save(path)


def write(path: Path, height: int, width: int, dtype: np.dtype, crop: Crop) -> None:
    """Write a .tif or .npy of linear RGB, row 0 on top, crop by crop; it is there whole or not at all.

    Its bytes depend on the pixels alone: not on the time, nor on how the picture was come by.
    """
    kind = _write_tif if path.suffix == ".tif" else _write_npy
    write_part(path, lambda file: kind(file, height, width, np.dtype(dtype), crop), own=False)


def _write_npy(file: BinaryIO, height: int, width: int, dtype: np.dtype, crop: Crop) -> None:
    descr = np.lib.format.dtype_to_descr(dtype)
    header = {"descr": descr, "fortran_order": False, "shape": (height, width, 3)}
    np.lib.format.write_array_header_1_0(file, header)
    rows = max(1, BAND // (width * 3 * dtype.itemsize))
    for y in range(0, height, rows):
        file.write(np.ascontiguousarray(crop(0, y, width, min(y + rows, height))))


def _write_tif(file: BinaryIO, height: int, width: int, dtype: np.dtype, crop: Crop) -> None:
    """Not compressed: what zlib makes of pixels differs from version to version."""
    try:
        import tifffile
    except ImportError:
        raise missing("tifffile, which writes .tif,", "tiff") from None

    rows, columns = (min(BLOCK, -(-side // 16) * 16) for side in (height, width))  # multiples of 16, says TIFF
    blocks = -(-height // rows) * -(-width // columns)
    is_big = blocks * rows * columns * 3 * dtype.itemsize > CLASSIC

    def each() -> Iterator[np.ndarray]:
        for y in range(0, height, rows):
            for x in range(0, width, columns):
                yield crop(x, y, min(x + columns, width), min(y + rows, height))

    with tifffile.TiffWriter(file, bigtiff=is_big, byteorder="<") as tif:
        tif.write(
            each(), shape=(height, width, 3), dtype=dtype, tile=(rows, columns), photometric="rgb",
            planarconfig="contig", metadata=None, software=False, maxworkers=1,
        )  # fmt: skip
