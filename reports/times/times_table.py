"""Writes table 4.1: the time of a steady frame, the study's beside it, the ratio to a baseline, the error."""

from pathlib import Path

from harness.statistics import steady
from harness.statistics.statistics import LEAST
from reports.accuracy import accuracy_columns
from reports.paper import quantity, table
from reports.paper.compact import UNAVAILABLE
from reports.paper.table import Column
from reports.run import ranking, study
from reports.run.cell import Cell, Missing
from reports.run.results import Results

CAPTION = (
    "The time is the median over processes of each process's median over its steady frames, with a 95 % interval "
    f"between two of the processes (binomial; of {LEAST} processes the range, which covers 93.75 %; fewer have none). "
    f"Steady frames: never the first; with fewer than {steady.LEAST} later ones all of these are assumed to be steady; "
    "otherwise those from the first frame on that lies near the level of the last half (median ± 5 standard deviations "
    "from the median absolute deviation, and ± 2 % at least), as do half of the next 8; all, if that leaves less than "
    "2/3 of them. A cell has no steady state if its frames change alike in all processes: the ratio of the medians of "
    "the last and the first third is more than 5 % from 1 in the median over processes, and its 95 % interval does not "
    f"hold 1; of fewer than {LEAST} processes, if more than half have none by themselves. Outlying: processes further "
    "from the median than 14.8 times the median absolute deviation; they are kept, and count like the others. A ratio "
    "is the median "
    f"over rounds of the ratio in a round, where both ran in the same {LEAST} rounds or more, with the same kind of "
    "interval; else of medians over processes, with a bootstrap interval (percentile). It is not resolved if its "
    "interval holds 1, or if it is no further from 1 than the noise floor of this run (summary). "
    "The study's time is shown where its scene and variables are the same "
    f"(comparison, 512 × 512, depth 10, no shadows, float64). {accuracy_columns.CAPTION} "
    "Rays, per second, are primary, reflected, transmitted and shadow rays."
)


def columns(results: Results, scene: str) -> list[Column]:
    base, floor = ranking.baseline(results, scene), results.floor.value
    return [
        Column("steady frame", "steady_frame", "s", lambda cell: cell.steady),
        Column("processes", "processes", "1", lambda cell: float(len(cell.counting)), _processes),
        Column("outlying", "outlying", "1", _outlying, _count),
        *accuracy_columns.ERRORS,
        *accuracy_columns.AGREEMENT,
        Column(
            f"time ÷ {base}" if base else "ratio", f"time_over_{base}" if base else "ratio", "1",
            lambda cell: ranking.ratio_to(results, cell, base),
            lambda value: quantity.ratio(value, floor),
        ),
        Column("the study's frame (s)", "study_frame", "s", lambda cell: study.find(study.TIMES_S, cell), study.show),
        Column(
            "rays", "rays_per_second", "1/s",
            lambda cell: cell.median("rays_per_s", "rays or steady frames are not reported"), quantity.rate,
        ),
    ]  # fmt: skip


def _outlying(cell: Cell) -> float | Missing:
    if isinstance(cell.steady, Missing):
        return cell.steady
    if len(cell.counting) < LEAST:
        return Missing(f"needs {LEAST} processes")
    return float(cell.outlying)


def _processes(value: float) -> str:
    return f"{value:.0f}" if value else UNAVAILABLE


def _count(value: float) -> str:
    return f"{value:.0f}" if value else "none"


def write(results: Results, out: Path) -> str:
    """Writes times-*.csv for each scene; returns the section of the report."""
    tables = [(scene, results.of(scene), columns(results, scene)) for scene in results.scenes]
    return table.section(out, "times", study.heading(results.cells, "Times", "table 4.1"), tables, CAPTION)
