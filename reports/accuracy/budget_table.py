"""The table of the cheapest method within each error budget, for each view."""

import csv
from pathlib import Path

from reports.accuracy import pareto, pareto_table
from reports.accuracy.pareto import BUDGETS, Chart
from reports.paper import markdown, quantity, thinning
from reports.run import command, method
from reports.run.cell import Missing
from reports.run.results import Results

TITLE = "The cheapest method within an error budget"
HEADER = ("error at most", "cheapest", "steady frame (s)", "RMSE", "not resolved from", "command")
CSV_HEADER = (
    "view", "scene", "budget", "variant", "method", "time_s", "time_low_s", "time_high_s", "error_rmse",
    "not_resolved_from", "note", "command",
)  # fmt: skip
CAPTION = (
    "Errors and times as in the charts. Not resolved: the next ones in time whose ratio to the cheapest has an "
    "interval that holds 1, or that is no further from 1 than the noise floor of the run; of too few processes all are."
)
MOST = 24  # views
NAMED = {1 / 32: "1/32", pareto.VISIBLE: "1/255"}


def write(results: Results, out: Path) -> str:
    """budgets.csv, and the section of the report; "" without errors."""
    charts = [chart for chart in pareto.charts(results) if chart.points]
    if not charts:
        return ""
    with open(out / "budgets.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(CSV_HEADER)
        writer.writerows(_fields(results, chart, budget) for chart in charts for budget in BUDGETS)
    shown = thinning.few(charts, MOST)
    parts = [f"## {TITLE}"]
    for chart in shown:
        header = "| " + " | ".join(HEADER) + " |\n" + "| --- " * len(HEADER) + "|"
        rows = [_row(results, chart, budget) for budget in BUDGETS]
        parts += [f"### {markdown.escape(chart.view.label)}", "\n".join([header, *rows])]
    parts += [thinning.told(len(shown), len(charts), "tables", "the CSV file has all"), "[budgets.csv](budgets.csv)"]
    return "\n\n".join(filter(None, [*parts, markdown.escape(CAPTION)]))


def _row(results: Results, chart: Chart, budget: float) -> str:
    found = chart.cheapest(results, budget)
    name = NAMED.get(budget, f"{budget:g}")
    if isinstance(found, Missing):
        texts, made = [name, str(found), *["unavailable"] * 3], "unavailable"
    else:
        point, rivals = found
        texts = [name, point.name, quantity.text(point.time), pareto_table.error(point.error), _names(rivals) or "none"]
        made = pareto_table.code(command.of(results, point.cell))
    return "| " + " | ".join([*map(markdown.escape, texts), made]) + " |"


def _fields(results: Results, chart: Chart, budget: float) -> list:
    found = chart.cheapest(results, budget)
    view = chart.view
    head = [view.label, view.cells[0].scene, budget]
    if isinstance(found, Missing):
        return [*head, *["NaN"] * 6, "", str(found), ""]
    point, rivals = found
    low, high = ("NaN" if end is None else end for end in (point.time.low, point.time.high))
    cell = point.cell
    return [
        *head, cell.variant, chart.names.method(cell) or method.PLAIN, point.time.value, low, high, point.error,
        _names(rivals), "", str(command.of(results, cell)),
    ]  # fmt: skip


def _names(points: list) -> str:
    return "; ".join(point.name for point in points)
