"""Tabulates start-up: compile time, first frame, and the number of frames after which compiling has paid off."""

import math
from pathlib import Path

from harness.statistics import statistics
from harness.statistics.statistics import Estimate
from reports.accuracy import accuracy_columns
from reports.paper import quantity, table
from reports.paper.table import Column
from reports.run import ranking, study
from reports.run.results import Cell, Missing, Results

BUILD = "the build of a program that is compiled beforehand"
CAPTION = (
    "compile, cold: with an empty cache, or the build of a program that is compiled beforehand, marked (build). "
    "compile, warm: with code from an earlier process. none: it has no such phase. Break-even: the frames, "
    "counted from 1, for which compile + first frame + (frames - 1) × steady frame is less than the same sum of "
    "the other renderer, from the medians; start and import of a process and loading of the scene are left out on "
    "both sides. The study's compile times are about, from its section 4.2.1."
)


def lead(start: float, steady: float, other_start: float, other_steady: float) -> tuple[int, int | None] | None:
    """Returns the first and last n >= 1 for which start + (n - 1) steady < other_start + (n - 1) other_steady.

    The last is None if it leads for ever; None if it never leads. start: compile + first frame. All times in s.
    """
    gap, gain = start - other_start, other_steady - steady
    if gap < 0:
        return 1, None if gain >= 0 else math.ceil(gap / gain)
    if gain <= 0:
        return None
    return math.floor(gap / gain) + 2, None


def compile_s(cell: Cell, warm: bool):
    """Returns the median time of the phase `compile`, s, with a warm or cold cache; "none" without such a phase."""
    if cell.status != "ok":
        return Missing(cell.verdict)
    if not cell.values("compile_s"):
        return "none"
    cache = cell.by_row("compile_cache")
    values = [value for row, value in cell.by_row("compile_s").items() if (cache.get(row) == "warm") == warm]
    return statistics.median(values) if values else Missing(f"no process had a {'warm' if warm else 'cold'} cache")


def cold(cell: Cell):
    """Returns `compile_s` with a cold cache, or the build."""
    build = cell.values("build_s")
    if build and not cell.values("compile_s"):
        return Estimate(build[0], None, None, 1, BUILD)
    return compile_s(cell, warm=False)


def show_cold(value) -> str:
    built = isinstance(value, Estimate) and value.note == BUILD
    return f"{quantity.seconds(value.value)} (build)" if built else quantity.seconds(value)


def start_s(cell: Cell, warm: bool) -> float | None:
    """Returns compile + first frame, s, with the build if nothing is warm; None if not known."""
    compiled = compile_s(cell, warm)
    if isinstance(compiled, Missing) or not cell.values("first_s"):
        return None
    build = 0.0 if warm else sum(cell.values("build_s")[:1])
    return build + (0.0 if compiled == "none" else compiled.value) + statistics.median(cell.values("first_s")).value


def opponent(results: Results, place: tuple[str, str]) -> Cell | None:
    """Returns the cell that the others must overtake: `python`, else the slowest ranked one."""
    ranked = ranking.ranked(results, place)
    return next((cell for cell in ranked if cell.variant == "python"), ranked[-1] if ranked else None)


def break_even(results: Results, cell: Cell, warm: bool):
    """Returns the first number of frames for which a cell leads, with the whole span as note; text if it never does."""
    other = opponent(results, cell.place)
    if cell.unranked or other is None:
        return Missing(f"not ranked: {cell.unranked}")
    if other is cell:
        return "the others are compared with this"
    start, its = start_s(cell, warm), start_s(other, warm)
    if start is None or its is None:
        return Missing(f"no process had a {'warm' if warm else 'cold'} cache")
    steady, its_steady = cell.steady.value, other.steady.value
    span = lead(start, steady, its, its_steady)
    if span is None:
        return f"never ahead of {other.name}"
    end = f", until {span[1]}" if span[1] else ""
    return Estimate(span[0], None, None, len(cell.counting), f"breaks even with {other.name} at frame {span[0]}{end}")


def _show_lead(value) -> str:
    return value.note if isinstance(value, Estimate) else value


def columns(results: Results) -> list[Column]:
    return [
        Column("compile, cold", "compile_cold", "s", cold, show_cold),
        Column("compile, warm", "compile_warm", "s", lambda cell: compile_s(cell, warm=True)),
        Column(
            "the study's compile (s)", "study_compile", "s",
            lambda cell: study.find(study.COMPILE_S, cell), study.show,
        ),
        Column("first frame", "first_frame", "s", lambda cell: cell.median("first_s", "no frames are told")),
        *accuracy_columns.ERRORS,
        *(
            Column(
                f"break-even, {cache}", f"break_even_{cache}", "frames",
                lambda cell, warm=cache == "warm": break_even(results, cell, warm), _show_lead,
            )
            for cache in ("cold", "warm")
        ),
    ]  # fmt: skip


def write(results: Results, out: Path) -> str:
    """Writes startup-*.csv for each scene; returns the section of the report."""
    tables = [(scene, results.of(scene), columns(results)) for scene in results.scenes]
    return table.section(out, "startup", "Start-up and break-even", tables, CAPTION)
