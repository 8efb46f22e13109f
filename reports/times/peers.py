"""Tabulates technologies for one picture: time, error, memory, lines of source, compile time."""

from pathlib import Path

from reports.accuracy import accuracy_columns
from reports.paper import quantity, table
from reports.paper.table import Column
from reports.run import ranking
from reports.run.results import Cell, Missing, Results
from reports.times import memory_table, startup_table

MANY = 6  # technologies that a run needs for the comparison
CAPTION = (
    "Ratios, times and errors as in the tables above, which have the rest. Lines: those of the renderer's own folder "
    "that are not blank, all its programs and features together, so a renderer that can do more has more of them; a "
    "library or an outside program that does the work is not counted. Memory: the peak of the whole process, of what "
    "was compiled in it too."
)


def write(results: Results, out: Path) -> str:
    """Writes peers-*.csv for each scene; returns the section of the report, "" with few technologies."""
    if len({str(technology(cell)) for cell in results.cells if cell.timed}) < MANY:
        return ""
    tables = [(scene, results.of(scene), columns(results, scene)) for scene in results.scenes]
    return table.section(out, "peers", "Technologies beside each other", tables, CAPTION)


def columns(results: Results, scene: str) -> list[Column]:
    base = ranking.baseline(results, scene)
    return [
        Column("technology", "technology", "", technology),
        Column(
            f"time ÷ {base}" if base else "ratio", f"time_over_{base}" if base else "ratio", "1",
            lambda cell: ranking.ratio_to(results, cell, base),
            lambda value: quantity.ratio(value, results.floor.value),
        ),
        *accuracy_columns.ERRORS,
        *accuracy_columns.AGREEMENT,
        memory_table.COLUMNS[0],
        Column("compile, cold", "compile_cold", "s", startup_table.cold, startup_table.show_cold),
        Column("lines", "lines", "1", lambda cell: lines(results, cell), _whole),
    ]  # fmt: skip


def technology(cell: Cell) -> str | Missing:
    return next(iter(cell.by_row("technology", cell.timed).values()), Missing(cell.verdict))


def lines(results: Results, cell: Cell) -> float | Missing:
    """Returns the number of lines of the renderer's sources, as stored in the run."""
    count = (results.record(cell) or {}).get("lines")
    return Missing("the run did not store it") if count is None else float(count)


def _whole(value) -> str:
    return quantity.text(value) if isinstance(value, Missing) else f"{value:.0f}"
