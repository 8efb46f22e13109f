"""Draws figure 4.1: the truth, and the picture of each variant, pixel for pixel, above its difference from it."""

import textwrap
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm

from harness.store import record
from reports.paper import markdown, style, thinning
from reports.run import launch, method, naming, stored, study
from reports.run.results import Cell, Missing, Results, place_label

TITLE = "Pictures"
CAPTION = (
    "First the truth; then, above, each picture; below, its error: the largest absolute difference in any channel of "
    "linear RGB from the truth, on a logarithmic scale common to all; grey where it is exactly 0, magenta where a "
    "pixel is not finite. A small picture is enlarged by a whole factor, one of more than 1024 pixels is reduced; "
    "others are shown pixel for pixel. Points that differ only in how the kernel of a GPU is launched are drawn once, "
    "and again where one is not ok. Exhibits have a figure of their own."
)

SMALL, LARGEST = 480, 1024  # of a panel, in pixels of the PNG
TEXT_WIDTH = 490  # least width of the text below a panel, pixels
ABOVE, BETWEEN, BELOW, GAP, BAR = 60, 16, 150, 30, 190  # pixels
COLUMNS, WIDE, HIGH = 3, 1600, 2400  # at most, of a figure: columns, pixels
MOST = 24  # figures
TICK = 75.0  # pixels of the label of a tick
PRINT = 8.2  # points of small print, 6 of a figure of 1600 pixels in a column (form.py)
LETTER = 12.4  # pixels of a letter of small print, on average
SMALLEST, LEAST = 1e-17, 1e-5  # errors of the scale: of an exact truth, of a sampled one, which has noise


def panel_size(height: int, width: int, largest: int = LARGEST, smallest: int = SMALL) -> tuple[int, int]:
    """Returns (height, width) at which a picture is shown, pixels of the PNG."""
    longest = max(height, width)
    if longest > largest:
        return max(1, round(height * largest / longest)), max(1, round(width * largest / longest))
    zoom = max(1, smallest // longest)
    return height * zoom, width * zoom


def panel(figure, left: float, top: float, height: float, width: float):
    """Adds empty axes without a frame at a place in pixels from the upper left corner."""
    wide, high = figure.get_size_inches() * style.DPI
    axes = figure.add_axes((left / wide, 1 - (top + height) / high, width / wide, height / high))
    axes.set(xticks=[], yticks=[])
    axes.spines[:].set_visible(False)
    return axes


def letters(wide: int) -> int:
    """Returns how many letters of small print fit into a line of so many pixels."""
    return int(wide / LETTER)


def notes(results: Results, cell: Cell) -> list[str]:
    """Returns the texts below a panel: the error of a picture, and whether it agrees."""
    cell_record = results.record(cell) or {}
    return [record.error_of(cell_record.get("error")), record.agreement_of(cell_record.get("agreement"))]


def told_of_truth(results: Results, cell: Cell) -> list[str]:
    """Returns the texts below the truth of a cell: its samples and depth, how well it is known, what it is held to."""
    error = (results.record(cell) or {}).get("error") or {}
    words = [
        f"by {error['truth']}" if "truth" in error else "",
        f"{error['samples']} samples of a pixel" if error.get("samples", 1) > 1 else "",
        f"depth {error['depth']}" if error.get("depth") is not None else "",
        f"known to {error['uncertainty']:.2g} (RMS)" if error.get("uncertainty") else "",
    ]
    return [", ".join(filter(None, words)), *filter(None, [error and record.basis(error)])]


def least(results: Results, cell: Cell) -> float:
    """Returns the smallest error of the colour scale."""
    return LEAST if method.sampled((results.record(cell) or {}).get("error") or {}) else SMALLEST


def with_truth(results: Results, cells: list[Cell]) -> Cell:
    """Returns the first cell of a place whose truth is stored, else the first one; all of a place have one truth."""
    return next((cell for cell in cells if not isinstance(stored.truth(results, cell), Missing)), cells[0])


def places(results: Results) -> list[tuple[tuple[str, str], list[Cell]]]:
    """Returns the places to draw, each with its cells: of numbers of threads, which make one picture, the first."""
    all_places, seen = [], set()
    for place in results.places:
        cells = [cell for cell in results.at(place) if not cell.exhibit and cell.parameters.get("kind") != "rays"]
        cells = list({(cell.variant, cell.status): cell for cell in reversed(cells)}.values())[::-1]
        alike = frozenset((cell.scene, cell.variant, launch.rest(cell, launch.UNSEEN)) for cell in cells)
        if cells and (alike not in seen or any(cell.status != "ok" for cell in cells)):
            all_places.append((place, cells))
        seen.add(alike)
    return all_places


def blocks(cells: list[Cell]) -> tuple[int, int, int, int]:
    """Returns the height and width (pixels) of a picture with its error and texts, and how many rows and columns of
    them a figure holds.
    """
    high, wide = panel_size(*cells[0].size)
    high, wide = ABOVE + 2 * high + BETWEEN + BELOW, max(wide, TEXT_WIDTH) + GAP
    return high, wide, max(1, (HIGH - BAR) // high), min(COLUMNS, max(1, (WIDE - GAP) // wide))


def figures(cells: list[Cell]) -> list[list[Cell | None]]:
    """Returns what each figure of a place shows: None, which is the truth, and the cells."""
    *_, rows, columns = blocks(cells)
    shown, most = [None, *cells], rows * columns
    return [shown[first : first + most] for first in range(0, len(shown), most)]


def draw(results: Results, cells: list[Cell], shown: list[Cell | None]):
    """Draws a figure of a place with these cells; `shown` are those of the figure."""
    (high, wide), (block_high, block_wide, _, columns) = panel_size(*cells[0].size), blocks(cells)
    columns = min(columns, len(shown))
    rows = -(-len(shown) // columns)
    total_high, total_wide = rows * block_high + BAR, columns * block_wide + GAP
    figure = plt.figure(figsize=(total_wide / style.DPI, total_high / style.DPI))
    first = with_truth(results, cells)
    norm = LogNorm(least(results, first), 1.0, clip=True)
    for number, cell in enumerate(shown):
        row, column = divmod(number, columns)
        left = GAP + column * block_wide + (block_wide - GAP - wide) // 2
        top = row * block_high + ABOVE
        above = panel(figure, left, top, high, wide)
        if cell is None:
            _truth(results, first, above, block_wide - GAP)
            continue
        above.set_title(cell.label, fontweight="bold")
        below = panel(figure, left, top + high + BETWEEN, high, wide)
        _panels(results, cell, above, below, norm, block_wide - GAP)
    _bar(figure, panel(figure, total_wide * 0.1, total_high - BAR + 40, 22, total_wide * 0.8), norm)
    return figure


def _truth(results: Results, cell: Cell, axes, room: int) -> None:
    axes.set_title("the truth", fontweight="bold")
    truth = stored.truth(results, cell)
    if isinstance(truth, Missing):
        say(axes, str(truth))
        return
    axes.imshow(stored.displayed(truth, cell), interpolation="nearest", aspect="auto")
    _below(axes, told_of_truth(results, cell), room)


def _below(axes, texts: list[str], room: int, colour: str = "black") -> None:
    """Writes texts below a panel, in lines of at most `room` pixels."""
    lines = [line for text in texts for line in textwrap.wrap(text, letters(room))]
    place = {"transform": axes.transAxes, "ha": "center", "va": "top"}
    axes.text(0.5, -0.02, "\n".join(lines), **place, fontsize=PRINT, color=colour)


def _panels(results: Results, cell: Cell, above, below, norm, room: int) -> None:
    picture = stored.raw(results, cell)
    above.imshow(stored.displayed(picture, cell), interpolation="nearest", aspect="auto")
    texts = notes(results, cell) if cell.status == "ok" else [cell.verdict]
    _below(below, texts, room, "black" if cell.status == "ok" or cell.as_meant else "#B00000")
    truth = stored.truth(results, cell)
    if not isinstance(truth, Missing) and truth.shape != picture.shape:
        truth = Missing(f"the shape of the picture is {picture.shape}, the truth's {truth.shape}")
    if isinstance(truth, Missing):
        say(below, f"error unavailable: {truth.reason}")
        return
    difference = np.abs(picture - truth).max(axis=-1)
    below.set_facecolor("#DDDDDD")
    below.imshow(np.ma.masked_equal(difference, 0), norm=norm, cmap="viridis", interpolation="nearest", aspect="auto")
    broken = np.zeros((*difference.shape, 4))
    broken[~np.isfinite(difference)] = (*stored.BROKEN, 1)
    below.imshow(broken, interpolation="nearest", aspect="auto")


def say(axes, text: str, least: int = 27) -> None:
    """Writes into an empty panel why it is empty. least: letters of a line, wider than a narrow panel if need be."""
    axes.set_facecolor("#F4F4F4")
    wide = axes.get_window_extent().width / axes.figure.dpi * 72  # points
    lines = textwrap.fill(text, max(least, int(wide / (0.55 * 7))))  # a letter is about 0.55 of its size wide
    axes.text(0.5, 0.5, lines, transform=axes.transAxes, ha="center", va="center", fontsize=PRINT)


def _bar(figure, axes, norm) -> None:
    bar = figure.colorbar(ScalarMappable(norm, "viridis"), cax=axes, orientation="horizontal")
    few = ((1e-16, "1e-16"), (1e-12, "1e-12"), (1e-9, "1e-9"), (1e-6, "1e-6"))
    more = ((1e-5, "1e-5"), (1e-4, "1e-4"), (1e-3, "1e-3"), (1 / 255, "1/255"), (1e-2, "0.01"), (0.1, "0.1"))
    room = axes.get_window_extent().width / TICK
    ticks = [*(few if norm.vmin < LEAST else more[:3]), more[3], *(() if norm.vmin < LEAST else more[5:]), (1, "1")]
    ticks = [tick for tick in ticks if tick[1] != "1e-3"] if len(ticks) > room else ticks  # beside 1/255
    ticks = [ticks[0], more[3], ticks[-1]] if len(ticks) > room else ticks
    bar.set_ticks([tick for tick, _ in ticks], labels=[label for _, label in ticks])
    bar.minorticks_off()
    bar.set_label("error: largest difference of a channel\nfrom the truth, linear RGB (grey: exactly 0)")


def _few(candidates: list) -> list:
    """Returns at most MOST places in their order, preferring those where a cell is not ok, evenly spread."""
    wrong = [any(cell.status != "ok" for cell in cells) for _, cells in candidates]
    first = thinning.few([n for n, is_wrong in enumerate(wrong) if is_wrong], MOST)
    rest = thinning.few([n for n, is_wrong in enumerate(wrong) if not is_wrong], MOST - len(first))
    return [candidates[n] for n in sorted({*first, *rest})]


def write(results: Results, out: Path) -> str:
    """Writes pictures-NUMBER-PLACE.png and .svg for each place of more than one pixel; returns the section."""
    title = study.heading(results.cells, TITLE, "figure 4.1")
    if results.left_out:
        return markdown.unavailable(title, stored.LEFT_OUT)
    parts = [f"## {title}"]
    all_places = places(results)
    drawn = _few(all_places)
    parts.append(
        thinning.note(len(drawn), len(all_places), "configurations", "those where something is not ok come first")
    )
    for number, (place, cells) in enumerate(drawn):
        label = naming.called(results, place)
        if cells[0].pixels == 1:
            parts.append(f"{markdown.escape(label)}: a single pixel is not drawn; its error stands beside its time.")
            continue
        lacking = {cell: picture for cell in cells if isinstance(picture := stored.raw(results, cell), Missing)}
        there = [cell for cell in cells if cell not in lacking]
        parts.append(f"### {markdown.escape(label)}")
        for page, shown in enumerate(figures(there) if there else [], 1):
            name = f"pictures-{number}-{markdown.slug(place_label(place))}{f'-{page}' if page > 1 else ''}"
            parts.append(style.figure(out / name, f"Pictures: {label}", draw, results, there, shown))
        reasons = [f"{cell.label}: {why.reason if cell.status != 'ok' else why}" for cell, why in lacking.items()]
        parts += markdown.listed("Not drawn:", reasons)
    return "\n\n".join(filter(None, [*parts, markdown.escape(CAPTION)]))
