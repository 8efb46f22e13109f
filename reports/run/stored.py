"""Loads the pictures and arrays that a run stored, or says why they are unavailable: a packed run may lack them."""

import io
from pathlib import Path

import numpy as np
import pandas as pd

from harness.picture import colour
from harness.store import arrays, confined, packed
from reports.run.cell import Missing
from reports.run.results import Cell, Results

LEFT_OUT = "the pictures of this run were left out when it was packed; their errors stand beside the times"
NO_TRUTHS = "the truths of this run were left out when it was packed; the errors stand beside the times"
LONGEST = 1 << 26  # bytes of a series: a million samples
STEP = 1 / 255  # of an 8-bit picture
BROKEN = (1.0, 0.0, 1.0)  # shown for a pixel that is not finite


def picture(results: Results, cell: Cell) -> np.ndarray | Missing:
    """Returns the picture of a cell, float64 (height, width, 3), whatever the judge says of it, or why there is none.

    Missing too if a pixel is not finite.
    """
    pixels = raw(results, cell)
    if not isinstance(pixels, Missing) and not np.isfinite(pixels).all():
        return Missing(f"its picture is not finite: {cell.verdict}")
    return pixels


def raw(results: Results, cell: Cell) -> np.ndarray | Missing:
    """Returns the same, but also with pixels that are not finite."""
    record = results.record(cell)
    if record is None or not record["picture"]:
        return Missing(cell.verdict if cell.status != "ok" else "no picture was stored")
    return array(results, record["picture"]["file"], record["picture"]["sha256"])


def displayed(picture: np.ndarray, cell: Cell) -> np.ndarray:
    """Returns a picture of a cell as a display shows it, uint8 sRGB (height, width, 3), broken pixels in magenta."""
    finite = np.isfinite(picture).all(axis=-1, keepdims=True)
    return colour.codes(np.where(finite, picture, BROKEN), cell.parameters.get("arithmetic", "linear"))


def array(results: Results, file: str | None, sha256: str | None = None) -> np.ndarray | Missing:
    """Returns an array in the folder of the run, as float64, or why it is unavailable.

    sha256: of the bytes of its numbers, where the run has it: another array is not shown.
    """
    if file is None:
        return Missing("the run does not name it")
    try:
        return arrays.load(results.folder / file, sha256).astype(np.float64, copy=False)
    except FileNotFoundError:
        if results.left_out:
            return Missing(LEFT_OUT)
        return Missing(NO_TRUTHS if file.endswith(packed.TRUTHS) else f"{file} does not exist")
    except (OSError, ValueError) as error:
        return Missing(f"{file}: {error}")


def series(path: Path, **options) -> pd.DataFrame:
    """Returns the measurer's samples in a file of a run. options: of pandas.read_csv. UserError if it is too large."""
    return pd.read_csv(io.BytesIO(confined.content(path, LONGEST)), **options)


def truth(results: Results, cell: Cell) -> np.ndarray | Missing:
    """Returns the truth that the error of a cell is the distance from, float64, or why it is unavailable."""
    error = (results.record(cell) or {}).get("error") or {}
    if error.get("truth_file") is None:
        return Missing(error.get("unavailable") or "the run made no truth")
    return array(results, error["truth_file"])


def reference(results: Results, agreement: dict) -> np.ndarray | Missing:
    """Returns the reference that a record was judged against, float64, or why it is unavailable."""
    if agreement.get("reference_file") is None:
        return Missing(agreement.get("unavailable") or "not judged")
    return array(results, agreement["reference_file"])
