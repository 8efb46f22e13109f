"""Finds the cells that used a GPU, how their kernels were launched, and observations of the device."""

from harness.statistics import statistics
from harness.statistics.statistics import Estimate
from reports.run.results import Cell, Missing, Results

NOT_REPORTED = "the renderer does not report it"
SIMULATED = "simulated: times mean nothing"


def cells(results: Results, scene: str) -> list[Cell]:
    """Returns the cells of a scene that used a GPU, without exhibits, whose numbers mean nothing."""
    return [cell for cell in results.of(scene) if cell.gpu and not cell.exhibit]


def scenes(results: Results) -> list[str]:
    """Returns the scenes with such cells."""
    return [scene for scene in results.scenes if cells(results, scene)]


def record(results: Results, cell: Cell) -> dict | None:
    """Returns the first record of a cell, timed or not, that reports the methods used; None if none does."""
    records = (results.records[row] for row in cell.timed + cell.loaded)
    return next((record for record in records if record["used"]), None)


def device(results: Results, cell: Cell, name: str):
    """Returns a property of the device that the renderer reported; Missing if it did not."""
    value = ((record(results, cell) or {}).get("device") or {}).get(name)
    return Missing(NOT_REPORTED) if value is None else value


def mark(results: Results, cells: list[Cell]) -> str:
    """Returns what a chart must say across it of where these cells ran; "" for a GPU."""
    if any(cell.simulated for cell in cells):
        return SIMULATED
    processors = [str(device(results, cell, "name")) for cell in cells if device(results, cell, "type") == "cpu"]
    return f"a processor, not a GPU: {processors[0]}" if processors else ""


def method(results: Results, cell: Cell, name: str):
    """Returns a method as the renderer used it (renderers/README.md); Missing if it did not report it."""
    report = record(results, cell)
    used = ((report or {}).get("used") or {}).get("methods", {}).get(name)
    if used is not None:
        return used
    if report is None and cell.status != "ok":
        return Missing(cell.verdict)
    return Missing("the CUDA simulator has none" if cell.simulated else NOT_REPORTED)


def block(results: Results, cell: Cell) -> tuple[int, int] | None:
    """Returns (width, height) of a block in threads; None if not known."""
    used = method(results, cell, "block")
    if isinstance(used, str):
        width, height = used.split("x")
        return int(width), int(height)
    sides = cell.parameters.get("block_width"), cell.parameters.get("block_height")
    return None if None in sides else sides


def threads(results: Results, cell: Cell) -> int:
    """Returns the number of threads launched, else the number asked for."""
    used = method(results, cell, "total_threads")
    return (cell.parameters.get("total_threads") or cell.pixels) if isinstance(used, Missing) else used


def observed_rows(cell: Cell):
    """Returns the repetitions that observe the device: those of the load pass, else the timed ones."""
    return cell.load if cell.loaded else cell.rows


def observed(results: Results, cell: Cell, name: str) -> Estimate | Missing:
    """Returns the median over processes of an observation of the device."""
    rows = observed_rows(cell)
    good = [results.records[index] for index in rows.index[rows["status"] == "ok"]]
    values = [(record.get("gpu") or {}).get(name) for record in good]
    numbers = [float(value) for value in values if isinstance(value, (int, float))]
    if numbers:
        return statistics.median(numbers)
    if not good:
        worst = rows.iloc[0] if len(rows) else None
        return Missing(cell.verdict if worst is None else f"{worst['status']}: {worst['reason']}")
    if cell.simulated:
        return Missing("the CUDA simulator uses no GPU")
    return Missing(next((value["unavailable"] for value in values if isinstance(value, dict)), "not reported"))
