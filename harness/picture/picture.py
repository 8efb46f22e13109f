"""Writes pictures: .png (sRGB, 8 bits), .exr (linear, float32), .npy and .tif (linear, as rendered)."""

import tempfile
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from harness.errors import UserError, missing
from harness.picture import colour
from harness.system import output

SUFFIXES = (".png", ".exr", ".npy", ".tif")
LIBRARIES = {".exr": ("OpenEXR", "exr"), ".tif": ("tifffile", "tiff")}  # optional module, and the extra that has it


def check_suffix(path: Path) -> None:
    """UserError if no picture can be saved at `path`: unknown suffix, no such folder, or a library is not installed."""
    if path.suffix not in SUFFIXES:
        choices = f"known: {', '.join(SUFFIXES)}, .pov for a scene"
        raise UserError(f'{path}: unknown kind of picture "{path.suffix}"; {choices}')
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
    if path.suffix == ".npy":
        output.write(path, lambda file: np.save(file, linear), own=False)
    elif path.suffix == ".tif":
        import tifffile

        # Without compression, as the output of zlib differs between versions.
        tags = {"photometric": "rgb", "planarconfig": "contig", "metadata": None, "software": False}
        output.write(path, lambda file: tifffile.imwrite(file, linear, byteorder="<", **tags), own=False)
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
