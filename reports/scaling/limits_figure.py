"""Draws the roofline (Williams, Waterman and Patterson, 2009): rates of renderers below the machine's peaks."""

from statistics import median

import matplotlib.pyplot as plt
from matplotlib.lines import Line2D

from reports.paper import style
from reports.run.results import Missing

ROOFS = (
    ("float32", "vectors, float32", "-"),
    ("float64", "vectors, float64", "--"),
    ("scalar_float64", "one number at a time", ":"),
)
SHADES = {"one": "#444444", "all": "#AAAAAA"}
APART = 1.07  # variants do the same work for one picture: side by side, none hides another
MARKS = {"off": "o", "on": "D"}


def draw(limits):
    """Draws a limits.Limits: operations per second against operations per byte, and parallel efficiency below."""
    results = limits.results
    points = [(cell, limits.intensity(cell), limits.rate(cell)) for cell in limits.cells]
    points = [(cell, x, y) for cell, x, y in points if not isinstance(x, Missing) and not isinstance(y, Missing)]
    shares = [(cell, limits.efficiency(cell)) for cell in limits.cells]
    shares = [(cell, value) for cell, value in shares if not isinstance(value, Missing)]
    figure, axes = plt.subplots(
        2 if shares else 1, 1, figsize=(7.2, 4.6 + 0.25 * len(shares) + 0.6 * bool(shares)), layout="constrained",
        height_ratios=[4.6, 0.6 + 0.25 * len(shares)] if shares else None, squeeze=False,
    )  # fmt: skip
    _roofline(axes[0, 0], limits, points)
    if shares:
        _efficiency(axes[1, 0], limits, shares)
    handles = [
        *(
            Line2D([], [], ls="", marker="o", color=style.colour(name, results.variants), label=name)
            for name in dict.fromkeys(cell.variant for cell, *_ in points)
        ),
        Line2D([], [], ls="", marker="o", color="#444444", label="one ray at a time"),
        Line2D([], [], ls="", marker="D", color="#444444", label="in lanes"),
        Line2D([], [], ls="", marker="o", mec="#444444", mfc="white", label="float32 (filled: float64)"),
    ]
    figure.legend(handles=handles, loc="outside right upper", fontsize=6)
    return figure


def _roofline(axes, limits, points) -> None:
    peaks = _medians(limits)
    low, high = min(x for _, x, _ in points), max(x for _, x, _ in points)
    low, high = low / 30, high * 3
    for of, shade in SHADES.items():
        rates = peaks.get(of)
        if not rates or (of == "all" and rates["threads"] == 1):
            continue
        for kind, label, line in ROOFS:
            ridge = rates[kind] / rates["bytes"]
            xs = [x for x in (low, ridge, high) if low <= x <= high]
            axes.plot(xs, [min(rates[kind], rates["bytes"] * x) / 1e9 for x in xs], line, color=shade, lw=1)
            count = f"{rates['threads']:.0f} thread{'s' if rates['threads'] > 1 else ''}"
            # at opposite ends, since the peak of two threads in float64 is that of one in float32
            place, side = ((max(ridge, low), "left"), (high, "right"))[of == "one"]
            axes.annotate(
                f"{label}, {count}", (place, rates[kind] / 1e9), textcoords="offset points",
                xytext=(2 if side == "left" else -2, 2), ha=side, fontsize=5.5, color=shade,
                path_effects=style.OUTLINE, zorder=5,
            )  # fmt: skip
    variants = list(dict.fromkeys(cell.variant for cell, *_ in points))
    for cell, x, y in points:
        x *= APART ** (variants.index(cell.variant) - (len(variants) - 1) / 2)
        shade = style.colour(cell.variant, limits.results.variants)
        face = "white" if cell.parameters["precision"] == "float32" else shade
        if y.low is not None:
            axes.plot([x, x], [y.low / 1e9, y.high / 1e9], color=shade, lw=1)
        axes.plot(x, y.value / 1e9, MARKS[limits.vector(cell)], color=shade, mfc=face, ms=5)
    axes.set(
        xscale="log", yscale="log", xlim=(low, high), ylabel="Gflop/s", xlabel="flop for each byte moved",
    )  # fmt: skip
    style.log_ticks(axes.xaxis)
    style.log_ticks(axes.yaxis)
    axes.grid(lw=0.3)


def _medians(limits) -> dict[str, dict]:
    """Returns the median of each rate of the calibrations before these cells, for the largest number of threads."""
    measured = [limits.results.records[row].get("peaks") or {} for cell in limits.cells for row in cell.counting]
    medians = {}
    for of in SHADES:
        rates = [peaks[of] for peaks in measured if of in peaks]
        most = max((rate["threads"] for rate in rates), default=0)
        rates = [rate for rate in rates if rate["threads"] == most]
        if rates:
            medians[of] = {kind: median(rate[kind] for rate in rates) for kind in rates[0]}
    return medians


def _efficiency(axes, limits, shares) -> None:
    names = []
    for row, (cell, value) in enumerate(shares):
        shade = style.colour(cell.variant, limits.results.variants)
        if value.low is not None:
            axes.plot([100 * value.low, 100 * value.high], [row, row], color=shade, lw=1.5)
        face = "white" if cell.parameters["precision"] == "float32" else shade
        axes.plot(100 * value.value, row, MARKS[limits.vector(cell)], color=shade, mfc=face, ms=5)
        lanes = {"on": ", in lanes", "auto": ", in lanes where faster"}.get(cell.parameters.get("vector"), "")
        names.append(f"{cell.variant}, {cell.parameters['precision']}{lanes}")
    axes.axvline(100, color="#888888", lw=0.8)
    axes.set_yticks(range(len(names)), names, fontsize=6)
    axes.set(ylim=(len(names) - 0.5, -0.5), xlabel="parallel efficiency: share of what the machine gained (%)")
    axes.set_xlim(left=0)
    axes.grid(axis="x")
