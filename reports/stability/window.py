"""Draws acne against leaks: fixed offsets that are too short or too long, and the usable window between them."""

import math
from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.ticker import LogLocator

from reports.paper import markdown, style
from reports.run.results import Results
from reports.stability import stability
from reports.stability import style as look
from reports.stability.stability import Curve, Row, Way

ACNE, LEAK = "acne-epsilon", "leak-epsilon"
TITLE = "A fixed offset: acne against leaks (S7, S8)"
CAPTION = (
    "Below the window a surface shadows itself, above it a contact shadow is lost. The window reaches from the "
    "shortest offset without acne, at it and at all longer ones, to the longest without a leak, at it and at all "
    "shorter ones, among the lengths that were run, in units of the scene. A bar with an arrow may continue."
)
ACNE_COLOUR, LEAK_COLOUR, WINDOW = "#D55E00", "#0072B2", "#009E73"


@dataclass(frozen=True)
class Window:
    """The window of one variant, precision and way. low, high: offsets; None where none is free of failures."""

    acne: Curve
    leak: Curve

    @property
    def missing(self) -> str:
        """ "" or why one of the two has no answers."""
        return next((why for curve in (self.acne, self.leak) if not curve.answered for why in curve.missing), "")

    @property
    def low(self) -> float | None:
        return self.acne.unbroken[-1].level if self.acne.unbroken else None

    @property
    def high(self) -> float | None:
        return self.leak.unbroken[-1].level if self.leak.unbroken else None

    @property
    def open(self) -> bool:
        return self.low is not None and self.high is not None and self.low <= self.high

    @property
    def wider(self) -> tuple[bool, bool]:
        """May the window continue below the offsets that were run, and above?"""
        return self.acne.broken is None, self.leak.broken is None

    @property
    def text(self) -> str:
        if self.missing:
            return self.missing
        if not self.open:
            return "every offset that was run has acne or leaks"
        at_least = "at least " if any(self.wider) else ""
        decades = math.log10(self.high / self.low)
        return f"{look.short(self.low)} to {look.short(self.high)}, {at_least}{decades:.3g} decades"


def windows(rows: list[Row]) -> dict[tuple[str, Way], list[Window]]:
    """Returns the windows of variants with both rows, by precision and way."""
    named = {row.name: row for row in rows}
    by_way: dict[tuple[str, Way], list[Window]] = {}
    if ACNE not in named or LEAK not in named:
        return by_way
    for acne in named[ACNE].curves:
        leak = named[LEAK].find(acne.variant, acne.precision, acne.way)
        if leak:
            by_way.setdefault((acne.precision, acne.way), []).append(Window(acne, leak))
    return dict(sorted(by_way.items(), key=lambda item: item[0][0]))


def drawable(by_way: dict[tuple[str, Way], list[Window]]) -> dict[tuple[str, Way], list[Window]]:
    """Returns the windows of variants with answers."""
    answered = {place: [window for window in group if not window.missing] for place, group in by_way.items()}
    return {place: group for place, group in answered.items() if group}


def write(results: Results, out: Path) -> str:
    """Writes stability-window.png and .svg; returns the section of the report, "" without both rows."""
    by_way = windows(stability.rows(results))
    if not by_way:
        return ""
    drawn = drawable(by_way)
    parts = [f"## {TITLE}"]
    if drawn:
        parts.append(style.figure(out / "stability-window", TITLE, draw, results, drawn))
    header = ["precision", "method", "renderer", "usable window"]
    lines = [[precision, way.name, window.acne.variant, window.text]
             for (precision, way), group in by_way.items() for window in group]  # fmt: skip
    return "\n\n".join([*parts, markdown.table(header, lines), markdown.escape(CAPTION)])


def draw(results: Results, by_way: dict[tuple[str, Way], list[Window]]):
    """Draws panels of failures, a column for each precision and way, and below them a bar for each variant's window.

    by_way: windows of variants with answers.
    """
    most = max(map(len, by_way.values()))
    wide = max(4.6, 3.6 * len(by_way))
    figure, panels = plt.subplots(
        2, len(by_way), figsize=(wide, 2.8 + 0.16 * most), height_ratios=[2.2, 0.3 + 0.16 * most], squeeze=False,
        sharex="col", layout="constrained",
    )  # fmt: skip
    drawn = {window.acne.variant for group in by_way.values() for window in group}
    variants = [name for name in results.variants if name in drawn]
    for (above, below), ((precision, way), group) in zip(panels.T, by_way.items(), strict=True):
        _failures(above, group, variants)
        above.set_title(f"{precision}, {way.name}" if len({way for _, way in by_way}) > 1 else precision, loc="left")
        _bars(below, group)
    handles = [plt.Line2D([], [], color=shade, lw=2) for shade in (ACNE_COLOUR, LEAK_COLOUR, WINDOW)]
    handles += [plt.Line2D([], [], ls="", color="black", **look.marker(variant, variants)) for variant in variants]
    labels = ["acne: lit points that are dark", "leak: dark points that are lit", "usable window", *variants]
    cells = [p.cell for group in by_way.values() for w in group for c in (w.acne, w.leak) for p in c.points]
    look.frame(figure, TITLE, (handles, labels), look.origin(results, cells))
    return figure


def _failures(axes, group: list[Window], variants: list[str]) -> None:
    shares = []
    for window in group:
        for curve, shade in ((window.acne, ACNE_COLOUR), (window.leak, LEAK_COLOUR)):
            values = [100 * point.share for point in curve.answered]
            shares += values
            marks = look.marker(curve.variant, variants)
            axes.plot([point.level for point in curve.answered], values, color=shade, lw=0.9, **marks)
    limits = {(shade, curve.limit) for w in group for curve, shade in ((w.acne, ACNE_COLOUR), (w.leak, LEAK_COLOUR))}
    for shade, limit in sorted(limits, key=str):
        if limit:
            axes.axvline(limit, color=shade, lw=0.8, ls=look.THEORY)
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(numticks=7))
    look.amount_axis(axes, shares, 100)
    axes.set_ylabel("wrong answers (%)")


def _bars(axes, group: list[Window]) -> None:
    for place, window in enumerate(group):
        if not window.open:
            axes.text(0.5, place, "none", transform=axes.get_yaxis_transform(), ha="center", va="center", fontsize=6)
            continue
        axes.plot([window.low, window.high], [place, place], color=WINDOW, lw=4, solid_capstyle="butt")
        for end, wider, mark in zip((window.low, window.high), window.wider, "<>", strict=True):
            axes.plot(end, place, mark if wider else "|", color=WINDOW, ms=6)
        middle = math.sqrt(window.low * window.high)
        decades = math.log10(window.high / window.low)
        text = f"{'≥ ' if any(window.wider) else ''}{decades:.3g} decades"
        axes.text(middle, place - 0.42, text, ha="center", va="center", fontsize=look.SMALL)
    axes.set_yticks(range(len(group)), [window.acne.variant for window in group], fontsize=look.SMALL)
    axes.set(ylim=(len(group) - 0.4, -0.9), xlabel="length of the offset")
    axes.xaxis.set_major_formatter(lambda value, _: look.short(value))
    axes.xaxis.minorticks_off()
    axes.grid(axis="x")
