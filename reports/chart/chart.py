"""Prepares the interactive chart of speed against accuracy: points of reports.accuracy.pareto with their details."""

import numpy as np

from reports.accuracy import accuracy_columns, pareto, pareto_figure
from reports.accuracy.pareto import VISIBLE, Chart, Point
from reports.chart.embedded import Embedded, smaller
from reports.paper import quantity, style, thinning
from reports.run import command, naming, stored
from reports.run.cell import Cell, Missing
from reports.run.results import Results

MOST = 2000  # points of a page
MOST_SEEN = 240  # pictures of points
LONGEST = 132  # pixels of such a picture
TOLD = ("error (RMSE, linear RGB)", "agrees", "steady frame", "peak memory", "efficiency", "its processes")


def data(results: Results, pictures: Embedded) -> dict:
    """Returns `charts`, `colours` by variant and notes for the page; {} without errors. Adds pictures to `pictures`."""
    charts = [chart for chart in pareto.charts(results) if chart.points]
    if not charts:
        return {}
    there = sum(len(chart.points) for chart in charts)
    seen = _seen(results, charts, pictures)
    made, left, words = [], MOST, Words()
    for number, chart in enumerate(charts):
        share = max(1, left // (len(charts) - number))
        kept = _kept(chart, share)
        left -= len(kept)
        made.append(_chart(results, chart, kept, seen, words))
    colours = {name: style.colour(name, results.variants) for name in results.variants}
    notes = [thinning.note(MOST - left, there, "points", "the CSV files have all")]
    notes += [f"{len(seen)} of the {there} points have a picture."] * (len(seen) < there)
    says = " ".join(filter(None, notes))
    return {"charts": made, "told": TOLD, "words": words.all, "colours": colours, "visible": VISIBLE, "says": says}


class Words:
    """Stores texts as lists of places in `all`, since commands differ in a few words only."""

    def __init__(self):
        self._places: dict[str, int] = {}

    @property
    def all(self) -> list[str]:
        return list(self._places)

    def of(self, text: str) -> list[int]:
        return [self._places.setdefault(word, len(self._places)) for word in text.split(" ")]


def _kept(chart: Chart, most: int) -> list[Point]:
    """Returns at most `most` points: the front, and others evenly spread."""
    front = thinning.few(chart.front, most)
    others = thinning.few([point for point in chart.points if not point.number], most - len(front))
    some = set(map(id, [*front, *others]))
    return [point for point in chart.points if id(point) in some]


def _seen(results: Results, charts: list[Chart], pictures: Embedded) -> dict[Cell, str]:
    """Adds small pictures, those of the fronts first; returns their keys."""
    cells = [point.cell for chart in charts for point in chart.front]
    cells += [cell for chart in charts for cell in thinning.few([point.cell for point in chart.points], MOST_SEEN)]
    keys: dict[Cell, str] = {}
    for cell in dict.fromkeys(cells):
        picture = stored.picture(results, cell) if len(keys) < MOST_SEEN else None
        if isinstance(picture, np.ndarray):
            key = pictures.add_pixels(smaller(stored.displayed(picture, cell), LONGEST))
            keys |= {cell: key} if key else {}
    return keys


def _chart(results: Results, chart: Chart, kept: list[Point], seen: dict[Cell, str], words: Words) -> dict:
    families = pareto_figure.family_of(chart)
    names = list(dict.fromkeys(families[point.cell] for point in kept))
    place = {id(point): number for number, point in enumerate(kept)}
    by_cell = {point.cell: point for point in kept}
    curves = [[place[id(by_cell[cell])] for cell in curve.cells if cell in by_cell] for curve in chart.curves]
    points = [
        _point(results, chart, point, names.index(families[point.cell]), seen.get(point.cell), words) for point in kept
    ]
    return {
        "label": chart.view.title,
        "resolution": chart.resolution,
        "axis": chart.axis,
        "sampled": chart.sampled,
        "points": points,
        "front": [place[id(point)] for point in chart.front if id(point) in place],
        "curves": [curve for curve in curves if len(curve) > 1],
        "lacking": len(chart.lacking),
    }


def _point(results: Results, chart: Chart, point: Point, family: int, seen: str | None, words: Words) -> dict:
    cell, efficiency = point.cell, point.efficiency
    memory = cell.median("peak_bytes", "not reported")
    return {
        "variant": cell.variant,
        "name": point.name,
        "where": naming.called(results, cell.place),
        "error": chart.drawn(point),
        "time": [point.time.value, point.time.low, point.time.high],
        "share": round(point.share, 3),
        "number": point.number,
        "family": family,
        "told": [
            accuracy_columns.shown_rmse(cell),
            cell.agreement,
            quantity.seconds(point.time),
            quantity.size(memory),
            str(efficiency) if isinstance(efficiency, Missing) else f"{efficiency:.3g} /s",
            cell.verdict,
        ],
        "picture": seen,
        "render": words.of(str(command.of(results, cell))),
        "again": words.of(str(command.again(results, cell))),
    }
