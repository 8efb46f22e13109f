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
class Differences:
    """How far a picture is from its reference; of a pixel the largest difference of a channel, linear RGB.

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
    """Pictures of one variant in one arithmetic, by rising depth. lacking: reasons for none, by depth."""

    variant: str
    arithmetic: tuple[str, str]
    pictures: list[Differences]
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


def methods_by_view(results: Results) -> list[tuple[View, list[Method]]]:
    """Returns every view with several arithmetics, with its methods."""
    return [
        (seen, [_method(results, *key, cells) for key, cells in by_method.items()])
        for seen, by_method in groups(results)
    ]


def _method(results: Results, variant: str, chosen: tuple[str, str], cells: list[Cell]) -> Method:
    pictures, lacking = [], {}
    for cell in cells:
        picture = _differences(results, cell)
        if isinstance(picture, Missing):
            lacking[cell.parameters["depth"]] = str(picture)
        else:
            pictures.append(picture)
    return Method(variant, chosen, pictures, lacking)


def _differences(results: Results, cell: Cell) -> Differences | Missing:
    """Returns differences from the judge's reference: another renderer's picture in strict float64, with equal samples.

    They are no errors: the truth of the scene is deeper and has all samples, and would add more to the arithmetic's.
    """
    picture = stored.picture(results, cell)
    if isinstance(picture, Missing):
        return picture
    right = stored.reference(results, results.record(cell)["agreement"] or {})
    if isinstance(right, Missing):
        return right
    off = np.abs(picture - right).max(axis=-1)
    median = float(np.median(off[off > 0])) if off.any() else 0.0
    return Differences(cell.parameters["depth"], float(np.mean(off > STEP)), float(off.max()), median, cell.status)
