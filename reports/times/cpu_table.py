"""Tabulates CPU time by wait4 and by the measurer, and how well the measurer kept its interval."""

from pathlib import Path

from reports.paper import table
from reports.paper.table import Column
from reports.run.results import Cell, Missing, Results

CAPTION = (
    "CPU time: user and system time of the process and its descendants, from wait4, median over processes with its "
    "95 % interval. Measured: the integral of the measurer's curve over the same processes, as a share of it; 100 % is "
    "agreement. Flagged: processes whose two numbers differ by over 10 %, more than the clock's ticks explain: "
    "do not trust their curves. Interval: between two samples of the measurer, the median over processes of the "
    "50th and the largest of the 99th percentiles; missed: late samples, of all. The measurer is a process "
    "beside the renderer's; its own CPU time is the median over processes."
)
NO_AUDIT = "the measurer reported nothing, or sampled the process less than twice"


def _share(cell: Cell):
    """Returns the measured share of wait4's CPU time over all repetitions that have both."""
    measured, waited = cell.by_row("measured_cpu_s"), cell.by_row("cpu_s")
    total = sum(waited[row] for row in measured)
    if not total:
        return Missing("no series was stored" if cell.status == "ok" else cell.verdict)
    return sum(measured.values()) / total


def _flagged(cell: Cell):
    if not cell.counting:
        return Missing(cell.verdict)
    count = sum(cell.by_row("cpu_off").values())
    return f"{count} of {len(cell.counting)}" if count else "none"


def _worst(cell: Cell):
    return max(cell.values("tick_p99_s"), default=_no_audit(cell))


def _missed(cell: Cell):
    missed, ticks = (sum(cell.values(name)) for name in ("missed_ticks", "ticks"))
    return f"{missed:.0f} of {missed + ticks:.0f}" if missed + ticks else _no_audit(cell)


def _no_audit(cell: Cell) -> Missing:
    return Missing(NO_AUDIT if cell.status == "ok" else cell.verdict)


COLUMNS = [
    Column("CPU time", "cpu_s", "s", lambda cell: cell.median("cpu_s", "not reported")),
    Column("measured (%)", "measured_share", "1", _share, scale=100),
    Column("flagged", "flagged", "", _flagged),
    Column("interval, p50", "tick_p50_s", "s", lambda cell: cell.median("tick_p50_s", NO_AUDIT)),
    Column("p99", "tick_p99_s", "s", _worst),
    Column("missed", "missed", "", _missed),
    Column("the measurer's CPU time", "measurer_cpu_s", "s", lambda cell: cell.median("measurer_cpu_s", NO_AUDIT)),
]


def write(results: Results, out: Path) -> str:
    """Writes cpu-time-*.csv for each scene; returns the section of the report."""
    tables = [(scene, results.of(scene), COLUMNS) for scene in results.scenes]
    return table.section(out, "cpu-time", "CPU time, and the measurer's audit of itself", tables, CAPTION)
