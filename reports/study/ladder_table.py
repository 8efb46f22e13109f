"""Writes the section on ladders: from the study's code to ours, one change at a time."""

from collections.abc import Iterator
from pathlib import Path

from harness.statistics.statistics import Estimate
from reports.paper import markdown, quantity, style, table
from reports.run.results import Missing, Results
from reports.study import ladder, ladder_figure
from reports.study.ladder import Climb, Step

TITLE = "From the study's code to ours"
CAPTION = (
    "All rungs of a ladder render the same picture. Factor: the time of the rung before over its own, the median over "
    "rounds of the ratio within a round, with a 95 % interval; above 1 is faster. Accounted for: the logarithm of the "
    "product of all factors over that of the measured factor of first and last rung, the smaller over the larger. "
    "Memory: the largest of a process and its descendants. Error: RMSE from the truth of the scene, linear RGB. "
    "Lines: of the source of the whole renderer, all its programs and methods, without blank ones. "
    "Instructions, if the run counted them, have a section of their own."
)
ESTIMATE = (
    "The study's picture took {published} by the number of pixels, {rest} the time of the first rung: the machine's, "
    "the interpreter's and compiler's of 2020, and whatever its unpublished source does otherwise. This is an "
    "estimate; nothing here measures it."
)
CSV_HEADER = (
    "ladder", "scene", "rung", "variant", "changes", "time_s", "low", "high", "factor", "factor_low", "factor_high",
    "processes", "peak_bytes", "error_rmse", "lines", "note",
)  # fmt: skip


def write(results: Results, out: Path) -> str:
    """Writes ladder-NUMBER.png, .svg and .pdf of each ladder, and ladder.csv; "" for a run without ladders."""
    climbs = ladder.climbs(results)
    if not climbs:
        return ""
    parts = [f"## {TITLE}"]
    for number, climb in enumerate(climbs):
        where = f", {Path(climb.scene).stem}" if len(results.scenes) > 1 else ""
        parts.append(f"### {markdown.escape(climb.name + where)}")
        if len(climb.timed) > 1:
            parts.append(style.figure(out / f"ladder-{number}", f"{TITLE}: {climb.name}", ladder_figure.draw, climb))
        parts += [_table(climb), markdown.escape(account(climb))]
    table.write_lines(out / "ladder.csv", CSV_HEADER, (line for climb in climbs for line in _csv(climb)))
    return "\n\n".join([*parts, "All numbers: [ladder.csv](ladder.csv).", markdown.escape(CAPTION)])


def account(climb: Climb) -> str:
    """Returns in words how much of the measured factor the rungs account for, and what is left to the study's time."""
    if isinstance(climb.accounted, Missing):
        return f"The whole factor: {climb.accounted}."
    share = quantity.plain(100 * climb.accounted)
    text = f"First over last rung: {quantity.times(climb.whole)}. Product of the rungs: {quantity.times(climb.product)}"
    text += f", which accounts for {share} % of the factor, in logarithms."
    if isinstance(climb.published, Missing):
        return f"{text} The study's time: {climb.published}."
    published = quantity.seconds(climb.published.value)
    return f"{text} {ESTIMATE.format(published=published, rest=quantity.times(climb.rest))}"


def _table(climb: Climb) -> str:
    header = ["rung", "renderer", "what changes", "time of a frame", "factor", "peak RSS", "error", "lines"]
    return markdown.table(header, [_row(step) for step in climb.steps])


def _row(step: Step) -> list[str]:
    none = Missing("the run has no such cell")
    memory = step.cell.median("peak_bytes", "not reported") if step.cell else none
    error = step.cell.error() if step.cell else none
    factor = "" if step.factor is None else quantity.times(step.factor)
    lines = str(step.lines)
    numbers = [quantity.seconds(step.time), factor, quantity.size(memory), quantity.exact(error), lines]
    return [step.name, step.variant, step.changes, *numbers]


def _csv(climb: Climb) -> Iterator[tuple]:
    for step in climb.steps:
        factor = step.factor if isinstance(step.factor, Estimate) else None
        memory = step.cell.median("peak_bytes", "not reported") if step.cell else None
        error = step.cell.error() if step.cell else None
        yield (
            *(climb.name, climb.scene, step.name, step.variant, step.changes),
            *((step.time.value, step.time.low, step.time.high) if step.timed else (None,) * 3),
            *((factor.value, factor.low, factor.high) if factor else (None,) * 3),
            step.time.processes if step.timed else 0,
            memory.value if isinstance(memory, Estimate) else None,
            error if isinstance(error, float) else None,
            step.lines if isinstance(step.lines, int) else None,
            step.time.note if step.timed else str(step.time),
        )
