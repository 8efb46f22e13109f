"""The growth of rounding errors with each bounce between mirrors, and up to which depth pictures mean anything."""

import textwrap
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from reports.accuracy import chaos, precision_figure
from reports.accuracy.chaos import ALIKE, FLOOR, LEAST_BOUNCES, LEAST_PIXELS, SMALL, STEP, Chaos, Growth
from reports.accuracy.resampling import RESAMPLES
from reports.paper import markdown, quantity, style
from reports.run.cell import Missing
from reports.run.results import Results

TITLE = "Mirror chaos: growth of rounding errors per bounce"
CAPTION = (
    "Light of bounce k: the picture of depth k less that of depth k - 1. Its error: the largest difference of a "
    "channel, linear RGB, from the same variant in float64, strict, all else equal (of strict float64: from another "
    "variant's); the median is of the pixels that bounce k brings light to. Growth g: least squares of the log of the "
    f"median on k, over the bounces in succession, {LEAST_BOUNCES} at least, that {LEAST_PIXELS} pixels reach, where "
    f"the median is above {FLOOR} u of the picture's, which is the rounding of sums, and below {ALIKE:g} of the "
    "difference between two such pixels chosen at random, where growth ends. [low, high]: 95 % interval from "
    f"{RESAMPLES} resamples of blocks of pixels. Useful bounces: ln(1/{SMALL}u) / ln g, after which a first error of "
    f"{SMALL} u has become 1; u is 2^-24 or 2^-53; in the figure it is the dashed line. Crosses: bounces that are not "
    "fitted."
)
WIDEST = 64  # characters of a label, for two of them to stand side by side


def write(results: Results, out: Path) -> str:
    """chaos-NUMBER-VIEW.png and .svg, chaos.csv, and the section of the report; "" without such a sweep."""
    found = chaos.found(results)
    if not found:
        return ""
    parts = [f"## {TITLE}"]
    for number, one in enumerate(found):
        parts.append(f"### {markdown.escape(one.view.label)}")
        if one.growths:
            name = f"chaos-{number}-{markdown.slug(one.view.label)}"
            with style.styled():
                style.save(draw(one), out / name)
            parts += [markdown.figure(name, f"{TITLE}: {one.view.label}"), _table(one.growths)]
        said = [f"{label}: equal in every bit" for label in one.equal] + one.lacking
        if said:
            parts.append(markdown.bullets([markdown.escape(text) for text in said]))
    _csv(found).to_csv(out / "chaos.csv", index=False, na_rep="NaN", lineterminator="\n")
    return "\n\n".join([*parts, "Every bounce: [chaos.csv](chaos.csv).", markdown.escape(CAPTION)])


def _table(growths: list[Growth]) -> str:
    rows = []
    for one in growths:
        fitted = one.fitted
        known = not isinstance(one.growth, Missing)
        ends = f"{fitted[0].number} to {fitted[-1].number}" if known else "unavailable"
        pixels = f"{fitted[0].pixels} to {fitted[-1].pixels}" if known else "unavailable"
        useful = "unavailable" if one.useful is None else f"{one.useful:.3g}"
        passes = f"not while {LEAST_PIXELS} pixels reach it" if one.passes is None else str(one.passes)
        rows.append([one.label, one.against, quantity.text(one.growth), ends, pixels, useful, passes])
    header = [
        "variant", "against float64 strict of", "growth per bounce", "fitted bounces", "pixels that reach them",
        "useful bounces", "median beyond 1/255 at bounce",
    ]  # fmt: skip
    return markdown.table(header, rows)


def _csv(found: list[Chaos]) -> pd.DataFrame:
    rows = []
    for one in found:
        for growth in one.growths:
            fitted = growth.fitted if growth.start is not None else []
            name = one.view.label, growth.variant, *growth.arithmetic, growth.against
            rows += [
                (*name, bounce.number, bounce.pixels, bounce.median, bounce.random, bounce.floor, bounce in fitted)
                for bounce in growth.bounces
            ]
    names = [
        "view", "variant", "precision", "floating_point", "against", "bounce", "pixels", "median", "random", "floor",
        "fitted",
    ]  # fmt: skip
    return pd.DataFrame(rows, columns=names)


def draw(one: Chaos):
    """The figure of a view that has growths."""
    figure, axes = plt.subplots(figsize=(7.2, 4.4), layout="constrained")
    variants = list(dict.fromkeys(growth.variant for growth in one.growths))
    last = max(bounce.number for growth in one.growths for bounce in growth.bounces)
    for growth in one.growths:
        mark = precision_figure.MARKERS[variants.index(growth.variant) % len(precision_figure.MARKERS)]
        _line(axes, growth, precision_figure.colour(growth.arithmetic), mark, last)
    axes.axhline(STEP, color="#888888", lw=0.8)
    axes.text(0, STEP, " 1/255", transform=axes.get_yaxis_transform(), ha="left", va="bottom", fontsize=6)
    random = {bounce.number: bounce.random for growth in one.growths for bounce in growth.bounces}
    axes.plot(list(random), list(random.values()), color="#AAAAAA", lw=1, zorder=1, label="two pixels at random")
    axes.set(yscale="log", xlabel="bounce", ylabel="median error of a bounce's light (linear RGB)")
    axes.xaxis.get_major_locator().set_params(integer=True)
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.yaxis.minorticks_off()
    axes.grid(lw=0.4, color="#DDDDDD")
    axes.set_axisbelow(True)
    handles, labels = axes.get_legend_handles_labels()
    columns = 2 if max(map(len, labels)) <= WIDEST else 1
    figure.legend(handles, labels, loc="outside lower left", ncols=columns, fontsize=6)
    figure.suptitle("\n".join(textwrap.wrap(one.view.label, 110)), x=0.01, ha="left", fontsize=8)
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
