"""Draws what float32 and relaxed arithmetic change, by depth of reflection: share of pixels and size."""

import math
from collections.abc import Iterator
from pathlib import Path

import matplotlib.pyplot as plt

from reports.accuracy import precision
from reports.accuracy.precision import STRICT, Method
from reports.paper import markdown, quantity, style, table, thinning
from reports.run.results import Results
from reports.run.view import View

TITLE = "Precision: differences that are rare and large"
CAPTION = (
    "What the arithmetic alone changes: the largest absolute difference of a pixel in any channel of linear RGB from "
    "the reference, another renderer's picture in strict float64, all else equal: depth, samples, offset of rays from "
    "surfaces. It is not the error of the picture, which has all that the truth of the scene has more. Beyond 1/255: "
    "pixels off by more than a step of an 8-bit picture. The median over pixels that differ shows the usual "
    "difference, the largest the worst: a root mean square hides how far they are apart. A picture that the judge "
    "rejects is shown too, marked wrong in the table and hollow in the figure. A share or a difference of 0 is at the "
    "lower edge."
)
CSV_HEADER = (
    "view", "variant", "precision", "floating_point", "depth", "beyond_step", "largest_difference", "median_difference",
    "status",
)  # fmt: skip
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
    """Writes precision-NUMBER-VIEW.png and .svg, precision.csv; returns the section, "" with one arithmetic."""
    views = precision.methods_by_view(results)
    if not views:
        return ""
    parts = [f"## {TITLE}"]
    for number, (seen, methods) in enumerate(views):
        parts.append(f"### {markdown.escape(seen.title)}")
        if any(len(method.pictures) > 1 for method in methods):
            path, drawn = out / f"precision-{number}-{markdown.slug(seen.label)}", [m for m in methods if m.pictures]
            parts.append(style.figure(path, f"{TITLE}: {seen.title}", draw, seen, drawn))
        parts.append(_table(methods))
    table.write_lines(out / "precision.csv", CSV_HEADER, _csv(views))
    return "\n\n".join([*parts, "Every picture: [precision.csv](precision.csv).", markdown.escape(CAPTION)])


def _table(methods: list[Method]) -> str:
    rows = []
    for method in methods:
        fields = {
            picture.depth: [f"{100 * picture.bad:.3g}", _plain(picture.largest), _plain(picture.median), picture.status]
            for picture in method.pictures
        }
        fields |= {depth: ["unavailable"] * 3 + [why] for depth, why in method.lacking.items()}
        name = [method.variant, precision.name(method.arithmetic)]
        rows += [[*name, str(depth), *fields[depth]] for depth in sorted(fields)]
    header = [
        "renderer",
        "arithmetic",
        "depth",
        "beyond 1/255 (%)",
        "largest difference",
        "median difference",
        "status",
    ]
    some = thinning.few(rows, table.MOST)
    more = thinning.note(len(some), len(rows), "rows", "the CSV file has all")
    return "\n\n".join(filter(None, [markdown.table(header, some), more]))


def _plain(value: float) -> str:
    return "exactly 0" if value == 0 else quantity.plain(value)


def _csv(views: list[tuple[View, list[Method]]]) -> Iterator[tuple]:
    for seen, methods in views:
        for method in methods:
            name = seen.label, method.variant, *method.arithmetic
            fields = {
                picture.depth: (picture.bad, picture.largest, picture.median, picture.status)
                for picture in method.pictures
            }
            fields |= {depth: (None, None, None, why) for depth, why in method.lacking.items()}
            yield from ((*name, depth, *fields[depth]) for depth in sorted(fields))


def draw(seen: View, methods: list[Method]):
    """Draws methods with differences."""
    figure, panels = plt.subplots(1, 2, figsize=(7.2, 3.8), layout="constrained")
    variants = list(dict.fromkeys(method.variant for method in methods))
    lines = (
        (panels[0], "bad", "-", "pixels beyond 1/255 (%)", 100),
        (panels[1], "largest", "-", "difference of a pixel: largest; dotted, median", 1),
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
        most = 3 * max(values, default=1.0)
        scale = max(0.4, math.log10(most / least) / 16)  # the label of 0 keeps its distance from the next
        axes.set_yscale("symlog", linthresh=least, linscale=scale)
        axes.set_ylim(0, most)
        axes.set_yticks([tick for tick in axes.get_yticks() if tick == 0 or tick >= least])
        axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.minorticks_off()
        axes.xaxis.get_major_locator().set_params(integer=True)
        axes.grid()
    style.visible_step(panels[1])
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower left", ncols=3, fontsize=6)
    style.entitle(figure, seen.title)
    return figure


def _line(axes, method: Method, quantity_: str, scale: float, shade: str, mark: str, line: str) -> None:
    depths = [picture.depth for picture in method.pictures]
    values = [scale * getattr(picture, quantity_) for picture in method.pictures]
    style_ = line if method.arithmetic != STRICT else "--" if line == "-" else line
    label = method.label if quantity_ == "bad" else None
    axes.plot(depths, values, style_, color=shade, lw=1, marker=mark, ms=3.5, mew=0, label=label)
    wrong = [(depth, value) for depth, value, picture in zip(depths, values, method.pictures, strict=True)
             if picture.status != "ok"]  # fmt: skip
    if wrong:
        axes.plot(*zip(*wrong, strict=True), mark, color=shade, ms=4, mfc="white", mew=0.8)
