"""Scenes: reads them from files, checks, flattens and generates them."""

from pathlib import Path

from harness import textfile
from harness.errors import UserError
from harness.scene import nff, text
from harness.scene.doubts import warnings

__all__ = ["READERS", "load", "warnings"]

READERS = {".txt": text.read, ".nff": nff.read}


def load(path):
    """The `Scene` in a file, whose suffix selects the reader. UserError if it is missing or faulty."""
    path = Path(path)
    read = READERS.get(path.suffix.lower())
    if read is None and not path.is_dir():
        supported = f"supported: {', '.join(READERS)}"
        raise UserError(f'unknown kind of scene file "{path.suffix}"', file=path, remedy=supported)
    return textfile.read(path) if read is None else read(textfile.read(path), path)
