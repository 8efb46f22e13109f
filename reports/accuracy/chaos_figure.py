"""Draws the growth of rounding with each bounce between mirrors, and the depth where pictures lose meaning."""

from collections.abc import Iterator
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from reports.accuracy import chaos, precision_figure
from reports.accuracy.chaos import ALIKE, FLOOR, LEAST_BOUNCES, LEAST_PIXELS, SMALL, Chaos, Growth
from reports.accuracy.resampling import RESAMPLES
from reports.paper import markdown, quantity, style, table
from reports.run.cell import Missing
from reports.run.results import Results

TITLE = "Mirror chaos: growth of rounding per bounce"
CAPTION = (
    "Light of bounce k: the picture of depth k minus that of depth k - 1. Its difference: the largest difference of a "
    "channel, linear RGB, from the same renderer in strict float64, all else equal (for strict float64: from "
    "another renderer's); the median is over the pixels that bounce k reaches. Growth g: least squares of the log of "
    f"the median on k, over at least {LEAST_BOUNCES} successive bounces that reach {LEAST_PIXELS} pixels, with the "
    f"median above {FLOOR} u of the picture's, the rounding of sums, and below {ALIKE:g} of the difference between "
    f"two random pixels, where growth ends. [low, high]: 95 % interval from {RESAMPLES} resamples of blocks of pixels. "
    f"Useful bounces: ln(1/{SMALL}u) / ln g, after which a first {SMALL} u has grown to 1; u is 2^-24 or 2^-53; "
    "dashed in the figure. Crosses: bounces that are not fitted."
)
CSV_HEADER = (
    "view", "variant", "precision", "floating_point", "against", "bounce", "pixels", "median", "random", "floor",
    "fitted",
)  # fmt: skip
WIDEST = 64  # characters of a label in a legend of two columns


def write(results: Results, out: Path) -> str:
    """Writes chaos-NUMBER-VIEW.png and .svg, chaos.csv; returns the section, "" without such a sweep."""
    views = chaos.mirror_views(results)
    if not views:
        return ""
    parts = [f"## {TITLE}"]
    for number, chaotic in enumerate(views):
        parts.append(f"### {markdown.escape(chaotic.view.title)}")
        if chaotic.growths:
            path = out / f"chaos-{number}-{markdown.slug(chaotic.view.label)}"
            parts += [style.figure(path, f"{TITLE}: {chaotic.view.title}", draw, chaotic), _table(chaotic.growths)]
        parts += markdown.listed(
            "Not drawn:", [f"{label}: equal in every bit" for label in chaotic.equal] + chaotic.lacking
        )
    table.write_lines(out / "chaos.csv", CSV_HEADER, _csv(views))
    return "\n\n".join([*parts, "Every bounce: [chaos.csv](chaos.csv).", markdown.escape(CAPTION)])


def _table(growths: list[Growth]) -> str:
    rows = []
    for growth in growths:
        fitted = growth.fitted
        fits = not isinstance(growth.growth, Missing)
        ends = f"{fitted[0].number} to {fitted[-1].number}" if fits else "unavailable"
        pixels = f"{fitted[0].pixels} to {fitted[-1].pixels}" if fits else "unavailable"
        useful = "unavailable" if growth.useful is None else f"{growth.useful:.3g}"
        passes = f"at none that reaches {LEAST_PIXELS} pixels" if growth.passes is None else str(growth.passes)
        rows.append([growth.label, growth.against, quantity.text(growth.growth), ends, pixels, useful, passes])
    header = [
        "renderer", "against float64 strict of", "growth per bounce", "fitted bounces", "pixels that reach them",
        "useful bounces", "median beyond 1/255 at bounce",
    ]  # fmt: skip
    return markdown.table(header, rows)


def _csv(views: list[Chaos]) -> Iterator[tuple]:
    for chaotic in views:
        for growth in chaotic.growths:
            fitted = growth.fitted if growth.start is not None else []
            name = chaotic.view.label, growth.variant, *growth.arithmetic, growth.against
            for bounce in growth.bounces:
                yield *name, bounce.number, bounce.pixels, bounce.median, bounce.random, bounce.floor, bounce in fitted


def draw(chaotic: Chaos):
    """Draws a view with growths."""
    figure, axes = plt.subplots(figsize=(7.2, 4.4), layout="constrained")
    variants = list(dict.fromkeys(growth.variant for growth in chaotic.growths))
    last = max(bounce.number for growth in chaotic.growths for bounce in growth.bounces)
    for growth in chaotic.growths:
        mark = precision_figure.MARKERS[variants.index(growth.variant) % len(precision_figure.MARKERS)]
        _line(axes, growth, precision_figure.colour(growth.arithmetic), mark, last)
    style.visible_step(axes, right=False)
    random = {bounce.number: bounce.random for growth in chaotic.growths for bounce in growth.bounces}
    axes.plot(list(random), list(random.values()), color="#AAAAAA", lw=1, zorder=1, label="two pixels at random")
    axes.set(yscale="log", xlabel="bounce", ylabel="median difference of a bounce's light (linear RGB)")
    axes.xaxis.get_major_locator().set_params(integer=True)
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.yaxis.minorticks_off()
    axes.grid()
    handles, labels = axes.get_legend_handles_labels()
    columns = 2 if max(map(len, labels)) <= WIDEST else 1
    figure.legend(handles, labels, loc="outside lower left", ncols=columns, fontsize=6)
    style.entitle(figure, chaotic.view.title)
    return figure


def _line(axes, growth: Growth, colour: str, mark: str, last: int) -> None:
    fitted = growth.fitted if growth.start is not None else []
    some = [bounce for bounce in growth.bounces if bounce.median > 0]
    axes.plot([b.number for b in some], [b.median for b in some], color=colour, lw=0.6, alpha=0.6)
    rest = [bounce for bounce in some if bounce not in fitted]
    axes.plot([b.number for b in rest], [b.median for b in rest], "x", color=colour, ms=3.5, mew=0.8)
    label = growth.label
    if fitted:
        value = growth.growth.value
        ends = np.array([fitted[0].number, fitted[-1].number])
        axes.plot(ends, growth.start * value**ends, color=colour, lw=1.6)
        label += f": × {quantity.text(growth.growth)} a bounce"
    if growth.useful is not None:
        label += f"; useful bounces {growth.useful:.3g}"
        if growth.useful <= last + 1:
            axes.axvline(growth.useful, color=colour, lw=0.9, ls=(0, (4, 2)))
        else:
            label += ", further right"
    axes.plot([b.number for b in fitted], [b.median for b in fitted], mark, color=colour, ms=4, mew=0)
    axes.plot([], [], f"{mark}-", color=colour, ms=4, lw=1.6, label=label)
