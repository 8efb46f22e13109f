"""GPU cells of a run: which cells used a GPU, how they were launched, what was observed of the device."""

from harness.statistics import statistics
from harness.statistics.statistics import Estimate
from reports.run.results import Cell, Missing, Results


def cells(results: Results, scene: str) -> list[Cell]:
    """The cells of a scene with a GPU, but for exhibits, whose numbers mean nothing."""
    return [cell for cell in results.of(scene) if cell.gpu and not cell.exhibit]


def scenes(results: Results) -> list[str]:
    """The scenes with such cells."""
    return [scene for scene in results.scenes if cells(results, scene)]


def record(results: Results, cell: Cell) -> dict | None:
    """The first record of a cell that says what was used, timed or not."""
    mine = (results.records[row] for row in cell.timed + cell.loaded)
    return next((record for record in mine if record["used"]), None)


def device(results: Results, cell: Cell, name: str):
    """A property of the device as the renderer told it; Missing if it did not."""
    told = ((record(results, cell) or {}).get("device") or {}).get(name)
    return Missing("the renderer does not tell it") if told is None else told


def method(results: Results, cell: Cell, name: str):
    """A method as the renderer used it (renderers/README.md); Missing if it did not tell."""
    found = record(results, cell)
    told = ((found or {}).get("used") or {}).get("methods", {}).get(name)
    if told is not None:
        return told
    if found is None and cell.status != "ok":
        return Missing(cell.verdict)
    return Missing("the CUDA simulator has none" if cell.simulated else "the renderer does not tell it")


def block(results: Results, cell: Cell) -> tuple[int, int] | None:
    """(width, height) of a block in threads; None if it is not known."""
    told = method(results, cell, "block")
    if isinstance(told, str):
        width, height = told.split("x")
        return int(width), int(height)
    sides = cell.parameters.get("block_width"), cell.parameters.get("block_height")
    return None if None in sides else sides


def threads(results: Results, cell: Cell) -> int:
    """Threads as launched, else as asked for."""
    told = method(results, cell, "total_threads")
    return (cell.parameters.get("total_threads") or cell.pixels) if isinstance(told, Missing) else told


def observed_rows(cell: Cell):
    """The repetitions in which the device is looked at: the load pass, else the timed ones."""
    return cell.load if cell.loaded else cell.rows


def observed(results: Results, cell: Cell, name: str) -> Estimate | Missing:
    """Median over processes of a value that was seen of the device."""
    rows = observed_rows(cell)
    good = [results.records[index] for index in rows.index[rows["status"] == "ok"]]
    told = [(record.get("gpu") or {}).get(name) for record in good]
    numbers = [float(value) for value in told if isinstance(value, (int, float))]
    if numbers:
        return statistics.median(numbers)
    if not good:
        worst = rows.iloc[0] if len(rows) else None
        return Missing(cell.verdict if worst is None else f"{worst['status']}: {worst['reason']}")
    if cell.simulated:
        return Missing("the CUDA simulator uses no GPU")
    return Missing(next((value["unavailable"] for value in told if isinstance(value, dict)), "not told"))
