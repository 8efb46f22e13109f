"""Figure 2.9: the right picture beside those of the exhibits, a row per fault, a column per block size."""

import textwrap
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from reports.paper import markdown, style
from reports.pictures.pictures_figure import panel_size, say, shown
from reports.run import gpu, launch, stored
from reports.run.launch import Group
from reports.run.results import Cell, Missing, Results

WHY = {
    "numba-cuda-index-fault": (
        "numba-cuda-index-fault: each block fills its copy of the table of materials, in shared memory, from the "
        "block's place in the picture, as tiles of a matrix product are filled, instead of from the start of the "
        "table. So each block sees the table rotated by its own offset: colours change from block to block, shapes "
        "do not."
    ),
    "numba-cuda-barrier-fault": (
        "numba-cuda-barrier-fault: a thread reads the copy before the other threads of its block have filled it, as "
        "no barrier stands between. What it reads depends on which warps ran first, so the picture may change from "
        "run to run, and may even be right; in the simulator it is up to the scheduler of its threads."
    ),
}
CAPTION = (
    "Exhibits, made to be wrong: the study saw such pictures when it put the scene into shared memory, and did not "
    "find the reason. The pattern follows the block size since shared memory belongs to a block: threads of one block "
    "read one copy, and share its mistake; the next block has a copy of its own. Ticks: the borders of the blocks, "
    "where they are not too close to be told apart. On the left the right picture, the reference."
)
GAP, HEAD, BELOW, EDGE = 44, 70, 76, 130  # pixels of the PNG
LARGEST = 512
CLOSEST = 5  # pixels of the PNG between two ticks
NARROWEST = 300  # pixels that the text below a panel needs at least


def of_scene(results: Results, scene: str) -> list[Group]:
    """Groups of exhibits that have a picture with more than one pixel."""
    exhibits = [cell for cell in results.of(scene) if cell.exhibit and cell.pixels > 1]
    groups = launch.groups(exhibits, launch.BLOCK, across_variants=True)
    return [group for group in groups if any(_picture(results, cell) is not None for cell in group.cells)]


def _picture(results: Results, cell: Cell) -> dict | None:
    """Its record, if that has a picture."""
    record = results.record(cell)
    return record if record and record["picture"] else None


def draw(results: Results, group: Group):
    """The figure of a group."""
    variants = list(dict.fromkeys(cell.variant for cell in group.cells))
    blocks = sorted({gpu.block(results, cell) or (0, 0) for cell in group.cells}, key=lambda b: (b[0] * b[1], b))
    x0, y0, x1, y1 = map(int, group.cells[0].parameters["region"].split(","))
    high, wide = panel_size(y1 - y0, x1 - x0, LARGEST)
    step_wide, step_high = max(wide, NARROWEST) + GAP, high + BELOW + 24
    total_wide, total_high = EDGE + (1 + len(blocks)) * step_wide, HEAD + len(variants) * step_high
    figure = plt.figure(figsize=(total_wide / style.DPI, total_high / style.DPI))

    def box(row, column):
        left, top = EDGE + column * step_wide, HEAD + row * step_high
        edges = left / total_wide, 1 - (top + high) / total_high, wide / total_wide, high / total_high
        axes = figure.add_axes(edges)
        axes.set(xticks=[], yticks=[])
        axes.spines[:].set_visible(False)
        return axes

    for row, variant in enumerate(variants):
        mine = [cell for cell in group.cells if cell.variant == variant]
        axes = box(row, 0)
        _right(results, mine, axes)
        axes.set_ylabel("\n".join(textwrap.wrap(mine[0].label, 16)), fontweight="bold", labelpad=8)
        if row == 0:
            axes.set_title("right", fontweight="bold", pad=9)
        for column, block in enumerate(blocks, 1):
            axes = box(row, column)
            if row == 0:
                axes.set_title(
                    "block {} × {}".format(*block) if block[0] else "block not told", fontweight="bold", pad=9
                )
            cell = next((cell for cell in mine if (gpu.block(results, cell) or (0, 0)) == block), None)
            _wrong(results, cell, axes, block, (wide / (x1 - x0), high / (y1 - y0)))
    return figure


def _right(results: Results, cells: list[Cell], axes) -> None:
    record = next(filter(None, (_picture(results, cell) for cell in cells)), None)
    found = Missing("no reference") if record is None else stored.reference(results, record["accuracy"] or {})
    if isinstance(found, Missing):
        say(axes, str(found))
        return
    axes.imshow(shown(found, record["parameters"].get("arithmetic", "linear")), interpolation="nearest", aspect="auto")
    axes.text(0.5, -0.03, "the reference", transform=axes.transAxes, ha="center", va="top", fontsize=7)


def _wrong(results: Results, cell: Cell | None, axes, block: tuple[int, int], zoom: tuple[float, float]) -> None:
    record = cell and _picture(results, cell)
    if record is None:
        say(axes, cell.verdict if cell else "not run")
        return
    picture = stored.array(results, record["picture"]["file"])
    if isinstance(picture, Missing):
        say(axes, str(picture))
        return
    axes.imshow(
        shown(picture, record["parameters"].get("arithmetic", "linear")), interpolation="nearest", aspect="auto"
    )
    for axis, side, size, scale in zip((axes.xaxis, axes.yaxis), block, picture.shape[1::-1], zoom, strict=True):
        if side and side * scale >= CLOSEST:
            axis.set_ticks(np.append(np.arange(0, size, side), size) - 0.5, labels=[])
    axes.tick_params(top=True, bottom=True, left=True, right=True, length=3, width=0.4)
    axes.text(0.5, -0.03, _said(cell, record), transform=axes.transAxes, ha="center", va="top", fontsize=7)


def _said(cell: Cell, record: dict) -> str:
    """Returns the verdict on the picture, in two lines at most."""
    wrong = (record["accuracy"] or {}).get("bad_pixels")
    if wrong is None:
        return "not judged"
    if cell.status == "ok":
        return "right here"
    return f"{wrong:.1%} of pixels differ\nby more than 1/255"


def write(results: Results, out: Path) -> str:
    """faults-NUMBER-GROUP.png and .svg, one a group, and the section of the report; "" without an exhibit's picture."""
    found = [group for scene in results.scenes for group in of_scene(results, scene)]
    if not found:
        return ""
    parts = ["## Exhibits (the study's figure 2.9)"]
    for number, group in enumerate(found):
        name = f"faults-{number}-{markdown.slug(group.label)}"
        with style.styled():
            style.save(draw(results, group), out / name)
        parts += [f"### {markdown.escape(group.label)}", markdown.figure(name, f"Exhibits: {group.label}")]
    variants = dict.fromkeys((cell.variant, cell.apart) for group in found for cell in group.cells)
    why = [WHY.get(variant, f"{variant}: {apart}") for variant, apart in variants]
    return "\n\n".join([*parts, markdown.escape(CAPTION), markdown.bullets(list(map(markdown.escape, why)))])
