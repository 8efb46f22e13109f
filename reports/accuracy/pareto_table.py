"""Tabulates a Pareto chart: its front for people, all methods in a CSV file, and the methods without a point."""

from pathlib import Path

from reports.accuracy.pareto import Chart, Point, worst_error
from reports.paper import markdown, quantity, table
from reports.run import command, method
from reports.run.cell import Cell, Missing
from reports.run.results import Results, grouped

HEADER = (
    "number", "variant and method", "RMSE", "largest error", "beyond 1/255 (%)", "FLIP", "steady frame (s)",
    "peak memory (MB)", "on the front (%)", "efficiency (1/s)", "command",
)  # fmt: skip
CSV_HEADER = (
    "number", "scene", "point", "variant", "method", "status", "time_s", "time_low_s", "time_high_s", "processes",
    "error_rmse", "error_max", "error_max_outside", "error_bad_pixels", "error_flip", "standard_error",
    "truth_pictures", "bound_max", "bound_mean", "peak_bytes", "share_on_front", "efficiency", "note", "command",
    "measured_by",
)  # fmt: skip
WORST = (
    "error_max", "error_max_outside", "error_bad_pixels", "error_flip", "standard_error", "truth_pictures",
    "bound_max", "bound_mean",
)  # fmt: skip
FEW = 3  # methods of one variant and reason; more are only counted


def front(results: Results, chart: Chart) -> list[str]:
    """Returns the accuracy of the truth, and the table of the front with commands ready to type."""
    return [_truth(results, chart), markdown.table(HEADER, [_row(results, point) for point in chart.front])]


def shown_command(results: Results, cell: Cell) -> str:
    """Returns the command that makes the picture of a cell, as a cell of a table."""
    words = command.of(results, cell)
    return str(words) if isinstance(words, Missing) else markdown.code(words)


def _row(results: Results, point: Point) -> list[str]:
    cell, efficiency = point.cell, point.efficiency
    return [
        str(point.number), point.name, quantity.exact(point.error), quantity.exact(worst_error(cell, "error_max")),
        quantity.exact(worst_error(cell, "error_bad_pixels"), 100), quantity.exact(worst_error(cell, "error_flip")),
        quantity.text(point.time), quantity.text(cell.median("peak_bytes", "the peak is not known"), 1e-6),
        f"{100 * point.share:.3g}",
        ("exact" if point.error == 0 else "biased") if isinstance(efficiency, Missing) else f"{efficiency:.3g}",
        shown_command(results, cell),
    ]  # fmt: skip


def _truth(results: Results, chart: Chart) -> str:
    """Says how accurately the truth is known."""
    errors = [results.record(point.cell)["error"] for point in chart.points]
    makers = " and ".join(dict.fromkeys(error["truth"] for error in errors))
    if chart.sampled:
        pictures = max(error["pictures"] for error in errors)
        return markdown.escape(
            f"The truth is the mean of {pictures} pictures of {makers}; its standard error is {chart.resolution:.2g}."
        )
    certificate = errors[0].get("certificate") or {"unavailable": "no check was asked for"}
    if "unavailable" in certificate:
        return markdown.escape(f"{makers} made the truth, not checked in more digits: {certificate['unavailable']}.")
    return markdown.escape(
        f"{makers} made the truth; at {certificate['spots']} pixels computed in {certificate['digits']} digits the "
        f"largest difference outside the mask is {certificate['largest']:.2g}."
    )


def left_out(chart: Chart) -> list[str]:
    """Returns the list of methods without a point, each with its reason."""
    return markdown.listed("Not drawn:", [f"{names}: {why}" for (_, why), names in without_point(chart).items()])


def without_point(chart: Chart) -> dict[tuple[str, str], str]:
    """Returns the methods without a point by variant and reason; many are only counted."""
    groups = grouped(chart.lacking, lambda one: (one[0].variant, one[1]))
    return {
        key: "; ".join(chart.names.full(cell) for cell, _ in mine)
        if len(mine) <= FEW
        else f"{key[0]}, {len(mine)} methods"
        for key, mine in groups.items()
    }


def write_csv(results: Results, chart: Chart, path: Path) -> None:
    """Writes every method of a chart, numbers in full; NaN where there is none."""
    points = {point.cell: point for point in chart.points}
    why = dict(chart.lacking)
    cells = dict.fromkeys([*chart.view.cells, *why])
    table.write_lines(path, CSV_HEADER, (_fields(results, chart, cell, points.get(cell), why) for cell in cells))


def _fields(results: Results, chart: Chart, cell: Cell, point: Point | None, why: dict) -> list:
    time, efficiency = cell.steady, point.efficiency if point else None
    ends = [None] * 4 if isinstance(time, Missing) else [time.value, time.low, time.high, time.processes]
    note = why.get(cell) or (efficiency if isinstance(efficiency, Missing) else "")
    fields = [
        point.number if point else None, cell.scene, cell.point, cell.variant,
        chart.names.method(cell) or method.PLAIN, cell.status, *ends, worst_error(cell),
        *(worst_error(cell, column) for column in WORST), cell.median("peak_bytes", "unknown"),
        point.share if point else None, efficiency, str(note),
        str(command.of(results, cell)), str(command.again(results, cell)),
    ]  # fmt: skip
    return [None if isinstance(field, Missing) else getattr(field, "value", field) for field in fields]
