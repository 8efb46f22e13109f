"""Names cells: in full for use outside a report ("cpp, comparison, depth = 3"), in it by what varies ("cpp, lanes")."""

from collections import Counter
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from reports.run import method, reduced, view
from reports.run.cell import Cell
from reports.run.method import Names
from reports.run.results import Results, grouped, place_label
from reports.run.words import spoken

_FREE = *method.DIALS, *method.CHOICES, *method.OF_SCENE, *view.UNSEEN, "epsilon", reduced.KEY
METHOD = tuple(name for name in _FREE if name != "depth")  # parameters of a method; depth is work too


def names(cells: list[Cell]) -> list[str]:
    """Returns a name for each cell; it has the path of a scene only where two scenes have the same stem."""
    stems = grouped({cell.scene for cell in cells}, lambda scene: Path(scene).stem)
    called = {scene: stem if len(scenes) == 1 else scene for stem, scenes in stems.items() for scene in scenes}
    return [
        ", ".join([cell.label, called[cell.scene], *(f"{key} = {value}" for key, value in cell.swept.items())])
        for cell in cells
    ]


@dataclass(frozen=True)
class Short:
    """Names of some cells by what varies among them.

    where: by cell, its swept values that are no method. methods: by cell, the parts of its method's name. shared: what
    all of them have, of both.
    """

    where: dict[Cell, str]
    methods: dict[Cell, tuple[str, ...]]
    shared: list[str]

    def full(self, cell: Cell) -> str:
        """Returns variant and method: "cpp, lanes, float32"."""
        return ", ".join([cell.label, *self.methods[cell]])


def short(cells: list[Cell], silent: tuple[str, ...] = ()) -> Short:
    """Returns short names of cells, without the values of `silent`."""
    names = Names(cells, silent=(*silent, "threads"))  # which a label has
    names.turned.discard("depth")
    methods, alike = varying(names, cells)
    places = {
        cell: [(key, spoken(key, value)) for key, value in _work(cell).items() if key not in silent] for cell in cells
    }
    shared = [part for part in places[cells[0]] if all(part in parts for parts in places.values())]
    where = {
        cell: ", ".join(text for key, text in parts if (key, text) not in shared) for cell, parts in places.items()
    }
    return Short(where, methods, [*(text for _, text in shared), *alike])


def varying(names: Names, cells: list[Cell]) -> tuple[dict[Cell, tuple[str, ...]], list[str]]:
    """Returns for each cell the parts of its method's name that not all cells have, and the parts that all have."""
    words = {cell: names.words(cell) for cell in cells}
    alike = [word for word in words[cells[0]] if all(word in parts for parts in words.values())]
    return {cell: tuple(word for word in parts if word not in alike) for cell, parts in words.items()}, alike


@lru_cache(maxsize=2)
def _places(results: Results) -> dict[tuple[str, str], str]:
    labels = {}
    for scene in results.scenes:
        names = short(results.of(scene))
        for place, cells in grouped(results.of(scene), lambda cell: cell.place).items():
            alike = [word for word in names.methods[cells[0]] if all(word in names.methods[cell] for cell in cells)]
            labels[place] = ", ".join(filter(None, [Path(scene).stem, names.where[cells[0]], *alike]))
    twice = Counter(labels.values())
    return {place: place_label(place) if twice[name] > 1 else name for place, name in labels.items()}


def called(results: Results, place: tuple[str, str]) -> str:
    """Returns a name of a place by what varies in the run: "comparison, one pixel"; in full if two have the same."""
    return _places(results)[place]


def place(cell: Cell, among: list[Cell]) -> str:
    """Returns the scene of a cell and its swept values that are no method and vary among some cells of that scene."""
    return ", ".join(filter(None, [Path(cell.scene).stem, short([cell, *among]).where[cell]]))


def _work(cell: Cell) -> dict:
    return {key: value for key, value in cell.swept.items() if key not in METHOD}
