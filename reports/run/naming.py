"""The full name of a cell, for use outside a report: "cpp, comparison, depth = 3"."""

from pathlib import Path

from reports.run.results import Cell


def names(cells: list[Cell]) -> list[str]:
    """A name for each; a scene is called by its path only where two scenes have the same stem."""
    stems: dict[str, set[str]] = {}
    for cell in cells:
        stems.setdefault(Path(cell.scene).stem, set()).add(cell.scene)
    called = {scene: stem if len(scenes) == 1 else scene for stem, scenes in stems.items() for scene in scenes}
    return [
        ", ".join([cell.label, called[cell.scene], *(f"{key} = {value}" for key, value in cell.swept.items())])
        for cell in cells
    ]
