"""Writes pictures: .png (sRGB, 8 bits), .exr (linear, float32), .npy and .tif (linear, as rendered).

The last two suit pictures of any size: only a small part of the picture is in memory while it is written.
"""

import tempfile
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import BinaryIO

import numpy as np

from harness.errors import UserError, missing
from harness.picture import colour
from harness.system import output

SUFFIXES = (".png", ".exr", ".npy", ".tif")
ANY_SIZE = (".tif", ".npy")
LIBRARIES = {".exr": ("OpenEXR", "exr"), ".tif": ("tifffile", "tiff")}  # optional module, and the extra that has it
BLOCK = 256  # pixels: largest side of the blocks of a .tif (TIFF calls them tiles)
BAND = 2**24  # bytes of a .npy in memory at a time, but at least one row of pixels
CLASSIC = 2**32 - 2**25  # bytes of pixels up to which a .tif is classic, with offsets of 32 bits; larger: BigTIFF

# crop(x0, y0, x1, y1) returns these pixels of a picture, half open, shape (y1 - y0, x1 - x0, 3)
Crop = Callable[[int, int, int, int], np.ndarray]


def check_suffix(path: Path) -> None:
    """UserError if no picture can be saved at `path`: unknown suffix, no such folder, or a library is not installed."""
    if path.suffix not in SUFFIXES:
        known = f"known: {', '.join(SUFFIXES)}, .pov for a scene"
        raise UserError(f'{path}: unknown kind of picture "{path.suffix}"; {known}')
    check_folder(path)
    module, extra = LIBRARIES.get(path.suffix, (None, None))
    if module and find_spec(module) is None:
        raise missing(f"{module}, which writes {path.suffix},", extra)


def check_folder(path: Path) -> None:
    """UserError if the folder of `path` does not exist."""
    if not path.parent.is_dir():
        raise UserError(f"{path.parent}: no such folder")


def save(path: Path, linear: np.ndarray, arithmetic: str = "linear") -> None:
    """Saves an RGB picture, shape (height, width, 3), row 0 on top. arithmetic: as in the experiment."""
    if path.suffix in ANY_SIZE:
        write(path, *linear.shape[:2], linear.dtype, lambda x0, y0, x1, y1: linear[y0:y1, x0:x1])
    elif path.suffix == ".exr":
        import OpenEXR

        pixels = np.ascontiguousarray(linear, dtype=np.float32)
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        with tempfile.TemporaryDirectory() as here, OpenEXR.File(header, {"RGB": pixels}) as made:
            made.write(f"{here}/picture.exr")  # it takes names alone
            content = Path(here, "picture.exr").read_bytes()
        output.data(path, content, own=False)
    else:
        from PIL import Image

        image = Image.fromarray(colour.codes(linear, arithmetic))
        output.write(path, lambda file: image.save(file, "PNG"), own=False)


def write(path: Path, height: int, width: int, dtype: np.dtype, crop: Crop) -> None:
    """Writes a .tif or .npy of linear RGB, row 0 on top, crop by crop; the file exists whole or not at all.

    Its bytes depend on the pixels alone.
    """
    kind = _write_tif if path.suffix == ".tif" else _write_npy
    output.write(path, lambda file: kind(file, height, width, np.dtype(dtype), crop), own=False)


def _write_npy(file: BinaryIO, height: int, width: int, dtype: np.dtype, crop: Crop) -> None:
    descr = np.lib.format.dtype_to_descr(dtype)
    header = {"descr": descr, "fortran_order": False, "shape": (height, width, 3)}
    np.lib.format.write_array_header_1_0(file, header)
    rows = max(1, BAND // (width * 3 * dtype.itemsize))
    for y in range(0, height, rows):
        file.write(np.ascontiguousarray(crop(0, y, width, min(y + rows, height))))


def _write_tif(file: BinaryIO, height: int, width: int, dtype: np.dtype, crop: Crop) -> None:
    """Writes without compression, as the output of zlib differs between versions."""
    import tifffile

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
