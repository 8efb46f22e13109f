"""Compares pictures in other precisions and floating-point modes with strict float64, all else equal."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from reports.run import stored, view
from reports.run.cell import Cell, Missing
from reports.run.results import Results, grouped
from reports.run.stored import STEP
from reports.run.view import View

ARITHMETIC = "precision", "epsilon", "floating_point"
STRICT = ("float64", "strict")


@dataclass(frozen=True)
class Errors:
    """The errors of a picture; the error of a pixel is its largest channel difference, linear RGB.

    bad: share of pixels off by more than 1/255. largest: over all pixels. median: over the pixels that differ, which
    leaves out the background. status: of the cell.
    """

    depth: int
    bad: float
    largest: float
    median: float
    status: str


@dataclass(frozen=True)
class Method:
    """Pictures of one variant in one arithmetic, by rising depth. lacking: reasons for no errors, by depth."""

    variant: str
    arithmetic: tuple[str, str]
    errors: list[Errors]
    lacking: dict[int, str]

    @property
    def label(self) -> str:
        return f"{self.variant}, {name(self.arithmetic)}"


def name(arithmetic: tuple[str, str]) -> str:
    """Returns a name such as "float64 strict"."""
    return " ".join(arithmetic)


def arithmetic(cell: Cell) -> tuple[str, str]:
    """Returns precision and floating_point; older runs without the latter were strict."""
    return cell.parameters["precision"], cell.parameters.get("floating_point", "strict")


def groups(results: Results) -> Iterator[tuple[View, dict[tuple[str, tuple[str, str]], list[Cell]]]]:
    """Yields views with several arithmetics, each with its cells by variant and arithmetic, by rising depth."""
    for seen in view.views(results.cells, (*ARITHMETIC, "depth")):
        if len({arithmetic(cell) for cell in seen.cells}) > 1:
            cells = sorted(seen.cells, key=lambda cell: cell.parameters["depth"])
            yield seen, grouped(cells, lambda cell: (cell.variant, arithmetic(cell)))


def found(results: Results) -> list[tuple[View, list[Method]]]:
    """Returns every view with several arithmetics, with its methods."""
    return [
        (seen, [_method(results, *key, cells) for key, cells in by_method.items()])
        for seen, by_method in groups(results)
    ]


def _method(results: Results, variant: str, chosen: tuple[str, str], cells: list[Cell]) -> Method:
    errors, lacking = [], {}
    for cell in cells:
        found = _errors(results, cell)
        if isinstance(found, Missing):
            lacking[cell.parameters["depth"]] = str(found)
        else:
            errors.append(found)
    return Method(variant, chosen, errors, lacking)


def _errors(results: Results, cell: Cell) -> Errors | Missing:
    """Returns errors against the judge's reference: another renderer's picture in strict float64, with equal samples.

    (The truth of the run may be deeper, or a mean of many pictures, and would add other errors to the arithmetic's.)
    """
    picture = stored.picture(results, cell)
    if isinstance(picture, Missing):
        return picture
    accuracy = results.record(cell)["accuracy"] or {"unavailable": "the judge was not asked"}
    if "unavailable" in accuracy:
        return Missing(accuracy["unavailable"])
    right = stored.array(results, accuracy.get("reference_file"))
    if isinstance(right, Missing):
        return right
    off = np.abs(picture - right).max(axis=-1)
    median = float(np.median(off[off > 0])) if off.any() else 0.0
    return Errors(cell.parameters["depth"], float(np.mean(off > STEP)), float(off.max()), median, cell.status)
