"""Scenes: reads them from files, checks, flattens and generates them."""

from pathlib import Path

from harness.errors import UserError
from harness.scene import check, methods, nff, text
from harness.scene.tokens import read_text

READERS = {".txt": text.read, ".nff": nff.read}


def load(path):
    """The `Scene` in a file, whose suffix selects the reader. UserError if it is missing or faulty."""
    path = Path(path)
    read = READERS.get(path.suffix.lower())
    if read is None and not path.is_dir():
        supported = f"supported: {', '.join(READERS)}"
        raise UserError(f'unknown kind of scene file "{path.suffix}"', file=path, remedy=supported)
    return read_text(path) if read is None else read(read_text(path), path)


def warnings(scene, jobs=(), free=()) -> list[str]:
    """Returns what is valid in a `Scene` and seldom meant, each with its place; then which methods of `jobs` do nothing
    in it, and what of it they leave out. free: names of methods that are still to be chosen.
    """
    doubts = methods.doubts(scene, jobs, free)
    return [*_oblique(scene), *(str(UserError(what, file=scene.file, remedy=remedy)) for what, remedy in doubts)]


def _oblique(scene) -> list[str]:
    camera = scene.camera
    angle = check.slant(camera.u, camera.v, camera.e)
    if not angle:
        return []
    what = f"the eye is {angle:.3g} degrees off the normal of the screen, so the perspective is oblique"
    remedy = "to have it straight, write the distance of the eye in place of e"
    return [str(UserError(what, file=scene.file, line=camera.line or None, remedy=remedy))]
