"""The table of a Pareto chart: the front for people, all methods in a CSV file, and methods without a point."""

import csv
from pathlib import Path

from reports.accuracy.pareto import Chart, Point, known_error
from reports.paper import markdown, quantity
from reports.run import command, method
from reports.run.cell import Cell, Missing
from reports.run.results import Results

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
FEW = 3  # methods of one variant and reason that are named one by one


def told(results: Results, chart: Chart) -> list[str]:
    """Returns the accuracy of the truth, and the table of the front with commands ready to type."""
    header = "| " + " | ".join(HEADER) + " |\n" + "| --- " * len(HEADER) + "|"
    return [_truth(results, chart), "\n".join([header, *(_row(results, point) for point in chart.front)])]


def code(words: str | Missing) -> str:
    """A command in a cell of a table, as Markdown that shows it as it is."""
    if isinstance(words, Missing):
        return markdown.escape(words)
    fence = "`" * (1 + max((len(run) for run in words.replace("`", " `").split() if set(run) == {"`"}), default=0))
    return f"{fence}{' ' * ('`' in words)}{words}{' ' * ('`' in words)}{fence}".replace("|", "\\|")


def worst(cell: Cell, column: str) -> float | Missing:
    """The largest value of a column of the error or the bound, or why there is none."""
    found = cell.known(column, cell.timed)
    if found:
        return float(max(found.values()))
    of_it = ("no_error_flip", "no_error") if column == "error_flip" else ("no_error",)
    reasons = [reason for name in of_it for reason in cell.known(name, cell.timed).values()]
    return Missing(next(iter(reasons), "not told"))


def _row(results: Results, point: Point) -> str:
    cell = point.cell
    efficiency = point.efficiency
    texts = [
        str(point.number), point.name, error(point.error), error(worst(cell, "error_max")),
        error(worst(cell, "error_bad_pixels"), 100), error(worst(cell, "error_flip")), quantity.text(point.time),
        quantity.text(cell.median("peak_bytes", "the peak is not known"), 1e-6), f"{100 * point.share:.3g}",
        ("exact" if point.error == 0 else "biased") if isinstance(efficiency, Missing) else f"{efficiency:.3g}",
    ]  # fmt: skip
    return "| " + " | ".join([*map(markdown.escape, texts), code(command.of(results, cell))]) + " |"


def error(value: float | Missing, scale: float = 1.0) -> str:
    return "exactly 0" if value == 0 else quantity.text(value, scale)


def _truth(results: Results, chart: Chart) -> str:
    """How well the truth is known."""
    told = [results.record(point.cell)["error"] for point in chart.points]
    makers = " and ".join(dict.fromkeys(one["truth"] for one in told))
    if chart.sampled:
        pictures = max(one["pictures"] for one in told)
        return markdown.escape(
            f"The truth is the mean of {pictures} pictures of {makers}; its standard error is {chart.resolution:.2g}."
        )
    certificate = told[0].get("certificate") or {"unavailable": "nobody was asked"}
    if "unavailable" in certificate:
        return markdown.escape(f"The truth is of {makers}; not certified in more digits: {certificate['unavailable']}.")
    return markdown.escape(
        f"The truth is of {makers}; of {certificate['spots']} pixels worked out in {certificate['digits']} digits the "
        f"largest difference outside the mask is {certificate['largest']:.2g}."
    )


def left_out(chart: Chart) -> list[str]:
    """The methods that have no point, each with its reason."""
    items = [f"{names}: {why}" for (_, why), names in without_point(chart).items()]
    return ["Not drawn:", markdown.bullets(list(map(markdown.escape, items)))] if items else []


def without_point(chart: Chart) -> dict[tuple[str, str], str]:
    """The methods that have no point by variant and reason; of many how many there are."""
    groups: dict[tuple[str, str], list[str]] = {}
    for cell, why in chart.lacking:
        groups.setdefault((cell.variant, why), []).append(chart.names.full(cell))
    return {
        key: "; ".join(names) if len(names) <= FEW else f"{key[0]}, {len(names)} methods"
        for key, names in groups.items()
    }


def write_csv(results: Results, chart: Chart, path: Path) -> None:
    """Every method of a chart, numbers in full; NaN where there is none."""
    points = {point.cell: point for point in chart.points}
    why = dict(chart.lacking)
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(CSV_HEADER)
        for cell in dict.fromkeys([*chart.view.cells, *why]):
            writer.writerow([_plain(value) for value in _fields(results, chart, cell, points.get(cell), why)])


def _fields(results: Results, chart: Chart, cell: Cell, point: Point | None, why: dict) -> list:
    time, efficiency = cell.steady, point.efficiency if point else None
    ends = [None] * 4 if isinstance(time, Missing) else [time.value, time.low, time.high, time.processes]
    note = why.get(cell) or (efficiency if isinstance(efficiency, Missing) else "")
    return [
        point.number if point else None, cell.scene, cell.point, cell.variant,
        chart.names.method(cell) or method.PLAIN, cell.status, *ends, known_error(cell),
        *(worst(cell, column) for column in WORST), cell.median("peak_bytes", "unknown"),
        point.share if point else None, efficiency, str(note),
        str(command.of(results, cell)), str(command.again(results, cell)),
    ]  # fmt: skip


def _plain(value):
    """A value of the CSV file."""
    return "NaN" if value is None or isinstance(value, Missing) else getattr(value, "value", value)
