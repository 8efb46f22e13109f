"""The figure of errors of float32 and relaxed arithmetic: share of pixels and size, by depth of reflection."""

import textwrap
from pathlib import Path

import matplotlib.pyplot as plt
import pandas as pd

from reports.accuracy import precision
from reports.accuracy.precision import STEP, STRICT, Method
from reports.paper import markdown, quantity, style, table, thinning
from reports.run.results import Results
from reports.run.view import View

TITLE = "Precision: errors that are rare and large"
CAPTION = (
    "Of each pixel the largest absolute difference in any channel of linear RGB from the picture of another renderer "
    "in float64, strict, all else equal: depth, samples, and how far rays start from surfaces. Beyond 1/255: pixels "
    "off by more than a step of an 8-bit picture. The median, of the pixels that differ at all, says how far off they "
    "are as a rule, the largest how far one can be: between the two lies what RMSE hides. A picture that the judge "
    "rejects is shown all the same, and said to be wrong; it is hollow in the figure. A share or an error of 0 is at "
    "the lower edge."
)
COLOURS = {
    ("float32", "strict"): "#0072B2",
    ("float32", "contract"): "#56B4E9",
    ("float32", "fast"): "#D55E00",
    ("float64", "strict"): "#444444",
    ("float64", "contract"): "#009E73",
    ("float64", "fast"): "#CC79A7",
}
OTHER = "#E69F00"
MARKERS = "osD^vP*X"


def colour(arithmetic: tuple[str, str]) -> str:
    return COLOURS.get(arithmetic, OTHER)


def write(results: Results, out: Path) -> str:
    """precision-NUMBER-VIEW.png and .svg, precision.csv, and the section of the report; "" of one arithmetic."""
    found = precision.found(results)
    if not found:
        return ""
    parts = [f"## {TITLE}"]
    for number, (seen, methods) in enumerate(found):
        parts.append(f"### {markdown.escape(seen.label)}")
        if any(len(method.errors) > 1 for method in methods):
            name = f"precision-{number}-{markdown.slug(seen.label)}"
            with style.styled():
                style.save(draw(seen, [method for method in methods if method.errors]), out / name)
            parts.append(markdown.figure(name, f"{TITLE}: {seen.label}"))
        parts.append(_table(methods))
    _csv(found).to_csv(out / "precision.csv", index=False, na_rep="NaN", lineterminator="\n")
    return "\n\n".join([*parts, "Every picture: [precision.csv](precision.csv).", markdown.escape(CAPTION)])


def _table(methods: list[Method]) -> str:
    rows = []
    for method in methods:
        told = {
            one.depth: [f"{100 * one.bad:.3g}", _plain(one.largest), _plain(one.median), one.status]
            for one in method.errors
        }
        told |= {depth: ["unavailable"] * 3 + [why] for depth, why in method.lacking.items()}
        rows += [
            [method.variant, precision.name(method.arithmetic), str(depth), *told[depth]] for depth in sorted(told)
        ]
    header = ["variant", "arithmetic", "depth", "beyond 1/255 (%)", "largest error", "median error", "status"]
    some = thinning.few(rows, table.MOST)
    more = thinning.told(len(some), len(rows), "rows", "the CSV file has all")
    return "\n\n".join(filter(None, [markdown.table(header, some), more]))


def _plain(value: float) -> str:
    return "exactly 0" if value == 0 else quantity.plain(value)


def _csv(found: list[tuple[View, list[Method]]]) -> pd.DataFrame:
    rows = []
    for seen, methods in found:
        for method in methods:
            name = seen.label, method.variant, *method.arithmetic
            told = {one.depth: (one.bad, one.largest, one.median, one.status) for one in method.errors}
            told |= {depth: (None, None, None, why) for depth, why in method.lacking.items()}
            rows += [(*name, depth, *told[depth]) for depth in sorted(told)]
    names = ["view", "variant", "precision", "floating_point", "depth", "bad_pixels", "max", "median", "status"]
    return pd.DataFrame(rows, columns=names)


def draw(seen: View, methods: list[Method]):
    """The figure of methods, each with errors."""
    figure, panels = plt.subplots(1, 2, figsize=(7.2, 3.8), layout="constrained")
    variants = list(dict.fromkeys(method.variant for method in methods))
    lines = (
        (panels[0], "bad", "-", "pixels beyond 1/255 (%)", 100),
        (panels[1], "largest", "-", "error of a pixel: largest; dotted, median", 1),
        (panels[1], "median", ":", None, 1),
    )
    for axes, quantity_, line, label, scale in lines:
        for method in methods:
            mark = MARKERS[variants.index(method.variant) % len(MARKERS)]
            _line(axes, method, quantity_, scale, colour(method.arithmetic), mark, line)
        if label:
            axes.set(ylabel=label, xlabel="depth: largest order of a ray")
    for axes in panels:
        values = [value for drawn in axes.get_lines() for value in drawn.get_ydata() if value > 0]
        least = min(values, default=1e-3)
        axes.set_yscale("symlog", linthresh=least, linscale=0.4)
        axes.set_ylim(0, 3 * max(values, default=1.0))
        axes.set_yticks([tick for tick in axes.get_yticks() if tick == 0 or tick >= least])
        axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.minorticks_off()
        axes.xaxis.get_major_locator().set_params(integer=True)
        axes.grid(lw=0.4, color="#DDDDDD")
        axes.set_axisbelow(True)
    panels[1].axhline(STEP, color="#888888", lw=0.8)
    panels[1].text(1, STEP, "1/255 ", transform=panels[1].get_yaxis_transform(), ha="right", va="bottom", fontsize=6)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower left", ncols=3, fontsize=6)
    figure.suptitle("\n".join(textwrap.wrap(seen.label, 110)), x=0.01, ha="left", fontsize=8)
    return figure


def _line(axes, method: Method, quantity_: str, scale: float, shade: str, mark: str, line: str) -> None:
    depths = [one.depth for one in method.errors]
    values = [scale * getattr(one, quantity_) for one in method.errors]
    style_ = line if method.arithmetic != STRICT else "--" if line == "-" else line
    label = method.label if quantity_ == "bad" else None
    axes.plot(depths, values, style_, color=shade, lw=1, marker=mark, ms=3.5, mew=0, label=label)
    wrong = [(depth, value) for depth, value, one in zip(depths, values, method.errors, strict=True)
             if one.status != "ok"]  # fmt: skip
    if wrong:
        axes.plot(*zip(*wrong, strict=True), mark, color=shade, ms=4, mfc="white", mew=0.8)
