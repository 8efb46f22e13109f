"""Compares the pictures of one cell in two runs."""

from dataclasses import dataclass

import numpy as np

from harness.store import arrays
from reports.run.results import Cell, Results
from reports.run.stored import STEP


@dataclass(frozen=True)
class Difference:
    """The difference of two pictures, linear RGB; nothing else is computed if their bytes are the same.

    changed: outside the known masks a channel differs by more than the judge's tolerance. pixels: of the picture.
    differing: pixels with a channel that differs. largest: largest absolute difference of a channel. rmse: root of the
    mean squared difference. beyond: pixels with a channel off by more than 1/255. beyond_outside: of these, the pixels
    that are ill-conditioned in neither run; None if not known. unavailable: why all numbers are None, else "".
    """

    same: bool
    changed: bool = False
    pixels: int | None = None
    differing: int | None = None
    largest: float | None = None
    rmse: float | None = None
    beyond: int | None = None
    beyond_outside: int | None = None
    unavailable: str = ""

    def __str__(self):
        if self.same:
            return "the same bytes"
        if self.largest is None:
            return f"other bytes; the difference is unavailable: {self.unavailable}"
        outside = "unavailable: no masks" if self.beyond_outside is None else self.beyond_outside
        return (
            f"{self.differing} of {self.pixels} pixels differ, by {self.largest:.2g} at most (RMSE {self.rmse:.2g}), "
            f"{self.beyond} by more than 1/255 (outside both masks: {outside})"
        )


def compare(a: Results, b: Results, cell_a: Cell, cell_b: Cell) -> Difference | None:
    """Compares the first pictures of two cells that should be the same; None without two pictures."""
    record_a, record_b = a.record(cell_a), b.record(cell_b)
    if not (record_a and record_a["picture"] and record_b and record_b["picture"]):
        return None
    if record_a["picture"]["sha256"] == record_b["picture"]["sha256"]:
        return Difference(same=True)
    try:
        ours, other = (
            arrays.load(run.folder / (kept := record["picture"])["file"], kept["sha256"])
            for run, record in ((a, record_a), (b, record_b))
        )
        if ours.shape != other.shape:
            return Difference(same=False, changed=True, unavailable=f"their shapes are {ours.shape} and {other.shape}")
        masks = [
            arrays.load(run.folder / file) for run, record in ((a, record_a), (b, record_b)) if (file := _mask(record))
        ]
    except (OSError, ValueError) as error:
        return Difference(same=False, changed=True, unavailable=str(error))
    off = np.abs(ours.astype(np.float64) - other)
    trusted = ~np.logical_or.reduce(masks) if masks else np.ones(off.shape[:2], dtype=bool)
    tolerances = [(record["agreement"] or {}).get("tolerance") for record in (record_a, record_b)]
    beyond = off.max(axis=-1) > STEP
    return Difference(
        same=False,
        changed=bool((off.max(axis=-1) > min(filter(None, tolerances), default=0.0))[trusted].any()),
        pixels=beyond.size,
        differing=int(np.count_nonzero(off.any(axis=-1))),
        largest=float(off.max()),
        rmse=float(np.sqrt(np.mean(off**2))),
        beyond=int(np.count_nonzero(beyond)),
        beyond_outside=int(np.count_nonzero(beyond & trusted)) if len(masks) == 2 else None,
    )


def _mask(record: dict) -> str | None:
    return (record["agreement"] or {}).get("mask_file")
