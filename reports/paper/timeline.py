"""Serves figures over the life of one process: chooses the place to draw and shades phases behind the curves."""

from collections import Counter

from matplotlib.patches import Patch

from reports.paper import style
from reports.run.results import Cell


def largest_place(cells: list[Cell]) -> tuple[str, str]:
    """Returns the place with the most pixels; of several the one with the most cells, the first of these."""
    counts = Counter(cell.place for cell in cells)
    return max(cells, key=lambda cell: (cell.pixels, counts[cell.place])).place


def shade(axes, record: dict, named: bool = True) -> list[str]:
    """Shades the phases of a record and returns their names. named: also writes each name where it fits."""
    wall = record["wall_s"]
    for name, start, end in record["phases"]:
        axes.axvspan(start, end, color=style.PHASES.get(name, style.OTHER_PHASE), lw=0)
        if named and end - start > 0.012 * wall * (len(name) + 1):
            axes.text((start + end) / 2, 0.93, name, transform=axes.get_xaxis_transform(), ha="center", va="top",
                      fontsize=6, color="#444444")  # fmt: skip
    return [name for name, _, _ in record["phases"]]


def legend(figure, seen) -> None:
    """Writes the colours of the phases in `seen` below the figure."""
    order = dict.fromkeys(name for name in (*style.PHASES, *seen) if name in seen)
    patches = [Patch(color=style.PHASES.get(name, style.OTHER_PHASE), label=name) for name in order]
    if patches:
        figure.legend(
            handles=patches, loc="lower center", ncols=len(patches), title="phases", title_fontsize=7,
            handlelength=1, handletextpad=0.4, columnspacing=0.8,  # all of them fit into a line
        )  # fmt: skip
