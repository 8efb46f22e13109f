"""The study's figures that are pictures: a figure for each number that cases of an experiment are named after.

A case called "figure 3.1a, one sample" is panel a of figure 3.1; a letter or a caption may be left out.
"""

import re

import matplotlib.pyplot as plt
import numpy as np

from reports.accuracy import accuracy_columns
from reports.paper import markdown, style
from reports.pictures import pictures_figure
from reports.run import stored
from reports.run.results import Cell, Missing, Results

NAMED = re.compile(r"figure (\d+\.\d+)([a-z]?)(?:, (.*))?")
CAPTION = (
    "Our own scenes, of what the study's figure shows: the first variant of each case that is ok, enlarged by a whole "
    "number, and its largest difference from the reference, which another renderer made."
)
HEAD, GAP, BELOW = 50, 30, 70  # pixels
LARGE = 800  # pixels, up to which small pictures are enlarged: there is nothing else to see


def panels(results: Results) -> dict[str, list[tuple[str, Cell | None, str]]]:
    """By number of a figure its panels: (caption, the cell that is shown or None, why there is none)."""
    found: dict[str, dict[str, list[Cell]]] = {}
    for cell in results.cells:
        named = NAMED.fullmatch(str(cell.swept.get("case", "")))
        if named:
            number, letter, caption = named.groups()
            title = ": ".join(filter(None, (letter, caption))) or number
            found.setdefault(number, {}).setdefault(title, []).append(cell)
    return {
        number: [(title, *_first(results, cells)) for title, cells in titles.items()]
        for number, titles in sorted(found.items(), key=lambda item: [int(part) for part in item[0].split(".")])
    }


def _first(results: Results, cells: list[Cell]) -> tuple[Cell | None, str]:
    for cell in cells:
        if cell.status == "ok" and not isinstance(stored.picture(results, cell), Missing):
            return cell, ""
    return None, cells[0].verdict if cells[0].status != "ok" else str(stored.picture(results, cells[0]))


def draw(results: Results, found: list[tuple[str, Cell | None, str]]):
    """The panels of one figure beside each other."""
    pictures = [_picture(results, cell) if cell else None for _, cell, _ in found]
    sizes = [
        pictures_figure.panel_size(*picture.shape[:2], smallest=LARGE) if picture is not None else (LARGE,) * 2
        for picture in pictures
    ]
    wide = sum(size[1] for size in sizes) + GAP * (len(sizes) + 1)
    high = max(size[0] for size in sizes) + HEAD + BELOW
    figure, left = plt.figure(figsize=(wide / style.DPI, high / style.DPI)), GAP
    for (title, cell, why), picture, (height, width) in zip(found, pictures, sizes, strict=True):
        axes = figure.add_axes((left / wide, 1 - (HEAD + height) / high, width / wide, height / high))
        axes.set(xticks=[], yticks=[])
        axes.spines[:].set_visible(False)
        axes.set_title(title, fontweight="bold")
        if cell is None:
            pictures_figure.say(axes, why)
        else:
            axes.imshow(picture, interpolation="nearest", aspect="auto")
            axes.text(0.5, -0.02, f"{cell.label}: {accuracy_columns.shown(cell)}", transform=axes.transAxes,
                      ha="center", va="top", fontsize=6)  # fmt: skip
        left += width + GAP
    return figure


def _picture(results: Results, cell: Cell) -> np.ndarray:
    return pictures_figure.shown(stored.picture(results, cell), cell.parameters.get("arithmetic", "linear"))


def write(results: Results, out) -> str:
    """gallery-NUMBER.png and .svg, one a figure of the study, and the section of the report; "" if it has none."""
    parts = []
    for number, found in panels(results).items():
        name = f"gallery-{markdown.slug(number)}"
        with style.styled():
            style.save(draw(results, found), out / name)
        parts += [f"### The study's figure {number}", markdown.figure(name, f"Figure {number} of the study")]
    return "\n\n".join(["## The study's pictures", *parts, markdown.escape(CAPTION)]) if parts else ""
