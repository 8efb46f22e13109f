"""Writes a table of cells by columns: rounded for people (Markdown, LaTeX) and in full (CSV), from the same values."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from harness.statistics.statistics import Estimate
from harness.system import output
from reports.paper import latex, markdown, quantity, thinning
from reports.run import naming, study
from reports.run.method import PLAIN
from reports.run.results import Cell, Missing

CSV_HEADER = ("scene", "point", "variant", "status", "quantity", "unit", "value", "low", "high", "processes", "note")

AGAINST = "error_against"  # name of the column that is shown where an error is not from the truth of the scene
MOST = 200  # rows of a table for people
FORMULA = ("=", "+", "-", "@", "\t", "\r")  # begin what a spreadsheet takes for a formula
OWN_UNIT = {"s": quantity.seconds, "byte": quantity.size}  # formats of values by their unit
NOT_THE_STUDYS = "The study's numbers: unavailable, it has another scene or other variables."

Value = Estimate | Missing | float | str


@dataclass(frozen=True)
class Column:
    """A column of a table of cells.

    title: for people, with the unit unless that is of time or memory, which a value brings along. name, unit: in the
    CSV file. value: returns the value of a cell in `unit`. scale: from `unit` to the unit of the title. show: formats a
    value for people where this is not enough.
    """

    title: str
    name: str
    unit: str
    value: Callable[[Cell], Value]
    show: Callable[[Value], str] | None = None
    scale: float = 1.0

    def text(self, value: Value) -> str:
        """Returns a value as text for people."""
        if self.show:
            return self.show(value)
        return OWN_UNIT[self.unit](value) if self.unit in OWN_UNIT else quantity.text(value, self.scale)

    @property
    def of_study(self) -> bool:
        return self.name.startswith("study_")


def section(
    out: Path,
    stem: str,
    title: str,
    tables: list[tuple[str, list[Cell], list[Column]]],
    caption: str,
    silent: tuple[str, ...] = (),
) -> str:
    """Returns the Markdown of tables, each (scene, cells, columns), and writes `out`/STEM-NUMBER-SCENE.csv and .tex.

    silent: parameters that columns have, so that no name does.
    The study's columns are only in the CSV file where no cell of a table repeats a case of the study, and so is what
    errors are held against where that is the truth of the scene everywhere.
    """
    if reasons := _all_missing(tables):
        for number, (scene, cells, columns) in enumerate(tables):
            write_csv(cells, columns, out / _name(stem, number, scene))
        return markdown.unavailable(title, "; ".join(reasons))
    parts, others = [f"## {title}"], False
    for number, (scene, cells, columns) in enumerate(tables):
        name = _name(stem, number, scene)
        write_csv(cells, columns, out / name)
        repeated = any(study.case(cell) for cell in cells)
        filled = [column for column in columns if column.name != AGAINST or any(cell.against for cell in cells)]
        shown = [column for column in filled if repeated or not column.of_study]
        others |= shown != filled
        places = list(dict.fromkeys(cell.place for cell in cells))
        kept = set(thinning.few(places, max(1, MOST * len(places) // len(cells))))
        rows = [cell for cell in cells if cell.place in kept]
        header, body, shared = to_texts(rows, shown, silent)
        latex.table(header, body, (out / name).with_suffix(".tex"))
        parts += [f"### {markdown.escape(scene)}", *shared, markdown.table(header, body)]
        if len(rows) < len(cells):
            parts.append(thinning.note(len(rows), len(cells), "rows, whole places", "the CSV file has all"))
        parts.append(f"[{name}]({name})")
    return "\n\n".join([*parts, *[NOT_THE_STUDYS] * others, markdown.escape(caption)])


def _name(stem: str, number: int, scene: str) -> str:
    return f"{stem}-{number}-{markdown.slug(Path(scene).stem)}.csv"


def _all_missing(tables: list[tuple[str, list[Cell], list[Column]]]) -> list[str]:
    """Returns the reasons why no cell has a result, where none of all tables is ok; [] if one is."""
    cells = [cell for _, group, _ in tables for cell in group]
    if any(cell.status == "ok" or cell.as_meant for cell in cells):
        return []
    return list(dict.fromkeys(cell.verdict.removeprefix("unavailable: ") for cell in cells))


def to_texts(
    cells: list[Cell], columns: list[Column], silent: tuple[str, ...] = ()
) -> tuple[list[str], list[list[str]], list[str]]:
    """Returns header and rows, one per cell, named by what varies, and a paragraph on what does not, if any.

    A row gives each reason once, its last column why a cell is not ok.
    """
    names = naming.short(cells, silent)
    header = ["configuration", "renderer", *(column.title for column in columns), "status"]
    body = [[names.where[cell], names.full(cell), *_shown(cell, columns), cell.verdict] for cell in cells]
    if not any(row[0] for row in body):
        header, body = header[1:], [row[1:] for row in body]
    elif not all(row[0] for row in body):
        body = [[row[0] or PLAIN, *row[1:]] for row in body]
    return header, body, [f"Everywhere: {markdown.escape(', '.join(names.shared))}."] if names.shared else []


def _shown(cell: Cell, columns: list[Column]) -> list[str]:
    given, texts = {cell.verdict, cell.apart, f"not ranked: {cell.apart}"}, []
    for column in columns:
        value = column.value(cell)
        if not isinstance(value, Missing):
            texts.append(column.text(value))
        elif cell.status != "ok" or value.reason in given:
            texts.append("unavailable")
        else:
            given.add(value.reason)
            texts.append(quantity.text(value))
    return texts


def write_csv(cells: list[Cell], columns: list[Column], path: Path) -> None:
    """Writes a line for each cell and column, numbers in full; NaN where there is none, with the reason in `note`."""
    lines = (
        (cell.scene, cell.point, cell.label, cell.status, column.name, column.unit, *_fields(column.value(cell)))
        for cell in cells
        for column in columns
    )
    write_lines(path, CSV_HEADER, lines)


def write_lines(path: Path, header: Iterable[str], lines: Iterable[Iterable]) -> None:
    """Writes a CSV file, numbers in full, NaN for None."""
    write_frame(path, pd.DataFrame(list(lines), columns=list(header), dtype=object))


def write_frame(path: Path, frame: pd.DataFrame, own: bool = True) -> None:
    """Writes a table as CSV, numbers in full, NaN for what is unknown. own: in a folder of rayrace (output.py)."""
    cells = frame.rename(columns=inert)
    for name in cells.select_dtypes(exclude=["number", "bool"]).columns:
        # Not `map`, which makes 6.0 of a 6 that stands beside an unknown number.
        cells[name] = pd.Series([inert(cell) for cell in cells[name]], cells.index, dtype=object)
    output.text(path, cells.to_csv(index=False, na_rep="NaN", lineterminator="\n"), own=own)


def inert(cell):
    """Returns a cell of a CSV file: a text that a spreadsheet would compute as a formula begins with an apostrophe."""
    return f"'{cell}" if isinstance(cell, str) and cell.startswith(FORMULA) else cell


def _fields(value: Value) -> tuple:
    """Returns value, low, high, processes and note."""
    if isinstance(value, Missing):
        return None, None, None, 0, str(value)
    if isinstance(value, str):
        return None, None, None, None, value
    if not isinstance(value, Estimate):
        return value, None, None, None, ""
    return value.value, value.low, value.high, value.processes, value.note
