"""Draws figure 4.1: the picture of each variant, pixel for pixel, above its difference from the reference."""

import textwrap
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm

from harness.store.record import errors, largest
from reports.paper import markdown, style, thinning
from reports.run import launch, stored
from reports.run.results import Cell, Missing, Results, place_label

CAPTION = (
    "Above, the picture; below, its largest absolute difference in any channel of linear RGB from the reference, which "
    "another renderer made, on a logarithmic scale common to all; grey where it is exactly 0, magenta where a pixel is "
    "not finite. A small picture is enlarged by a whole factor, one of more than 1024 pixels is reduced; others are "
    "shown pixel for pixel. Points that differ only in how the kernel of a GPU is launched are drawn once, and again "
    "where one is not ok. Exhibits have a figure of their own."
)

SMALLEST, LARGEST = 480, 1024  # of a panel, in pixels of the PNG
TEXT_WIDTH = 520  # least width of the text below a panel, pixels
ABOVE, BETWEEN, BELOW, GAP, BAR = 60, 16, 120, 40, 150  # pixels
COLUMNS = 3
MOST = 24  # figures
SMALLEST_DIFFERENCE = 1e-17


def panel_size(height: int, width: int, largest: int = LARGEST, smallest: int = SMALLEST) -> tuple[int, int]:
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


def verdict(agreement: dict) -> str:
    """Returns the four lines of numbers below a panel: errors over all pixels, agreement outside the mask, inside."""
    if agreement.get("bad_pixels") is None:
        return "error unavailable"
    outside, inside = agreement["max_outside"], agreement["max_inside"]
    agreement = "every pixel is in it" if outside is None else f"at most {outside:.2g}"
    return "\n".join(
        [
            *errors(agreement["rmse"], largest(agreement), agreement["bad_pixels"]).rsplit(", ", 1),
            f"agreement outside the mask: {agreement}",
            f"inside ({agreement['mask_fraction']:.2%}): {'no pixel' if inside is None else f'at most {inside:.2g}'}",
        ]
    )


def places(results: Results) -> list[tuple[tuple[str, str], list[Cell]]]:
    """Returns the places to draw, each with its cells."""
    found, seen = [], set()
    for place in results.places:
        cells = [cell for cell in results.at(place) if not cell.exhibit and cell.parameters.get("kind") != "rays"]
        alike = frozenset((cell.scene, cell.variant, launch.rest(cell, launch.UNSEEN)) for cell in cells)
        if cells and (alike not in seen or any(cell.status != "ok" for cell in cells)):
            found.append((place, cells))
        seen.add(alike)
    return found


def draw(results: Results, cells: list[Cell]):
    """Draws the cells of a place."""
    high, wide = panel_size(*cells[0].size)
    columns = min(COLUMNS, len(cells))
    rows = -(-len(cells) // columns)
    block_high, block_wide = ABOVE + 2 * high + BETWEEN + BELOW, max(wide, TEXT_WIDTH) + GAP
    total_high, total_wide = rows * block_high + BAR, columns * block_wide + GAP
    figure = plt.figure(figsize=(total_wide / style.DPI, total_high / style.DPI))
    norm = LogNorm(SMALLEST_DIFFERENCE, 1.0, clip=True)
    for number, cell in enumerate(cells):
        row, column = divmod(number, columns)
        left = GAP + column * block_wide + (block_wide - GAP - wide) // 2
        top = row * block_high + ABOVE
        above, below = (panel(figure, left, at, high, wide) for at in (top, top + high + BETWEEN))
        above.set_title(cell.label, fontweight="bold")
        _panels(results, cell, above, below, norm)
    _bar(figure, panel(figure, total_wide * 0.2, total_high - BAR + 40, 22, total_wide * 0.6), norm)
    return figure


def _panels(results: Results, cell: Cell, above, below, norm) -> None:
    picture = stored.raw(results, cell)
    if isinstance(picture, Missing):
        say(above, picture.reason if cell.status != "ok" else str(picture))
        return
    agreement = results.record(cell)["agreement"] or {}
    above.imshow(stored.displayed(picture, cell), interpolation="nearest", aspect="auto")
    reference = stored.reference(results, agreement)
    text = verdict(agreement)
    if cell.status != "ok":
        text = textwrap.fill(cell.verdict, 48)
    below.text(0.5, -0.02, text, transform=below.transAxes, ha="center", va="top", fontsize=7,
               color="black" if cell.status == "ok" or cell.as_meant else "#B00000")  # fmt: skip
    if isinstance(reference, Missing):
        say(below, f"difference unavailable: {reference.reason}")
        return
    difference = np.abs(picture - reference).max(axis=-1)
    below.set_facecolor("#DDDDDD")
    below.imshow(np.ma.masked_equal(difference, 0), norm=norm, cmap="viridis", interpolation="nearest", aspect="auto")
    broken = np.zeros((*difference.shape, 4))
    broken[~np.isfinite(difference)] = (*stored.BROKEN, 1)
    below.imshow(broken, interpolation="nearest", aspect="auto")


def say(axes, text: str) -> None:
    """Writes into an empty panel why it is empty."""
    axes.set_facecolor("#F4F4F4")
    axes.text(0.5, 0.5, textwrap.fill(text, 34), transform=axes.transAxes, ha="center", va="center", fontsize=7)


def _bar(figure, axes, norm) -> None:
    bar = figure.colorbar(ScalarMappable(norm, "viridis"), cax=axes, orientation="horizontal")
    bar.set_ticks([1e-16, 1e-12, 1e-9, 1e-6, 1 / 255, 1], labels=["1e-16", "1e-12", "1e-9", "1e-6", "1/255", "1"])
    bar.minorticks_off()
    bar.set_label("largest difference from the reference in a channel, linear RGB (grey: exactly 0)")


def _few(found: list) -> list:
    """Returns at most MOST places in their order, preferring those where a cell is not ok, evenly spread."""
    wrong = [any(cell.status != "ok" for cell in cells) for _, cells in found]
    first = thinning.few([n for n, is_wrong in enumerate(wrong) if is_wrong], MOST)
    rest = thinning.few([n for n, is_wrong in enumerate(wrong) if not is_wrong], MOST - len(first))
    return [found[n] for n in sorted({*first, *rest})]


def write(results: Results, out: Path) -> str:
    """Writes pictures-NUMBER-PLACE.png and .svg for each place of more than one pixel; returns the section."""
    parts = ["## Pictures (the study's figure 4.1)"]
    if stored.left_out(results):
        return "\n\n".join([*parts, f"unavailable: {stored.LEFT_OUT}."])
    found = places(results)
    drawn = _few(found)
    parts.append(thinning.note(len(drawn), len(found), "places", "those where something is not ok come first"))
    for number, (place, cells) in enumerate(drawn):
        label = place_label(place)
        if cells[0].pixels == 1:
            parts.append(f"{markdown.escape(label)}: a single pixel is not drawn; its error stands beside its time.")
            continue
        name = f"pictures-{number}-{markdown.slug(label)}"
        parts += [f"### {markdown.escape(label)}", style.figure(out / name, f"Pictures: {label}", draw, results, cells)]
    return "\n\n".join(filter(None, [*parts, markdown.escape(CAPTION)]))
