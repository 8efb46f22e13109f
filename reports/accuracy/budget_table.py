"""Tabulates the fastest method within each error budget, for each view."""

from pathlib import Path

from reports.accuracy import accuracy_columns, pareto, pareto_table
from reports.accuracy.pareto import BUDGETS, Chart
from reports.paper import markdown, quantity, table, thinning
from reports.run import command, method
from reports.run.cell import Missing
from reports.run.results import Results

TITLE = "The fastest method within an error budget"
HEADER = ("error at most", "fastest", "steady frame", "RMSE", "not resolved from", "command")
CSV_HEADER = (
    "view", "scene", "budget", "variant", "method", "time_s", "time_low_s", "time_high_s", "error_rmse",
    "error_against", "not_resolved_from", "note", "command",
)  # fmt: skip
CAPTION = (
    "Errors and times as in the charts. Not resolved: the next methods in time whose ratio to the fastest may be 1 by "
    "its interval, or lies within the noise floor of the run; with too few processes all ratios count as not resolved."
)
MOST = 24  # views
NAMED = {1 / 32: "1/32", pareto.VISIBLE: "1/255"}


def write(results: Results, out: Path) -> str:
    """Writes budgets.csv; returns the section of the report, "" without errors."""
    charts = [chart for chart in pareto.charts(results) if chart.points]
    if not charts:
        return ""
    lines = (_fields(results, chart, budget) for chart in charts for budget in BUDGETS)
    table.write_lines(out / "budgets.csv", CSV_HEADER, lines)
    shown = thinning.few(charts, MOST)
    parts = [f"## {TITLE}"]
    for chart in shown:
        rows = [_row(results, chart, budget) for budget in BUDGETS]
        parts += [f"### {markdown.escape(chart.view.title)}", markdown.table(HEADER, rows)]
    parts += [thinning.note(len(shown), len(charts), "tables", "the CSV file has all"), "[budgets.csv](budgets.csv)"]
    return "\n\n".join(filter(None, [*parts, markdown.escape(CAPTION)]))


def _row(results: Results, chart: Chart, budget: float) -> list[str]:
    cheapest = chart.cheapest(results, budget)
    name = NAMED.get(budget, f"{budget:g}")
    if isinstance(cheapest, Missing):
        return [name, str(cheapest), *["unavailable"] * 4]
    point, rivals = cheapest
    numbers = quantity.seconds(point.time), accuracy_columns.shown_rmse(point.cell)
    return [name, point.name, *numbers, _names(rivals) or "none", pareto_table.shown_command(results, point.cell)]


def _fields(results: Results, chart: Chart, budget: float) -> list:
    cheapest = chart.cheapest(results, budget)
    view = chart.view
    head = [view.label, view.cells[0].scene, budget]
    if isinstance(cheapest, Missing):
        return [*head, *[None] * 6, chart.against or accuracy_columns.OF_SCENE, "", str(cheapest), ""]
    (point, rivals), cell = cheapest, cheapest[0].cell
    return [
        *head, cell.variant, chart.names.method(cell) or method.PLAIN, point.time.value, point.time.low,
        point.time.high, point.error, cell.against or accuracy_columns.OF_SCENE, _names(rivals), "",
        str(command.of(results, cell)),
    ]  # fmt: skip


def _names(points: list) -> str:
    return "; ".join(point.name for point in points)
