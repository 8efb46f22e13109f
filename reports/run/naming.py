"""Names cells in full, for use outside a report: "cpp, comparison, depth = 3"."""

from pathlib import Path

from reports.run.results import Cell, grouped


def names(cells: list[Cell]) -> list[str]:
    """Returns a name for each cell; it has the path of a scene only where two scenes have the same stem."""
    stems = grouped({cell.scene for cell in cells}, lambda scene: Path(scene).stem)
    called = {scene: stem if len(scenes) == 1 else scene for stem, scenes in stems.items() for scene in scenes}
    return [
        ", ".join([cell.label, called[cell.scene], *(f"{key} = {value}" for key, value in cell.swept.items())])
        for cell in cells
    ]
