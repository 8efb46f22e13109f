"""Table 4.1: the time of a steady frame, the study's beside it, the ratio to a baseline, and always the error."""

from pathlib import Path

from reports import accuracy_columns, quantity, ranking, study, table
from reports.results import Results
from reports.table import Column

CAPTION = (
    "A steady frame is any after the first of a process; the time is the mean over processes of each process's "
    "mean, ± the half-width of Student's 95 % interval. A ratio is of such means, with a percentile bootstrap "
    "interval over processes; it is not resolved if the interval holds 1. The study's time is shown where its "
    "scene and variables are the same "
    f"(comparison, 512 × 512, depth 10, no shadows, float64). {accuracy_columns.CAPTION} "
    "Rays per second counts primary, reflected, transmitted and shadow rays."
)


def columns(results: Results, scene: str) -> list[Column]:
    base = ranking.baseline(results, scene)
    return [
        Column("steady frame (s)", "steady_frame", "s", lambda cell: cell.mean("steady_s", "no steady frames")),
        *accuracy_columns.COLUMNS,
        Column(
            f"time ÷ {base}" if base else "ratio", f"time_over_{base}" if base else "ratio", "1",
            lambda cell: ranking.ratio_to(results, cell, base), _show_ratio,
        ),
        Column("the study's frame (s)", "study_frame", "s", lambda cell: study.find(study.TIMES_S, cell), study.show),
        Column(
            "rays per second (millions)", "rays_per_second", "1/s",
            lambda cell: cell.mean("rays_per_s", "rays or steady frames are not told"),
            lambda value: quantity.text(value, 1e-6),
        ),
    ]  # fmt: skip


def _show_ratio(value) -> str:
    return value if isinstance(value, str) else quantity.ratio(value)


def write(results: Results, out: Path) -> str:
    """times-*.csv, one a scene, and the section of the report."""
    tables = [(scene, results.of(scene), columns(results, scene)) for scene in results.scenes]
    return table.section(out, "times", "Times (the study's table 4.1)", tables, CAPTION)
