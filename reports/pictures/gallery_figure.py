"""Draws the study's figures that show pictures: one for each figure number that names cases of an experiment.

A case called "figure 3.1a, one sample" is panel a of figure 3.1; a letter or a caption may be left out.
"""

import re
import textwrap

import matplotlib.pyplot as plt

from reports.paper import markdown, style
from reports.pictures import pictures_figure
from reports.run import stored
from reports.run.results import Cell, Missing, Results

NAMED = re.compile(r"figure (\d+\.\d+)([a-z]?)(?:, (.*))?")
CAPTION = (
    "Scenes of our own that show what the study's figure shows: the first renderer of each case that is ok, enlarged "
    "by a whole factor, with its error and whether it agrees with another renderer's."
)
HEAD, GAP, BELOW = 60, 30, 110  # pixels
LARGE, WIDE = 750, 1600  # pixels: up to which small pictures are enlarged; of a figure


def panels(results: Results) -> dict[str, list[tuple[str, Cell | None, str]]]:
    """Returns the panels of each figure by its number: (caption, the cell to show or None, why there is none)."""
    figures: dict[str, dict[str, list[Cell]]] = {}
    for cell in results.cells:
        named = NAMED.fullmatch(str(cell.swept.get("case", "")))
        if named:
            number, letter, caption = named.groups()
            title = ": ".join(filter(None, (letter, caption))) or number
            figures.setdefault(number, {}).setdefault(title, []).append(cell)
    return {
        number: [(title, *_first(results, cells)) for title, cells in titles.items()]
        for number, titles in sorted(figures.items(), key=lambda item: [int(part) for part in item[0].split(".")])
    }


def _first(results: Results, cells: list[Cell]) -> tuple[Cell | None, str]:
    for cell in cells:
        if cell.status == "ok" and not isinstance(stored.picture(results, cell), Missing):
            return cell, ""
    return None, cells[0].verdict if cells[0].status != "ok" else str(stored.picture(results, cells[0]))


def draw(results: Results, entries: list[tuple[str, Cell | None, str]]):
    """Draws the panels of one figure, in rows."""
    pictures = [stored.displayed(stored.picture(results, cell), cell) if cell else None for _, cell, _ in entries]
    sizes = [
        pictures_figure.panel_size(*picture.shape[:2], smallest=LARGE) if picture is not None else (LARGE,) * 2
        for picture in pictures
    ]
    block = max(width for _, width in sizes) + GAP
    columns = min(len(entries), max(1, (WIDE - GAP) // block))
    rows = [sizes[first : first + columns] for first in range(0, len(sizes), columns)]
    heights = [max(height for height, _ in row) + HEAD + BELOW for row in rows]
    wide, high = columns * block + GAP, sum(heights)
    figure = plt.figure(figsize=(wide / style.DPI, high / style.DPI))
    for number, ((title, cell, why), picture, (height, width)) in enumerate(zip(entries, pictures, sizes, strict=True)):
        row, column = divmod(number, columns)
        left = GAP + column * block + (block - GAP - width) // 2
        axes = pictures_figure.panel(figure, left, sum(heights[:row]) + HEAD, height, width)
        axes.set_title(title, fontweight="bold")
        if cell is None:
            pictures_figure.say(axes, why)
        else:
            axes.imshow(picture, interpolation="nearest", aspect="auto")
            text = f"{cell.label}: {cell.errors}; agreement {cell.agreement}"
            text = textwrap.fill(text, pictures_figure.letters(block - GAP))
            axes.text(0.5, -0.02, text, transform=axes.transAxes, ha="center", va="top", fontsize=pictures_figure.PRINT)
    return figure


def write(results: Results, out) -> str:
    """Writes gallery-NUMBER.png and .svg for each figure of the study; returns the section, "" if there is none."""
    parts = []
    for number, entries in panels(results).items():
        path, alt = out / f"gallery-{markdown.slug(number)}", f"Figure {number} of the study"
        parts += [f"### The study's figure {number}", style.figure(path, alt, draw, results, entries)]
    return "\n\n".join(["## The study's pictures", *parts, markdown.escape(CAPTION)]) if parts else ""
