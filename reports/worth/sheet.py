"""Draws a contact sheet of `rayrace needs`: the picture without each thing, and where it differs from the full one."""

import textwrap
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from harness.picture.colour import encode_8bit
from reports.paper import style

PAIRS = 3  # of a picture and its difference, in a row
MOST = 23  # leave-outs
WIDTH, HEIGHT = 8.0, 12.0  # inches: of the sheet, and of its height at most
LETTERS = 46  # of a line of small print above a pair
ABOVE, BELOW = 0.34, 0.62  # inches: for the words above a pair, and for the bar below all
SCALE = (1e-4, 1.0)  # of differences, linear RGB


def write(path: Path, full: np.ndarray, pictures: list[tuple[str, str, np.ndarray]]) -> None:
    """Writes the sheet to `path`, whose suffix matplotlib knows.

    full, and those of `pictures`: linear RGB (height, width, 3). pictures: what is left out, the RMSE from the truth
    without it as text, and the picture, in the order in which they are shown.
    """
    with style.styled():
        figure = draw(full, pictures)
        style.save_as(figure, path)
        plt.close(figure)


def draw(full: np.ndarray, pictures: list[tuple[str, str, np.ndarray]]) -> Figure:
    """Draws the first MOST, and says of how many."""
    shown = pictures[:MOST]
    rows = -(-(1 + len(shown)) // PAIRS)
    wide = WIDTH / (2 * PAIRS)  # inches of a panel, at most
    shape = full.shape[0] / full.shape[1]
    high = min(wide * shape, (HEIGHT - BELOW) / rows - ABOVE)
    size = WIDTH, rows * (high + ABOVE) + BELOW
    figure, norm = plt.figure(figsize=size), LogNorm(*SCALE, clip=True)

    def panel(number: int, side: int):
        row, column = divmod(number, PAIRS)
        left, top = (2 * column + side) * wide, row * (high + ABOVE) + ABOVE
        axes = figure.add_axes((left / WIDTH, 1 - (top + high) / size[1], 0.97 * wide / WIDTH, high / size[1]))
        axes.set(xticks=[], yticks=[], anchor="W")
        axes.spines[:].set_visible(False)
        return axes

    axes = panel(0, 0)
    axes.imshow(encode_8bit(full), interpolation="nearest")
    _say(axes, "full model", f"first {MOST} of {len(pictures)}" if len(pictures) > MOST else "")
    for number, (name, rmse, picture) in enumerate(shown, 1):
        axes = panel(number, 0)
        axes.imshow(encode_8bit(picture), interpolation="nearest")
        _say(axes, name, f"RMSE {rmse}")
        difference = np.abs(picture - full).max(axis=-1)
        axes = panel(number, 1)
        axes.set_facecolor("#DDDDDD")
        axes.imshow(np.ma.masked_equal(difference, 0), norm=norm, cmap="viridis", interpolation="nearest")
    bar = figure.add_axes((0.25, 0.42 / size[1], 0.5, 0.1 / size[1]))
    drawn = figure.colorbar(ScalarMappable(norm, "viridis"), cax=bar, orientation="horizontal")
    drawn.set_ticks([1e-4, 1e-3, 1 / 255, 1e-2, 0.1, 1], labels=["1e-4", "1e-3", "1/255", "", "0.1", "1"])
    drawn.minorticks_off()
    drawn.set_label("difference from the full model: largest of the channels, linear RGB (grey: exactly 0)")
    return figure


def _say(axes, name: str, fact: str) -> None:
    """Writes two lines of words above a pair, from the left."""
    lines = textwrap.wrap(name, LETTERS, max_lines=2, placeholder=" ..")
    text = "\n".join(lines) + (("\n" if len(lines) == 1 else ", ") + fact if fact else "")
    axes.text(0, 1.01, text, transform=axes.transAxes, ha="left", va="bottom", fontsize=6)
