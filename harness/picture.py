"""Pictures in files: .png (sRGB, 8 bits), .exr (linear, float32), .npy (linear, as rendered)."""

from pathlib import Path

import numpy as np

from harness import colour
from harness.errors import UserError

SUFFIXES = (".png", ".exr", ".npy")


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
    if path.suffix == ".npy":
        np.save(path, linear)
    elif path.suffix == ".exr":
        import OpenEXR

        pixels = np.ascontiguousarray(linear, dtype=np.float32)
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        with OpenEXR.File(header, {"RGB": pixels}) as file:
            file.write(str(path))
    else:
        from PIL import Image

        Image.fromarray(colour.codes(linear, arithmetic)).save(path)
