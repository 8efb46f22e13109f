"""Draws figure 2.9: the right picture beside those of the exhibits, a row per fault, a column per block size."""

import textwrap
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from reports.paper import markdown, quantity, style, thinning
from reports.pictures.pictures_figure import panel, say
from reports.run import gpu, launch, stored
from reports.run.launch import Group
from reports.run.results import Cell, Missing, Results

WHY = {  # by the end of the variant's name
    "index-fault": (
        "{variant}: each block fills its copy of the table of materials, in shared memory, from the "
        "block's place in the picture, as tiles of a matrix product are filled, instead of from the start of the "
        "table. So each block sees the table rotated by its own offset: colours change from block to block, shapes "
        "do not."
    ),
    "barrier-fault": (
        "{variant}: a thread reads the copy before the other threads of its block have filled it, as "
        "no barrier stands between. What it reads depends on which warps ran first, so the picture may change from "
        "run to run, and may even be right; in the simulator it is up to the scheduler of its threads, and on a "
        "processor, which runs one thread of a block after another up to the next barrier, the first reads least."
    ),
}
CAPTION = (
    "Exhibits, which are wrong on purpose: the study saw such pictures when it put the scene into shared memory, and "
    "did not find the reason. The pattern follows the block size since shared memory belongs to a block: threads of "
    "one block read one copy and share its mistake; the next block has its own copy. Ticks: the borders of the blocks, "
    "where they are far enough apart to be seen. On the left the picture as it should be, the reference by another "
    "renderer, from which the others are off. This is about agreement, not about the error of a picture."
)
GAP, HEAD, BELOW, EDGE, WIDEST = 24, 70, 76, 130, 1580  # pixels of the PNG
LARGEST = 512
CLOSEST = 5  # pixels of the PNG between two ticks
MOST = 5  # block sizes, side by side
LETTERS = 18  # of a line in an empty panel, at least


def of_scene(results: Results, scene: str) -> list[Group]:
    """Returns groups of exhibits of a fault on a GPU that have a picture of more than one pixel."""
    exhibits = [cell for cell in results.of(scene) if cell.faulty and cell.gpu and cell.pixels > 1]
    groups = launch.groups(exhibits, launch.BLOCK, across_variants=True)
    return [group for group in groups if any(_has_picture(results, cell) for cell in group.cells)]


def _has_picture(results: Results, cell: Cell) -> bool:
    return bool((results.record(cell) or {}).get("picture"))


def _lacking(results: Results, group: Group) -> Missing | None:
    """Returns why no picture of a group can be shown, None if one can be."""
    pictures = [stored.raw(results, cell) for cell in group.cells if _has_picture(results, cell)]
    missing = [picture for picture in pictures if isinstance(picture, Missing)]
    return missing[0] if len(missing) == len(pictures) else None


def draw(results: Results, group: Group):
    """Draws a group."""
    variants = list(dict.fromkeys(cell.variant for cell in group.cells))
    blocks = thinning.few(_blocks(results, group), MOST)
    height, width = group.cells[0].size
    step_wide = min(LARGEST + GAP, (WIDEST - EDGE) // (1 + len(blocks)))
    zoom = (step_wide - GAP) / max(height, width)
    high, wide = round(zoom * height), round(zoom * width)
    step_high = high + BELOW + 24
    total_wide, total_high = EDGE + (1 + len(blocks)) * step_wide, HEAD + len(variants) * step_high
    figure = plt.figure(figsize=(total_wide / style.DPI, total_high / style.DPI))

    def box(row, column):
        return panel(figure, EDGE + column * step_wide, HEAD + row * step_high, high, wide)

    for row, variant in enumerate(variants):
        cells = [cell for cell in group.cells if cell.variant == variant]
        axes = box(row, 0)
        _right(results, cells, axes)
        axes.set_ylabel("\n".join(textwrap.wrap(cells[0].label, 16)), fontweight="bold", labelpad=8)
        if row == 0:
            axes.set_title("right", fontweight="bold", pad=9)
        for column, block in enumerate(blocks, 1):
            axes = box(row, column)
            if row == 0:
                axes.set_title(
                    "block {} × {}".format(*block) if block[0] else "block not told", fontweight="bold", pad=9
                )
            cell = next((cell for cell in cells if (gpu.block(results, cell) or (0, 0)) == block), None)
            _wrong(results, cell, axes, block, (wide / width, high / height))
    return figure


def _blocks(results: Results, group: Group) -> list[tuple[int, int]]:
    """Returns the sizes of the blocks of a group, the smallest first; (0, 0) where one is not told."""
    return sorted({gpu.block(results, cell) or (0, 0) for cell in group.cells}, key=lambda b: (b[0] * b[1], b))


def _right(results: Results, cells: list[Cell], axes) -> None:
    cell = next((cell for cell in cells if _has_picture(results, cell)), None)
    agreement = cell and results.record(cell)["agreement"]
    reference = stored.reference(results, agreement or {}) if cell else Missing("no reference")
    if isinstance(reference, Missing):
        say(axes, str(reference), LETTERS)
        return
    axes.imshow(stored.displayed(reference, cell), interpolation="nearest", aspect="auto")
    axes.text(0.5, -0.05, "the reference", transform=axes.transAxes, ha="center", va="top", fontsize=7)


def _wrong(results: Results, cell: Cell | None, axes, block: tuple[int, int], zoom: tuple[float, float]) -> None:
    picture = stored.raw(results, cell) if cell else Missing("not run")
    if isinstance(picture, Missing):
        say(axes, picture.reason if cell is None or not _has_picture(results, cell) else str(picture), LETTERS)
        return
    axes.imshow(stored.displayed(picture, cell), interpolation="nearest", aspect="auto")
    for axis, side, size, scale in zip((axes.xaxis, axes.yaxis), block, picture.shape[1::-1], zoom, strict=True):
        if side and side * scale >= CLOSEST:
            axis.set_ticks(np.append(np.arange(0, size, side), size) - 0.5, labels=[])
    axes.tick_params(top=True, bottom=True, left=True, right=True, length=3, width=0.4)
    axes.text(0.5, -0.05, _said(results, cell), transform=axes.transAxes, ha="center", va="top", fontsize=7)


def _said(results: Results, cell: Cell) -> str:
    """Returns the verdict on the picture, in two lines at most."""
    wrong = (results.record(cell)["agreement"] or {}).get("bad_pixels")
    if wrong is None:
        return "not judged"
    if cell.status == "ok":
        return "right here"
    return f"{quantity.percentage(wrong)} of pixels off\nby more than 1/255"


def _why(variant: str, apart: str) -> str:
    template = next((text for fault, text in WHY.items() if variant.endswith(fault)), "{variant}: {apart}")
    return template.format(variant=variant, apart=apart)


def write(results: Results, out: Path) -> str:
    """Writes faults-NUMBER-GROUP.png and .svg for each group; returns the section, "" without an exhibit's picture."""
    groups = [group for scene in results.scenes for group in of_scene(results, scene)]
    if not groups:
        return ""
    parts = ["## Exhibits (the study's figure 2.9)"]
    for number, group in enumerate(groups):
        path = out / f"faults-{number}-{markdown.slug(group.label)}"
        parts.append(f"### {markdown.escape(group.label)}")
        lacking = _lacking(results, group)
        if lacking:
            parts.append(markdown.escape(str(lacking)))
            continue
        parts.append(style.figure(path, f"Exhibits: {group.label}", draw, results, group))
        there = len(_blocks(results, group))
        parts.append(thinning.note(min(there, MOST), there, "sizes of blocks", "the pictures of all are in the run"))
    variants = dict.fromkeys((cell.variant, cell.apart) for group in groups for cell in group.cells)
    why = [_why(variant, apart) for variant, apart in variants]
    explanations = markdown.bullets(list(map(markdown.escape, why)))
    return "\n\n".join([*filter(None, parts), markdown.escape(CAPTION), explanations])
