"""Draws the overview of all rows: the stress that each renderer and precision survives, by robust and naive ways."""

import textwrap
from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.patches import Patch, Rectangle

from harness.statistics.digits import percentage
from reports.paper import markdown, style
from reports.run.cell import Missing
from reports.run.results import Results
from reports.stability import stability
from reports.stability import style as look
from reports.stability.stability import Curve, Row, Way

TITLE = "Overview: where each method breaks"
CAPTION = (
    "A number: decades of stress from the mildest level of the row to the last one before the first failure; for a row "
    "whose levels are not decades, such as 5/8, levels. Colour: the share of all levels that were run. all: no failure "
    "at any level. ×: failures at the mildest level. ≥, grey: no failure, but further levels have no answer; <, grey: "
    "failures, but milder levels have no answer. Hatched: the renderer has no such method or feature; crossed: it ran "
    "and gave no answer; empty: not run. Naive methods are those that programs often use; they are not the defaults. "
    "32 and 64: float32 and float64."
)
SIGNS = (
    "Number: decades before the first failure (5/8: levels). all: none at any level. ×: at the mildest. ≥, <, grey: "
    "further or milder levels have no answer."
)
TABLE = (
    "The first level with a failure, the share of wrong answers there, and the first level with 1 % or more, beside "
    "the level where theory expects the method to break. Theory says where most answers fail; of many thousand answers "
    "those nearest to an edge fail earlier."
)
MANY = 0.01  # of the answers
MAP = "RdYlBu"  # people with any colour vision tell it apart
LINE, COLUMN = 0.125, 0.25  # inches of a cell
NAMES, HEAD, FOOT = 1.6, 0.85, 0.95
LETTER = 0.044  # inches, about
TEXT = 6.0  # points, as a column is as wide as this figure
NOTE = 21  # letters of the note, to the inch
KINDS = {False: "robust methods", True: "naive methods"}


def write(results: Results, out: Path) -> str:
    """Writes stability-overview.png, of robust ways, and -naive.png; returns the section with them and a table."""
    rows = stability.rows(results)
    parts = [f"## {TITLE}"]
    for naive, kind in KINDS.items():
        if any(way.naive == naive for row in rows for way in row.ways):
            path = out / f"stability-overview{'-naive' * naive}"
            parts.append(style.figure(path, f"{TITLE}: {kind}", draw, results, rows, naive))
    parts.append(markdown.escape(CAPTION))
    return "\n\n".join([*parts, "### Break points", _table(results, rows), markdown.escape(TABLE)])


def _table(results: Results, rows: list[Row]) -> str:
    variants = look.variants(results, rows)
    lines = []
    for row in rows:
        for precision in row.precisions:
            for way in row.ways:
                curves = [row.find(variant, precision, way) for variant in variants]
                if any(curves):
                    head = [row.label, row.facts["stress"], precision, f"{way.name}{' (naive)' * way.naive}"]
                    lines.append([*head, _theory(curves), *map(broken, curves)])
    header = ["row", "stress", "precision", "method", "theory", *variants]
    return markdown.table(header, lines)


def _theory(curves: list[Curve | None]) -> str:
    limits = [curve.limit for curve in curves if curve and curve.limit is not None]
    return f"{look.short(limits[0])}" if limits else "none given"


def broken(curve: Curve | None) -> str:
    """Returns the level at which a curve breaks, and the shares of wrong answers; or that it does not, or why not."""
    if curve is None:
        return "not run"
    if curve.broken:
        many = next((point for point in curve.answered if point.share >= MANY), None)
        more = f"{100 * MANY:g} % from {look.short(many.level)} on" if many else f"never {100 * MANY:g} %"
        return f"{look.short(curve.broken.level)} ({percentage(curve.broken.share)}; {more})"
    why = next(iter(curve.missing), "")
    if not curve.answered:
        return why
    return f"none up to {look.short(curve.answered[-1].level)}" + (f", then {why}" if why else "")


def draw(results: Results, rows: list[Row], naive: bool):
    """Draws the map of the robust or the naive ways: a line for each, a column for each renderer and precision."""
    rows = [row for row in rows if any(way.naive == naive for way in row.ways)]
    columns = _columns(results, rows, naive)
    start = NAMES + 0.2 + LETTER * max(len(way.name) for row in rows for way in row.ways if way.naive == naive)
    note = look.origin(results, [cell for row in rows for cell in row.cells])
    wide = max(4.5, start + COLUMN * len(columns) + 0.15)
    note = textwrap.fill(note, int(wide * NOTE))
    foot = FOOT + 0.1 * len(note.splitlines())
    count = sum(way.naive == naive for row in rows for way in row.ways)
    high = HEAD + LINE * count + foot
    figure = plt.figure(figsize=(wide, high))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, wide), ylim=(high, 0))
    axes.axis("off")
    _head(axes, start, KINDS[naive], columns)
    top, code = HEAD, None
    for row in rows:
        strong = row.facts["code"] != code
        axes.plot([0.05, wide - 0.05], [top, top], color=look.GREY if strong else look.PALE, lw=0.5)
        code = row.facts["code"]
        ways = [way for way in row.ways if way.naive == naive]
        _text(axes, 0.08, top + LINE * len(ways) / 2, row.label, ha="left")
        for way in ways:
            _text(axes, start - 0.06, top + LINE / 2, way.name, ha="right", color="#333333")
            for place, (variant, precision) in enumerate(columns):
                _cell(axes, row, way, variant, precision, (start + place * COLUMN, top, COLUMN, LINE))
            top += LINE
    _legend(figure, axes, wide, high, foot)
    figure.text(0.08 / wide, 0.08 / high, note, fontsize=TEXT, color=look.GREY, va="bottom")
    return figure


def _columns(results: Results, rows: list[Row], naive: bool) -> list[tuple[str, str]]:
    """Returns the variants, each with its precisions, that have an answer or a reason in some row."""
    pairs = {(curve.variant, curve.precision) for row in rows for curve in row.curves if curve.way.naive == naive}
    return [(variant, precision) for variant in look.variants(results, rows)
            for precision in sorted({precision for name, precision in pairs if name == variant})]  # fmt: skip


def _text(axes, x: float, y: float, text: str, **how) -> None:
    axes.text(x, y, text, **{"fontsize": TEXT, "va": "center", **how})


def _head(axes, start: float, kind: str, columns: list[tuple[str, str]]) -> None:
    _text(axes, start, 0.14, kind, ha="left", fontsize=7, fontweight="bold")
    for variant in dict.fromkeys(variant for variant, _ in columns):
        places = [start + (place + 0.5) * COLUMN for place, (name, _) in enumerate(columns) if name == variant]
        fits = len(variant) * LETTER < COLUMN * len(places)
        upright = {"ha": "center"} if fits else {"ha": "center", "rotation": 90}
        _text(axes, sum(places) / len(places), HEAD - 0.16, variant, va="bottom",
              **upright)  # fmt: skip
    for place, (_, precision) in enumerate(columns):
        at = start + (place + 0.5) * COLUMN
        _text(axes, at, HEAD - 0.08, precision.removeprefix("float"), ha="center", color=look.GREY)


def _cell(axes, row: Row, way: Way, variant: str, precision: str, box: tuple[float, float, float, float]) -> None:
    curve = row.find(variant, precision, way)
    if curve is None:
        return
    x, y, wide, tall = box
    survival = row.survival(curve)
    if isinstance(survival, Missing):
        axes.add_patch(Rectangle((x, y), wide, tall, **_hatch({point.status for point in curve.points})))
        return
    shade = plt.get_cmap(MAP)(0.12 + 0.76 * survival.share) if survival.sure else "#EEEEEE"
    axes.add_patch(Rectangle((x, y), wide, tall, fc=shade, ec="white", lw=0.5))
    _text(axes, x + wide / 2, y + tall / 2, survival.mark, ha="center", fontsize=TEXT,
          fontweight="bold" if survival.whole else "normal")  # fmt: skip


def _hatch(statuses: set[str]) -> dict:
    lacks = not statuses.isdisjoint(("unsupported", "unavailable"))
    return {"fc": "#F4F4F4", "ec": "#AAAAAA", "lw": 0.0, "hatch": "////" if lacks else "xxxx"}


def _legend(figure, axes, wide: float, high: float, foot: float) -> None:
    bar = figure.add_axes((0.3 / wide, (foot - 0.33) / high, 1.6 / wide, 0.08 / high))
    shades = plt.get_cmap(MAP)([0.12 + 0.76 * step / 99 for step in range(100)])
    drawn = figure.colorbar(ScalarMappable(Normalize(0, 1), ListedColormap(shades)), cax=bar, orientation="horizontal")
    drawn.set_ticks([0, 0.5, 1], labels=["0", "half", "all"])
    drawn.ax.tick_params(labelsize=TEXT, length=1.5)
    drawn.outline.set_linewidth(0.4)
    _text(axes, 0.3, high - foot + 0.17, "survived, of the stress that was run", ha="left")
    handles = [Patch(**_hatch({"unsupported"})), Patch(**_hatch({"failed"}))]
    labels = ["no such method or feature", "asked, no answer"]
    place = 2.4 / wide, (foot - 0.09) / high
    axes.legend(handles, labels, loc="upper left", bbox_to_anchor=place, ncols=2, fontsize=TEXT)
    text = textwrap.fill(SIGNS, max(30, int((wide - 2.5) * NOTE)))
    _text(axes, 2.45, high - foot + 0.33, text, ha="left", va="top")
