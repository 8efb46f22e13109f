"""Writes table 4.2: peak memory, resident and virtual, with the method of measuring, beside the study's."""

from pathlib import Path

from reports.paper import quantity, table
from reports.paper.table import Column
from reports.run import study
from reports.run.results import Cell, Missing, Results

CAPTION = (
    "Peaks of one process, median over processes with its 95 % interval; MB = 10⁶ bytes. RSS: "
    "resident memory of the whole process; of rendering: the peak since a reset just before it. VMS: address "
    "space, as it reports it, or the largest sum over its processes that the measurer saw. "
    "Method VmHWM: the kernel's own high-water mark, exact, as the process read it. Method wait4: "
    "at least the floor, the peak of the program that started the renderer. The study measured on "
    "Windows, where psutil's VMS is committed memory and not address space, so that it can be below the RSS: its "
    "VMS and ours are different quantities. "
    "Processes that compiled (cold cache) and that loaded compiled code (warm cache) have separate rows."
)


def _column(title: str, name: str, reason: str) -> Column:
    return Column(title, name, "byte", lambda cell: cell.median(name, reason))


def _method(cell: Cell):
    methods = sorted(set(cell.by_row("memory_method").values()))
    if not methods:
        return Missing("not reported" if cell.status == "ok" else cell.verdict)
    floors = cell.values("floor_bytes")
    return ", ".join(methods) + (f", floor {quantity.size(max(floors))}" if floors else "")


COLUMNS = [
    _column("peak RSS", "peak_bytes", "not reported"),
    Column("the study's RSS (MB)", "study_rss", "MB", lambda cell: study.find(study.RSS_MB, cell), study.show),
    _column("peak RSS of rendering", "render_peak_bytes", "the renderer does not report it"),
    _column("peak VMS", "peak_virtual_bytes", "the renderer does not report it"),
    Column("the study's VMS (MB)", "study_vms", "MB", lambda cell: study.find(study.VMS_MB, cell), study.show),
    Column("method", "method", "", _method),
]


def write(results: Results, out: Path) -> str:
    """Writes memory-*.csv for each scene; returns the section of the report."""
    tables = [
        (scene, [part for cell in results.of(scene) for part in cell.by_cache()], COLUMNS) for scene in results.scenes
    ]
    return table.section(out, "memory", study.heading(results.cells, "Memory", "table 4.2"), tables, CAPTION)
