"""Writes a table of cells by columns: rounded for people (Markdown, LaTeX) and in full (CSV), from the same values."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from harness.statistics.statistics import Estimate
from reports.paper import markdown, quantity, thinning
from reports.run import study
from reports.run.results import Cell, Missing

CSV_HEADER = ("scene", "point", "variant", "status", "quantity", "unit", "value", "low", "high", "processes", "note")

AGAINST = "error_against"  # name of the column that is shown where an error is not from the truth of the scene
MOST = 200  # rows of a table for people

Value = Estimate | Missing | float | str


@dataclass(frozen=True)
class Column:
    """A column of a table of cells.

    title: for people, with their unit. name, unit: in the CSV file. value: returns the value of a cell in `unit`.
    scale: from `unit` to the unit of the title. show: formats a value for people where a scaled number is not enough.
    """

    title: str
    name: str
    unit: str
    value: Callable[[Cell], Value]
    show: Callable[[Value], str] | None = None
    scale: float = 1.0

    def text(self, value: Value) -> str:
        """Returns a value as text for people."""
        return self.show(value) if self.show else quantity.text(value, self.scale)

    @property
    def of_study(self) -> bool:
        return self.name.startswith("study_")


def section(out: Path, stem: str, title: str, tables: list[tuple[str, list[Cell], list[Column]]], caption: str) -> str:
    """Returns the Markdown of tables, each (scene, cells, columns), and writes `out`/STEM-NUMBER-SCENE.csv and .tex.

    The study's columns are only in the CSV file where no cell of a table repeats a case of the study, and so is what
    errors are held against where that is the truth of the scene everywhere.
    """
    parts = [f"## {title}"]
    for number, (scene, cells, columns) in enumerate(tables):
        name = f"{stem}-{number}-{markdown.slug(Path(scene).stem)}.csv"
        write_csv(cells, columns, out / name)
        repeated = any(study.case(cell) for cell in cells)
        known = [column for column in columns if column.name != AGAINST or any(cell.against for cell in cells)]
        shown = [column for column in known if repeated or not column.of_study]
        places = list(dict.fromkeys(cell.place for cell in cells))
        kept = set(thinning.few(places, max(1, MOST * len(places) // len(cells))))
        rows = [cell for cell in cells if cell.place in kept]
        header, body = to_texts(rows, shown)
        write_latex(header, body, (out / name).with_suffix(".tex"))
        parts += [f"### {markdown.escape(scene)}", markdown.table(header, body)]
        if len(rows) < len(cells):
            parts.append(thinning.note(len(rows), len(cells), "rows, whole places", "the CSV file has all"))
        if shown != known:
            parts.append("The study's numbers: unavailable, it has another scene or other variables.")
        parts.append(f"[{name}]({name})")
    return "\n\n".join([*parts, markdown.escape(caption)])


def to_texts(cells: list[Cell], columns: list[Column]) -> tuple[list[str], list[list[str]]]:
    """Returns header and rows, one per cell. A row gives each reason once, its last column why a cell is not ok."""
    header = ["point", "variant", *(column.title for column in columns), "status"]
    return header, [[cell.point, cell.label, *_shown(cell, columns), cell.verdict] for cell in cells]


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
    frame = pd.DataFrame(list(lines), columns=list(header), dtype=object)
    frame.to_csv(path, index=False, na_rep="NaN", lineterminator="\n")


def write_latex(header: list[str], rows: list[list[str]], path: Path) -> None:
    """Writes a `tabular` of plain texts, all escaped, for LaTeX with the packages booktabs, textcomp and
    pifont."""
    frame = pd.DataFrame(rows, columns=header)
    text = frame.to_latex(index=False, escape=True, column_format="l" * len(header))
    path.write_text(text.replace("✓", r"\ding{51}").replace("✗", r"\ding{55}"), encoding="utf-8")


def _fields(value: Value) -> tuple:
    """Returns value, low, high, processes and note."""
    if isinstance(value, Missing):
        return None, None, None, 0, str(value)
    if isinstance(value, str):
        return None, None, None, None, value
    if not isinstance(value, Estimate):
        return value, None, None, None, ""
    return value.value, value.low, value.high, value.processes, value.note
