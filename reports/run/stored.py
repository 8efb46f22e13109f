"""Loads the arrays that a run stored, or says why they are unavailable: a packed run may lack them."""

import numpy as np

from reports.run.cell import Missing
from reports.run.results import Cell, Results

LEFT_OUT = "the pictures of this run were left out when it was packed; their errors stand beside the times"


def left_out(results: Results) -> bool:
    """Had the run pictures, and has its folder none?"""
    kept = [record["picture"]["file"] for record in results.records if record["picture"]]
    return bool(kept) and not any((results.folder / file).exists() for file in dict.fromkeys(kept))


def picture(results: Results, cell: Cell) -> np.ndarray | Missing:
    """The picture that a cell stored, float64 (height, width, 3), whatever the judge says of it, or why there is none.

    One with pixels that are not finite is Missing.
    """
    record = results.record(cell)
    if record is None or not record["picture"]:
        return Missing(cell.verdict if cell.status != "ok" else "no picture was stored")
    found = array(results, record["picture"]["file"])
    if not isinstance(found, Missing) and not np.isfinite(found).all():
        return Missing(f"its picture is not finite: {cell.verdict}")
    return found


def array(results: Results, file: str | None) -> np.ndarray | Missing:
    """An array in the folder of the run, as float64, or why it cannot be had."""
    if file is None:
        return Missing("the run does not name it")
    try:
        return np.load(results.folder / file, allow_pickle=False).astype(np.float64)
    except (OSError, ValueError):
        return Missing(LEFT_OUT if left_out(results) else f"{file} is not there")


def reference(results: Results, accuracy: dict) -> np.ndarray | Missing:
    """The picture that a record was judged by, float64."""
    if accuracy.get("reference_file") is None:
        return Missing(accuracy.get("unavailable") or "not judged")
    return array(results, accuracy["reference_file"])
