"""Draws pictures of failures: a row's naive and robust ways side by side, where the naive ones break."""

from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from reports.paper import markdown, style
from reports.run import stored
from reports.run.cell import Missing
from reports.run.results import Results
from reports.stability import stability
from reports.stability import style as look
from reports.stability.stability import Curve, Point, Row

TITLE = "What failures look like"
CAPTION = (
    "One level, renderer and precision of each row with pictures: the first level where the most naive methods have a "
    "tenth of their answers wrong while a robust method has none, or else the level with most wrong answers. Pixels "
    "that are not finite are magenta. Wrong answers are counted as in the chart of the row."
)
FIRST = "cpp"  # the variant to show, if it has pictures
WIDEST, LEAST = 2.3, 8  # width of a picture, inches; least pixels of a side that show something
TALL, THIN = 3, 0.4  # a picture more than so many times as high as wide is turned; least height of a strip, inches
ENOUGH = 0.1  # share of wrong answers; with more, the picture no longer shows the failure


@dataclass(frozen=True)
class Panel:
    curve: Curve
    point: Point
    picture: np.ndarray  # uint8 sRGB (height, width, 3)


def write(results: Results, out: Path) -> str:
    """Writes stability-picture-NAME.png and .svg for each row; returns the section, "" without such rows."""
    parts = []
    for row in stability.rows(results):
        panels = choose(results, row)
        if panels:
            path, alt = out / f"stability-picture-{markdown.slug(row.name)}", f"{row.label}: {row.facts['title']}"
            parts += [style.figure(path, alt, draw, results, row, panels), markdown.escape(_caption(row, panels))]
    return "\n\n".join([f"## {TITLE}", markdown.escape(CAPTION), *parts]) if parts else ""


def choose(results: Results, row: Row) -> list[Panel]:
    """Returns the pictures of a row to show, robust ways last; [] if no naive way fails where a robust one holds."""
    for variant in sorted(row.variants, key=lambda variant: variant != FIRST):
        levels = [(precision, level) for precision in row.precisions for level in row.levels]
        panels = max((_panels(results, row, variant, *level) for level in levels), key=_shows, default=[])
        if any(_shows(panels)):
            return sorted(panels, key=lambda panel: not panel.curve.way.naive)
    return []


def _shows(panels: list[Panel]) -> tuple[int, float]:
    """Returns how many naive ways fail visibly while a robust one holds, and the largest share if none does."""
    shares = [panel.point.share for panel in panels if panel.curve.way.naive]
    if not shares or not any(not panel.curve.way.naive and not panel.point.fails for panel in panels):
        return 0, 0.0
    seen = sum(share >= ENOUGH for share in shares)
    return seen, 0.0 if seen else max(shares)


def _panels(results: Results, row: Row, variant: str, precision: str, level: float) -> list[Panel]:
    panels = []
    for curve in row.curves:
        point = next((point for point in curve.answered if point.level == level), None)
        if point is None or (curve.variant, curve.precision) != (variant, precision):
            continue
        picture = _picture(results, point)
        if picture is not None:
            panels.append(Panel(curve, point, picture))
    return panels


def _picture(results: Results, point: Point) -> np.ndarray | None:
    """Returns the picture as displayed; None if the cell has none, or one too small to see."""
    picture = stored.raw(results, point.cell)
    if isinstance(picture, Missing) or min(picture.shape[:2]) < LEAST:
        return None
    shown = stored.displayed(picture, point.cell)
    return shown if shown.shape[0] <= TALL * shown.shape[1] else shown.transpose(1, 0, 2)  # a strip lies


def draw(results: Results, row: Row, panels: list[Panel]):
    """Draws the pictures of a row."""
    height, width = panels[0].picture.shape[:2]
    beside = height > width / 3  # else strips, one below the other
    count = len(panels)
    wide = WIDEST if beside else 3 * WIDEST
    shape = (1, count) if beside else (count, 1)
    size = (count * wide if beside else wide, (max(wide * height / width, THIN) + 0.35) * shape[0])
    title = f"{row.label}: {row.facts['title']}"
    note = f"{_where(row, panels)} {look.origin(results, [panel.point.cell for panel in panels])}"
    figure, axes = plt.subplots(*shape, figsize=size, layout="constrained", squeeze=False)
    for place, panel in zip(axes.flat, panels, strict=True):
        place.imshow(panel.picture, interpolation="nearest", aspect="equal" if beside else "auto")
        place.set(xticks=[], yticks=[])
        place.set_title(named(panel), fontsize=look.SMALL, loc="left")
    look.frame(figure, title, ([], []), note)
    return figure


def about(row: Row, panels: list[Panel]) -> str:
    """Returns what fails in the pictures of a row, and where."""
    return f"{row.facts['title']}: {_where(row, panels)}"


def named(panel: Panel) -> str:
    """Returns the method of a picture and how many of its answers are wrong."""
    return f"{panel.curve.way.name}: {_counted(panel.point)}"


def _counted(point: Point) -> str:
    return f"{point.answers['failures']} of {point.answers['count']} wrong"


def _where(row: Row, panels: list[Panel]) -> str:
    curve, point = panels[0].curve, panels[0].point
    return f"{curve.variant}, {curve.precision}, {row.facts['stress']} {look.short(point.level)}."


def _caption(row: Row, panels: list[Panel]) -> str:
    ways = "; ".join(f"{panel.curve.way.name} {_counted(panel.point)}" for panel in panels)
    return f"{_where(row, panels)} Failures: {row.facts['failure']}: {ways}."
