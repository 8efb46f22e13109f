"""Groups cells that differ only in how a kernel is launched."""

import json
from dataclasses import dataclass
from pathlib import Path

from reports.run import ranking
from reports.run.results import Cell, Results, grouped, point_label

BLOCK = "block_width", "block_height"
SHAPE = (*BLOCK, "total_threads")
UNSEEN = (*SHAPE, "max_registers", "scene_memory")  # a right picture does not depend on them


@dataclass(frozen=True)
class Group:
    """Cells of one scene whose other parameters are the same. label: names these for people."""

    label: str
    cells: list[Cell]

    @property
    def ranked(self) -> list[Cell]:
        return [cell for cell in self.cells if not cell.unranked]

    @property
    def drawn(self) -> list[Cell]:
        """The ranked cells; if none is, those with a time that a simulator ran, which a chart is marked for."""
        return self.ranked or [cell for cell in self.cells if cell.simulated and cell.values("steady_s")]


def groups(cells: list[Cell], free: tuple[str, ...], across_variants: bool = False) -> list[Group]:
    """Returns groups of cells that differ only in the parameters `free`, and in the variant if `across_variants`."""
    alike = grouped(
        cells, lambda cell: (cell.scene, counts(cell), "" if across_variants else cell.variant, rest(cell, free))
    )
    return [Group(_label(members[0], free, across_variants), members) for members in alike.values()]


def places(results: Results) -> list[tuple[tuple[str, str], list[Cell]]]:
    """Returns the places that a summary names, in order, each with the cells that it also stands for.

    Of places that have one ranked cell each and differ only in how a kernel is launched, it names the fastest.
    """
    alone = [ranked[0] for place in results.places if len(ranked := ranking.ranked(results, place)) == 1]
    spoken, silent = {}, set()
    for group in groups([cell for cell in alone if cell.gpu], UNSEEN):
        first, *others = sorted(group.cells, key=lambda cell: cell.steady.value)
        spoken[first.place] = others
        silent |= {cell.place for cell in others}
    return [(place, spoken.get(place, [])) for place in results.places if place not in silent]


def counts(cell: Cell) -> str:
    """Returns the swept counts of a generated scene as text; they are not parameters and not in the scene's name."""
    return json.dumps({key: value for key, value in cell.swept.items() if key not in cell.parameters}, sort_keys=True)


def rest(cell: Cell, free: tuple[str, ...]) -> str:
    """Returns the parameters of a cell without `free`, as text to compare."""
    return json.dumps({key: value for key, value in cell.parameters.items() if key not in free}, sort_keys=True)


def _label(cell: Cell, free: tuple[str, ...], across_variants: bool) -> str:
    swept = {key: value for key, value in cell.swept.items() if key not in free}
    words = [Path(cell.scene).stem, "" if across_variants else cell.variant, point_label(swept) if swept else ""]
    return ", ".join(filter(None, words))


def clock(cells: list[Cell]) -> tuple[str, str]:
    """Returns the column of times that all these cells have, and its name: the kernel's, else the frame's."""
    if all(cell.values("kernel_s") for cell in cells):
        return "kernel_s", "kernel time"
    return "steady_s", "frame time"
