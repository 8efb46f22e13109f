"""Shows cells that several runs share side by side; nothing is pooled, each has its own interval and baseline."""

import json
from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.lines import Line2D

from harness.statistics import statistics
from harness.statistics.statistics import Estimate
from reports.accuracy import accuracy_columns
from reports.compare import compare
from reports.compare.hosts import Member
from reports.paper import markdown, quantity, style, table, thinning
from reports.paper.table import Column
from reports.run import ranking
from reports.run.cell import Cell, Missing
from reports.run.results import grouped, place_label

TITLE = "Side by side"
CAPTION = (
    "Cells that two runs or more share: the same scene and the same parameters of the picture. Each line shows one "
    "run: nothing is pooled. Ratios are to a baseline of the same run, so they compare machines. Pictures with the "
    "same digits are equal to the last bit (SHA-256)."
)
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#999999")
MOST = 16  # panels
ROW, HEAD = 0.16, 0.8  # inches

Group = list[tuple[Member, Cell]]


def common(members: list[Member]) -> tuple[list[Group], list[str]]:
    """Returns the cells that two runs or more share, and sentences on cells with the same name but another job."""
    every = [(member, cell) for member in members for cell in member.results.cells]
    by_name = grouped(every, lambda pair: (pair[1].scene, json.dumps(pair[1].swept, sort_keys=True), pair[1].variant))
    groups, others = [], []
    for group in by_name.values():
        (first, cell), alike = group[0], [group[0]]
        for member, other in group[1:]:
            why = compare.other_job(first.results, member.results, cell, other)
            if why:
                others.append(f"{cell.label}, {place_label(cell.place)}, in {first.name} and {member.name}: {why}")
            else:
                alike.append((member, other))
        if len(alike) > 1:
            groups.append(alike)
    return groups, others


def _columns(of: dict[Cell, Member]) -> list[Column]:
    def ratio(cell: Cell) -> Estimate | Missing | str:
        results = of[cell].results
        return ranking.ratio_to(results, cell, ranking.baseline(results, cell.scene))

    return [
        Column("machine", "machine", "", lambda cell: of[cell].host),
        Column("run", "run", "", lambda cell: of[cell].name),
        Column("steady frame", "steady_frame", "s", lambda cell: cell.steady),
        Column("÷ the baseline of its run", "ratio", "1", ratio, _ratio),
        *accuracy_columns.ERRORS,
        Column("picture", "picture", "", lambda cell: _digits(of[cell], cell)),
    ]


def _ratio(value) -> str:
    """Marks a ratio that the noise floor of its own run does not resolve (ranking.ratio_to)."""
    open_ = isinstance(value, Estimate) and value.low is not None and value.note == statistics.NOT_RESOLVED
    return quantity.text(value) + (f" {value.note}" if open_ else "")


def _digits(member: Member, cell: Cell) -> str | Missing:
    record = member.results.record(cell)
    if record is None or not record["picture"]:
        return Missing("no picture was stored")
    return record["picture"]["sha256"][:8]


def write(members: list[Member], out: Path) -> str:
    """Writes side-by-side-*.csv and figures per scene; returns the section, "" if runs have nothing in common."""
    groups, others = common(members)
    if not groups and not others:
        return ""
    of = {cell: member for group in groups for member, cell in group}
    scenes = grouped(groups, lambda group: group[0][1].scene)
    tables = [
        (scene, [cell for group in scene_groups for _, cell in group], _columns(of))
        for scene, scene_groups in scenes.items()
    ]
    parts = [table.section(out, "side-by-side", TITLE, tables, CAPTION)] if tables else [f"## {TITLE}"]
    for number, (scene, scene_groups) in enumerate(scenes.items()):
        drawable = _places(scene_groups)
        if drawable:
            shown = thinning.few(list(drawable), MOST)
            path = out / f"side-by-side-{number}-{markdown.slug(Path(scene).stem)}"
            drawn = {place: drawable[place] for place in shown}
            parts.append(style.figure(path, f"Side by side: {scene}", _draw, drawn, members))
            parts.append(thinning.note(len(shown), len(drawable), "places", "the table's CSV has all"))
    if others:
        few = thinning.few(others, table.MOST)
        parts += markdown.listed("Cells of the same name that are not comparable:", few)
        parts.append(thinning.note(len(few), len(others), "of these", "the reports of the runs have all"))
    return "\n\n".join(filter(None, parts))


def _places(groups: list[Group]) -> dict[tuple[str, str], list[Group]]:
    """Returns by place the groups with ranked cells of two runs or more."""
    ranked = [[(member, cell) for member, cell in group if not cell.unranked] for group in groups]
    return grouped((group for group in ranked if len(group) > 1), lambda group: group[0][1].place)


def _draw(places: dict[tuple[str, str], list[Group]], members: list[Member]):
    """Draws two panels for each place: times, and ratios to the baseline of the run."""
    colours = {member: COLOURS[number % len(COLOURS)] for number, member in enumerate(members)}
    heights = [sum(len(group) + 1 for group in groups) * ROW + HEAD for groups in places.values()]
    figure, panels = plt.subplots(
        len(places), 2, figsize=(7.2, sum(heights)), squeeze=False, height_ratios=heights, layout="constrained"
    )
    for (place, groups), axes in zip(places.items(), panels, strict=True):
        _panels(place, groups, axes, colours)
    there = [
        member for member in members if any(member is m for groups in places.values() for g in groups for m, _ in g)
    ]
    lines = [Line2D([], [], ls="", marker="o", color=colours[member]) for member in there]
    figure.legend(lines, [f"{member.host}: {member.name}" for member in there], loc="outside lower center", ncols=2)
    return figure


def _panels(place: tuple[str, str], groups: list[Group], axes, colours: dict[Member, str]) -> None:
    row, ticks, labels = 0, [], []
    for group in groups:
        ticks.append(row + (len(group) - 1) / 2)
        labels.append(group[0][1].label)
        for member, cell in group:
            base = ranking.baseline(member.results, cell.scene)
            for panel, value in zip(axes, (cell.steady, ranking.ratio_to(member.results, cell, base)), strict=True):
                _point(panel, row, value, colours[member])
            row += 1
        row += 1
    for panel, what in zip(axes, ("steady frame (s)", "time ÷ the baseline of its run"), strict=True):
        panel.set(xscale="log", xlabel=what, ylim=(row - 1.5, -0.5))
        style.log_ticks(panel.xaxis, narrow=True)
        panel.grid(axis="x", color="#CCCCCC")
    axes[0].set_yticks(ticks, labels)
    axes[1].set_yticks(ticks, [])
    axes[0].set_title(place_label(place), loc="left", fontweight="bold")


def _point(panel, row: int, value: Estimate | Missing | str, colour: str) -> None:
    if isinstance(value, Missing):
        return
    if isinstance(value, str):  # the baseline itself
        panel.plot(1, row, "o", mfc="white", mec=colour, ms=4)
        return
    if value.low is not None:
        panel.plot([value.low, value.high], [row, row], color=colour, lw=1.5)
    panel.plot(value.value, row, "o", color=colour, ms=4)
