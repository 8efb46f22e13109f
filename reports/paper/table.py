"""A table of cells by columns, from the same values for people (Markdown, LaTeX) and in full (CSV)."""

import csv
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from harness.statistics.statistics import Estimate
from reports.paper import latex, markdown, quantity, thinning
from reports.run import study
from reports.run.results import Cell, Missing

CSV_HEADER = ("scene", "point", "variant", "status", "quantity", "unit", "value", "low", "high", "processes", "note")

MOST = 200  # rows of a table for people

Value = Estimate | Missing | float | str


@dataclass(frozen=True)
class Column:
    """title: with the unit people see. name, unit: in the CSV. value: of a cell. show: a value as text for people."""

    title: str
    name: str
    unit: str
    value: Callable[[Cell], Value]
    show: Callable[[Value], str] = quantity.text

    @property
    def of_study(self) -> bool:
        return self.name.startswith("study_")


def section(out: Path, stem: str, title: str, tables: list[tuple[str, list[Cell], list[Column]]], caption: str) -> str:
    """The Markdown of tables, each (scene, cells, columns); each also goes to `out`/STEM-NUMBER-SCENE.csv and .tex.

    People are spared the study's columns where no cell of a table repeats a case of the study.
    """
    parts = [f"## {title}"]
    for number, (scene, cells, columns) in enumerate(tables):
        name = f"{stem}-{number}-{markdown.slug(Path(scene).stem)}.csv"
        write_csv(cells, columns, out / name)
        repeated = any(study.case(cell) for cell in cells)
        shown = [column for column in columns if repeated or not column.of_study]
        places = list(dict.fromkeys(cell.place for cell in cells))
        kept = set(thinning.few(places, max(1, MOST * len(places) // len(cells))))
        rows = [cell for cell in cells if cell.place in kept]
        header, body = to_texts(rows, shown)
        latex.write(header, body, (out / name).with_suffix(".tex"))
        parts += [f"### {markdown.escape(scene)}", markdown.table(header, body)]
        if len(rows) < len(cells):
            parts.append(thinning.told(len(rows), len(cells), "rows, whole places", "the CSV file has all"))
        if shown != columns:
            parts.append("The study's numbers: unavailable, it has another scene or other variables.")
        parts.append(f"[{name}]({name})")
    return "\n\n".join([*parts, markdown.escape(caption)])


def to_texts(cells: list[Cell], columns: list[Column]) -> tuple[list[str], list[list[str]]]:
    """Header and rows, one a cell. A reason is told once a row; why a cell is not ok, in its last column."""
    header = ["point", "variant", *(column.title for column in columns), "status"]
    return header, [[cell.point, cell.label, *_shown(cell, columns), cell.verdict] for cell in cells]


def _shown(cell: Cell, columns: list[Column]) -> list[str]:
    told, texts = {cell.verdict, cell.apart, f"not ranked: {cell.apart}"}, []
    for column in columns:
        value = column.value(cell)
        if not isinstance(value, Missing):
            texts.append(column.show(value))
        elif cell.status != "ok" or value.reason in told:
            texts.append("unavailable")
        else:
            told.add(value.reason)
            texts.append(quantity.text(value))
    return texts


def write_csv(cells: list[Cell], columns: list[Column], path: Path) -> None:
    """One line a cell and column, numbers in full; NaN where there is none, with the reason in `note`."""
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(CSV_HEADER)
        for cell in cells:
            for column in columns:
                name = cell.scene, cell.point, cell.label, cell.status, column.name, column.unit
                writer.writerow((*name, *_fields(column.value(cell))))


def _fields(value: Value) -> tuple:
    """value, low, high, processes, note."""
    if isinstance(value, Missing):
        return "NaN", "NaN", "NaN", 0, str(value)
    if isinstance(value, str):
        return "NaN", "NaN", "NaN", "NaN", value
    if not isinstance(value, Estimate):
        return value, "NaN", "NaN", "NaN", ""
    low, high = ("NaN" if end is None else end for end in (value.low, value.high))
    return value.value, low, high, value.processes, value.note
