"""Hashes the data of figures, whatever their look, and compares a report with an older one."""

import csv
import hashlib
import json
from importlib.metadata import version
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from harness.errors import UserError
from harness.store import clean, confined
from harness.system import output

COMMAND = "rayrace report RUN"
LONGEST = 1 << 20  # bytes of the facts of a figure
PACKAGES = ("rayrace", "matplotlib", "numpy", "scipy")


def fingerprint(figure: Figure) -> str:
    """Returns the SHA-256 of a figure's numbers and texts: lines, patches, collections, pictures, scales and limits.

    Numbers are rounded to float32, so that the last bits of another version of a library do not change the hash. Ticks
    and the places of legends are left out.
    """
    digest = hashlib.sha256()

    def numbers(values) -> None:
        values = np.ma.filled(np.ma.masked_invalid(np.ma.asarray(values, dtype=np.float64)), np.nan)
        digest.update(repr(values.shape).encode())
        digest.update((values.astype(np.float32) + 0).tobytes())  # + 0: -0 is 0

    def texts(*words: str) -> None:
        digest.update("\0".join(words).encode())

    texts(*(text.get_text() for text in figure.texts))
    for axes in figure.axes:
        texts(axes.get_title(), axes.get_title("left"), axes.get_title("right"), axes.get_xlabel(), axes.get_ylabel())
        texts(axes.get_xscale(), axes.get_yscale(), *(text.get_text() for text in axes.texts))
        numbers([axes.get_xlim(), axes.get_ylim()])
        for line in axes.lines:
            numbers(line.get_xydata())
        for patch in axes.patches:
            numbers(patch.get_patch_transform().transform(patch.get_path().vertices))
        for collection in axes.collections:
            numbers(collection.get_offsets())
            for path in collection.get_paths():
                numbers(path.vertices)
        for image in axes.images:
            numbers(image.get_array())
    return digest.hexdigest()


def describe(figure: Figure, path: Path) -> None:
    """Writes `path`.json beside a drawing: the hash of its data, the command that makes it again, the versions used."""
    versions = {name: version(name) for name in PACKAGES}
    facts = {"data_sha256": fingerprint(figure), "command": COMMAND, "versions": versions}
    output.text(path.with_suffix(".json"), json.dumps(facts, indent=1) + "\n")


def differences(old: Path, new: Path) -> list[str]:
    """Lists the files that differ between two report folders: figures by their data, tables by their content."""
    hashes = {folder: _hashes(folder) for folder in (old, new)}
    changes = []
    for name in sorted({*hashes[old], *hashes[new]}):
        before, after = hashes[old].get(name), hashes[new].get(name)
        if before != after:
            how = "is new" if before is None else "is no longer made" if after is None else "has other data"
            changes.append(f"{name} {how}")
    return changes


def _hashes(folder: Path) -> dict[str, str]:
    hashes = {}
    for path in folder.rglob("*.json"):
        hashes[path.relative_to(folder).with_suffix("").as_posix()] = _hash(path)
    for path in folder.rglob("*.csv"):
        with open(path, newline="", encoding="utf-8") as file:
            rows = [[_number(text) for text in row] for row in csv.reader(file)]
        hashes[path.relative_to(folder).as_posix()] = hashlib.sha256(json.dumps(rows).encode()).hexdigest()
    return hashes


def _hash(path: Path) -> str:
    """Returns the hash in a file that `describe` wrote; UserError if it is none."""
    try:
        return clean.parsed(confined.content(path, LONGEST))["data_sha256"]
    except (ValueError, TypeError, KeyError) as error:
        raise UserError(f"{path}: not of a figure of a report: {error!r}") from None


def _number(text: str) -> str:
    """Returns a number to nine digits, so that last bits do not count; other text unchanged."""
    try:
        return f"{float(text):.9g}"
    except ValueError:
        return text
