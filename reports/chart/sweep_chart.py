"""Prepares the interactive chart of sweeps: panels of reports.scaling.sweep with every quantity."""

from reports.chart.embedded import Embedded
from reports.paper import style, thinning
from reports.run.results import Results
from reports.scaling import crossing, sweep, sweep_figure
from reports.scaling.sweep import QUANTITIES, Panel, Quantity

MOST = 2000  # points of a page


def data(results: Results, _: Embedded) -> dict:
    """Returns `panels`, `quantities` and `colours` by variant; {} if the run varies no number."""
    every = sweep.panels(results)
    if not every:
        return {}
    panels = _kept(every)
    quantities = [what for what in QUANTITIES if crossing.values(panels, what)]
    numbered = {what: sweep_figure.crossings(results, panels, what) for what in quantities}
    looks = list(dict.fromkeys(line.label for panel in panels for line in panel.lines))
    return {
        "panels": [_panel(panel, quantities, numbered, looks) for panel in panels],
        "quantities": [_quantity(panels, what) for what in quantities],
        "colours": {name: style.colour(name, results.variants) for name in results.variants},
        "says": thinning.note(len(panels), len(every), "charts", "the CSV file has all"),
    }


def _kept(panels: list[Panel]) -> list[Panel]:
    """Returns panels with at most MOST points, the largest of each axis first, in their order; at least one."""
    order = sweep_figure.ranked(panels)
    count, kept = 0, []
    for panel in order:
        count += sum(len(line.cells) for line in panel.lines)
        if count > MOST and kept:
            break
        kept.append(panel)
    return [panel for panel in panels if panel in kept]


def _quantity(panels: list[Panel], what: Quantity) -> dict:
    unit, name = sweep_figure.unit_of(crossing.values(panels, what), what)
    upright = crossing.upright(crossing.values(panels, what))
    return {"title": f"{what.title} ({name})" if name else what.title, "unit": unit, "log": upright.name == "log"}


def _panel(panel: Panel, quantities: list[Quantity], numbered: dict, looks: list[str]) -> dict:
    label = f"{panel.axis.name}: {panel.label}" if panel.label else panel.axis.name
    values = panel.values
    return {
        "label": label,
        "axis": panel.axis.name,
        "log": crossing.across(values).name == "log",
        "ticks": [[value, sweep_figure.tick(panel, value)] for value in values],
        "mark": panel.mark,
        "lines": [
            {
                "name": line.label,
                "variant": line.variant,
                "look": looks.index(line.label),
                "points": [
                    [[x, *map(_short, (value.value, value.low, value.high))] for x, value in line.points(what)]
                    for what in quantities
                ],
            }
            for line in panel.lines
        ],
        "crossings": [
            [
                [meeting.x, _short(meeting.y), sweep_figure.words(panel, what, meeting)]
                for _, meeting in numbered[what][panel]
            ]
            for what in quantities
        ],
    }


def _short(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.5g}")
