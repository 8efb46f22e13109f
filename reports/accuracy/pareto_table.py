"""Tabulates a Pareto chart: its front for people, all methods in a CSV file, and the methods without a point."""

from pathlib import Path

from reports.accuracy import accuracy_columns
from reports.accuracy.pareto import ALIKE, DOUBT, Chart, Point
from reports.paper import markdown, quantity, table
from reports.paper.table import AGAINST
from reports.run import command, method
from reports.run.cell import Cell, Missing
from reports.run.results import Results, grouped

HEADER = (
    "number", "renderer and method", "RMSE", "largest error", "beyond 1/255 (%)", "FLIP", "steady frame",
    "peak memory", "on the front (%)", "efficiency (1/s)", "command",
)  # fmt: skip
CSV_HEADER = (
    "number", "scene", "point", "variant", "method", "status", "time_s", "time_low_s", "time_high_s", "processes",
    "error_rmse", "error_rmse_standard_error", "error_max", "error_bad_pixels", "error_flip", "error_against",
    "uncertainty", "truth_samples", "bound_max", "bound_mean", "peak_bytes", "share_on_front", "efficiency", "note",
    "command", "measured_by",
)  # fmt: skip
OF_TRUTH = "uncertainty", "truth_samples", "bound_max", "bound_mean"
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
        str(point.number), point.name, accuracy_columns.shown_rmse(cell), quantity.exact(cell.error("error_max")),
        quantity.exact(cell.error("error_bad_pixels"), 100), quantity.exact(cell.error("error_flip")),
        quantity.seconds(point.time), quantity.size(cell.median("peak_bytes", "the peak is not known")),
        f"{100 * point.share:.3g}",
        ("exact" if point.error == 0 else "biased") if isinstance(efficiency, Missing) else f"{efficiency:.3g}",
        shown_command(results, cell),
    ]  # fmt: skip


def _truth(results: Results, chart: Chart) -> str:
    """Says what the truth is, how accurately it is known, and by what it was checked."""
    errors = [results.record(point.cell)["error"] for point in chart.points]
    makers = " and ".join(dict.fromkeys(error["truth"] for error in errors))
    sentences = [f"{makers} made the truth{_made(errors)}."]
    if chart.against:
        sentences.append(
            f"Errors are {'' if chart.against.startswith('against') else 'held against it '}{chart.against}."
        )
    if chart.resolution > ALIKE:
        sentences.append(
            f"It is known to {chart.resolution / DOUBT:.2g} (RMS); below {DOUBT} times that, {chart.resolution:.2g}, "
            "it cannot tell."
        )
    certificate = next(filter(None, (error.get("certificate") for error in errors)), {"unavailable": "not asked for"})
    if "unavailable" in certificate:
        sentences.append(f"It was not checked in more digits: {certificate['unavailable']}.")
    else:
        few = "of a picture with a few of its samples " if chart.sampled else ""
        sentences.append(
            f"At {certificate['spots']} pixels {few}computed in {certificate['digits']} digits the largest difference "
            f"is {certificate['largest']:.2g}."
        )
    return markdown.escape(" ".join(sentences))


def _made(errors: list[dict]) -> str:
    """Returns the samples and depth of a truth in words, as far as records tell."""
    samples = max((error.get("samples") or 1 for error in errors), default=1)
    pictures = max((error.get("pictures") or 1 for error in errors), default=1)  # before 0.2
    depths = sorted({error["depth"] for error in errors if error.get("depth") is not None})
    words = [
        f"{samples} samples of a pixel" if samples > 1 else f"the mean of {pictures} pictures" if pictures > 1 else "",
        f"depth {' and '.join(map(str, depths))}" if depths else "",
    ]
    return f" ({', '.join(filter(None, words))})" if any(words) else ""


def left_out(chart: Chart) -> list[str]:
    """Returns the list of methods without a point, each with its reason."""
    return markdown.listed("Not drawn:", [f"{names}: {why}" for (_, why), names in without_point(chart).items()])


def without_point(chart: Chart) -> dict[tuple[str, str], str]:
    """Returns the methods without a point by variant and reason; many are only counted."""
    groups = grouped(chart.lacking, lambda pair: (pair[0].variant, pair[1]))
    return {
        key: "; ".join(chart.names.full(cell) for cell, _ in pairs)
        if len(pairs) <= FEW
        else f"{key[0]}, {len(pairs)} methods"
        for key, pairs in groups.items()
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
        chart.names.method(cell) or method.PLAIN, cell.status, *ends,
        *(cell.error(name) for name in CSV_HEADER if name.startswith("error_") and name != AGAINST),
        cell.against or accuracy_columns.OF_SCENE, *(cell.error(name) for name in OF_TRUTH),
        cell.median("peak_bytes", "unknown"),
        point.share if point else None, efficiency, str(note),
        str(command.of(results, cell)), str(command.again(results, cell)),
    ]  # fmt: skip
    return [None if isinstance(field, Missing) else getattr(field, "value", field) for field in fields]
