"""Reports what each scene needs: of each thing that a run left out the error without it, and the time that saves."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from harness.statistics import change, statistics
from harness.statistics.change import SURE, Change
from harness.statistics.statistics import NOT_RESOLVED, Estimate
from harness.store import record
from reports.accuracy import accuracy_columns
from reports.paper import markdown, quantity, style, table, thinning
from reports.run import naming, ranking, reduced, stored
from reports.run.cell import Cell, Missing
from reports.run.results import Results, grouped
from reports.worth import figure, sheet

TITLE = "What the scene needs"
MOST = 12  # whole cells that are shown
HEADER = (
    "left out", "pixels changed", "largest change", "RMSE from the truth", "FLIP from the truth", "time of a frame",
    "peak memory", "verdict",
)  # fmt: skip
CSV_HEADER = (
    "scene", "point", "variant", "without", "kind", "proof", "status", "pixels_changed", "largest_change",
    "error_rmse", "error_rmse_standard_error", "mean_squared_error_added", "mean_squared_error_added_standard_error",
    "error_flip", "time_ratio", "time_ratio_low", "time_ratio_high", "time_verdict", "memory_ratio", "verdict", "note",
)  # fmt: skip
CAPTION = (
    "Each row is a picture of the scene without one thing. Pixels changed: by more than 1e-9 against the picture of "
    "the whole scene with the same seed, by the same renderer. Error: distance from the truth of the whole scene. It "
    f"grows or shrinks where the change of its mean square is more than {SURE} standard errors; the noise of the "
    "truth, which both pictures share, cancels. Time and memory: times those of the whole scene; of a time the median "
    'over rounds with its interval, "not resolved" as in the table of times. "Proved": by geometry and the rules of '
    'renderers/SPEC.md no picture of this job can change. "Measured": no pixel of this picture changed, at this size '
    "and from this eye. Effects do not add up: two things that are each harmless may not be so together, for which "
    "there is rayrace needs SCENE --within ERROR."
)


@dataclass(frozen=True, eq=False)
class Row:
    """A smaller model beside its whole. kind, proof: as the run has them. change: of the picture.

    time: frame over that of the whole; faster: statistics.verdict of it. memory: ratio of the medians of peaks.
    """

    cell: Cell
    kind: str
    proof: str
    change: Change | Missing
    time: Estimate | Missing
    faster: str
    memory: float | Missing
    picture: np.ndarray | Missing = field(repr=False)

    @property
    def name(self) -> str:
        return reduced.without(self.cell)

    @property
    def verdict(self) -> str:
        if isinstance(self.change, Missing):
            return str(self.change)
        return self.change.verdict(self.proof)

    def record(self) -> dict:
        """For the figure, of a row with a change."""
        error = {"rmse": self.cell.error(), "rmse_standard_error": _known(self.cell.error("error_rmse_standard_error"))}
        time = {"unavailable": str(self.time)}
        if isinstance(self.time, Estimate):
            time = {"ratio": self.time.value, "low": self.time.low, "high": self.time.high, "verdict": self.faster}
        return {"left_out": self.name, "proof": self.proof, "pixels": self.change.pixels, "error": error, "time": time}


def _known(value: float | Missing) -> float:
    return 0.0 if isinstance(value, Missing) else value


def rows(results: Results, whole: Cell, cells: list[Cell]) -> list[Row]:
    """Returns a row for each cell that is without something of `whole`, the largest error first."""
    full = stored.picture(results, whole)
    all_rows = [_row(results, whole, full, cell) for cell in cells]
    return sorted(all_rows, key=lambda row: (isinstance(row.change, Missing), -_known(row.cell.error())))


def _row(results: Results, whole: Cell, full: np.ndarray | Missing, cell: Cell) -> Row:
    left_out = (results.record(cell) or {}).get("without") or {}
    time = ranking.ratio_to_cell(cell, whole, "the whole scene is not ranked here")
    faster = statistics.verdict(time, results.floor.value) if isinstance(time, Estimate) else NOT_RESOLVED
    peaks = [side.median("peak_bytes", "the system does not tell the peak") for side in (cell, whole)]
    lacking = next((peak for peak in peaks if isinstance(peak, Missing)), None)
    memory = lacking or peaks[0].value / peaks[1].value
    picture = stored.picture(results, cell)
    difference = _change(results, whole, full, cell, picture)
    return Row(cell, left_out.get("kind", ""), left_out.get("proof", ""), difference, time, faster, memory, picture)


def _change(results: Results, whole: Cell, full, cell: Cell, picture) -> Change | Missing:
    if cell.status != "ok":
        return Missing(cell.verdict)
    truth, error = stored.truth(results, cell), (results.record(cell) or {}).get("error") or {}
    noise = None
    if error.get("standard_error_file"):
        noise = stored.array(results, error["standard_error_file"])
    missing = next((value for value in (picture, full, truth, noise, cell.error()) if isinstance(value, Missing)), None)
    return missing or change.between(picture, full, truth, noise, record.doubt(error))


def write(results: Results, out: Path) -> str:
    """Writes what-the-scene-needs.csv, and a chart and a sheet of the first whole cells; returns the section.

    "" for a run that leaves nothing out.
    """
    wholes = reduced.wholes(results)
    if not wholes:
        return ""
    rows_by_whole = {
        whole: rows(results, whole, cells)
        for whole, cells in grouped(wholes, lambda cell: wholes[cell]).items()
    }  # fmt: skip
    lines = (_fields(row) for group in rows_by_whole.values() for row in group)
    table.write_lines(out / "what-the-scene-needs.csv", CSV_HEADER, lines)
    shown, parts = thinning.few(list(rows_by_whole), MOST), [f"## {TITLE}"]
    for number, whole in enumerate(shown):
        parts += _part(results, whole, rows_by_whole[whole], out / f"what-the-scene-needs-{number}")
    parts.append(thinning.note(len(shown), len(rows_by_whole), "scenes and renderers", "the CSV file has all"))
    parts += ["Every row: [what-the-scene-needs.csv](what-the-scene-needs.csv)", markdown.escape(CAPTION)]
    return "\n\n".join(filter(None, parts))


def _part(results: Results, whole: Cell, group: list[Row], stem: Path) -> list[str]:
    title = f"{naming.place(whole, results.of(whole.scene))}: {whole.label}"
    measured = [row for row in group if isinstance(row.change, Change)]
    parts = [f"### {markdown.escape(title)}", _sentence(group)]
    if measured:
        error = whole.error()
        records = [row.record() for row in measured]
        if not isinstance(error, Missing):
            parts.append(style.figure(stem, f"{TITLE}: {title}", figure.draw, records, error))
        changed = [
            (row.name, accuracy_columns.shown_rmse(row.cell), row.picture) for row in measured if row.change.pixels > 0
        ]
        full = stored.picture(results, whole)
        if changed:
            parts.append(style.figure(Path(f"{stem}-sheet"), f"{TITLE}, pictures: {title}", sheet.draw, full, changed))
    parts.append(markdown.table(HEADER, [_texts(row, results.floor.value) for row in group]))
    return parts


def _sentence(group: list[Row]) -> str:
    """Counts what the picture needs and what it does not, with the greatest saving."""
    measured = [row for row in group if isinstance(row.change, Change)]
    proved = sum(bool(row.proof) for row in measured)
    idle = sum(not row.proof and row.change.pixels == 0 for row in measured)
    phrases = [f"{len(measured)} thing{'s were' if len(measured) != 1 else ' was'} left out, one at a time"]
    phrases += [f"{proved} of them contribute{'s' * (proved == 1)} nothing (proved)"] * bool(proved)
    phrases += [f"without {idle} no pixel changes (measured)"] * bool(idle)
    lacking = len(group) - len(measured)
    phrases += [f"{lacking} {'is' if lacking == 1 else 'are'} unavailable"] * bool(lacking)
    quick = [row for row in measured if row.faster == "faster"]
    if quick:
        best = min(quick, key=lambda row: row.time.value)
        phrases.append(f"the most time is saved without {best.name}: {quantity.times(best.time)} that of the whole")
    return markdown.escape("; ".join(phrases) + ".")


def _texts(row: Row, floor: float | None) -> list[str]:
    if isinstance(row.change, Missing):
        return [row.name, *["unavailable"] * 6, str(row.change)]
    return [
        row.name, quantity.percent(row.change.pixels), quantity.exact(row.change.largest),
        quantity.exact(row.cell.error()), quantity.exact(row.cell.error("error_flip")),
        str(row.time) if isinstance(row.time, Missing) else quantity.ratio(row.time, floor),
        str(row.memory) if isinstance(row.memory, Missing) else quantity.plain(row.memory), row.verdict,
    ]  # fmt: skip


def _fields(row: Row) -> list:
    cell, difference = row.cell, row.change
    changed = [None] * 2 if isinstance(difference, Missing) else [difference.pixels, difference.largest]
    added = [None] * 2 if isinstance(difference, Missing) else [difference.added, difference.doubt]
    time = [row.time.value, row.time.low, row.time.high, row.faster] if isinstance(row.time, Estimate) else [None] * 4
    notes = [str(value) for value in (difference, row.time, row.memory) if isinstance(value, Missing)]
    fields = [
        cell.scene, cell.point, cell.variant, row.name, row.kind, row.proof, cell.status, *changed, cell.error(),
        cell.error("error_rmse_standard_error"), *added, cell.error("error_flip"), *time, row.memory, row.verdict,
        "; ".join(dict.fromkeys(notes)),
    ]  # fmt: skip
    return [None if isinstance(field, Missing) else field for field in fields]
