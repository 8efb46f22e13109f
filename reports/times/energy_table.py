"""Tabulates the energy of the processor while it rendered: a frame, a million rays, and the mean power."""

from pathlib import Path

from harness.statistics import statistics
from harness.statistics.statistics import Estimate
from reports.paper import markdown, table
from reports.paper.table import Column
from reports.run.results import Cell, Missing, Results

TITLE = "Energy of the processor"
CAPTION = (
    "By RAPL, between the first and the last sample in the phase render; median over processes, with its 95 % "
    "interval. It is of whole packages, what idles there and what other programs use included, so it compares "
    "renderers that ran with the machine to themselves."
)


def write(results: Results, out: Path) -> str:
    """Writes energy-*.csv for each scene; returns the section, or one reason where no cell has an energy.

    "" of a run by a version that did not read it.
    """
    if not any("energy" in record for record in results.records):
        return ""
    energies = {cell: observed(results, cell, "energy_j") for cell in results.cells if cell.timed}
    if not any(isinstance(value, Estimate) for value in energies.values()):
        reasons = dict.fromkeys(value.reason for cell, value in energies.items() if cell.status == "ok")
        return markdown.unavailable(TITLE, "; ".join(reasons)) if reasons else ""
    tables = [(scene, results.of(scene), _columns(results)) for scene in results.scenes]
    return table.section(out, "energy", TITLE, tables, CAPTION)


def _columns(results: Results) -> list[Column]:
    def seen(title: str, name: str, unit: str) -> Column:
        return Column(title, name, unit, lambda cell: observed(results, cell, name))

    return [
        seen("energy a frame (J)", "joules_per_frame", "J"),
        seen("energy a million rays (J)", "joules_per_mray", "J"),
        seen("power (W)", "power_w", "W"),
        seen("energy (J)", "energy_j", "J"),
        seen("over", "energy_s", "s"),
    ]


def observed(results: Results, cell: Cell, name: str) -> Estimate | Missing:
    """Returns the median over processes of a value of `energy` (store.py), or why there is none."""
    readings = [results.records[row].get("energy") for row in cell.counting]
    numbers = [reading[name] for reading in readings if isinstance((reading or {}).get(name), (int, float))]
    if numbers:
        return statistics.median(numbers)
    if not readings:
        return Missing(cell.verdict)
    values = [reading.get(name, reading) for reading in readings if reading]
    return Missing(next((value["unavailable"] for value in values), "nothing ran"))
