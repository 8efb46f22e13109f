"""The command `history`: what each commit of a renderer makes of its instructions and times, and where they step."""

import json
import math
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from harness.system import output
from rayrace.options import JsonOption, RendererOption, percent


def history(
    variant: Annotated[str, typer.Argument(help="Variant of a renderer in a git repository.", metavar="VARIANT")],
    commits: Annotated[str, typer.Option(help="The span, as git takes it: v0.1..main.", metavar="A..B")],
    experiment: Annotated[
        Path, typer.Option(help="Experiment that each commit runs: a file, or a bundled one.", metavar="EXPERIMENT")
    ] = Path("history"),
    settings: Annotated[
        list[str] | None, typer.Option("--set", help="Put key=value over the file: image.depth=5.")
    ] = None,
    at_most: Annotated[
        int | None, typer.Option(min=2, help="Begin with so many commits, and halve the spans that hold a step.")
    ] = None,
    step: Annotated[float, typer.Option(parser=percent, help="The least change to find.", metavar="PERCENT")] = "1 %",  # type: ignore[assignment]
    out: Annotated[
        Path | None, typer.Option(help="Folder for its runs; it must not exist yet. Default: a new one in results/.")
    ] = None,
    resume: Annotated[
        Path | None, typer.Option(help="Go on with the history in this folder.", metavar="FOLDER")
    ] = None,
    renderer: RendererOption = None,
    as_json: JsonOption = False,
) -> None:
    """Build, count and time each commit that changes a renderer, beside its present version, and find the steps."""
    from harness.errors import UserError
    from harness.experiment import experiment as experiments
    from harness.renderer import registry, versions
    from rayrace import bundled
    from rayrace.run import new_run
    from reports.compare import history as reports
    from reports.paper import table

    file = bundled.experiment(experiment)
    entries = registry.entries(tuple(renderer or ()))
    if variant not in entries:
        raise UserError(f"{variant}: no such variant; `rayrace list` has them")
    definition = experiments.load(file, (*(settings or ()), f'renderers=["{variant}"]'), (), entries)
    all_of_them = versions.commits(commits, entries[variant])
    if resume and out:
        raise UserError("--resume goes on in the history's own folder; leave --out out")
    if resume and not resume.is_dir():
        raise UserError(f"--resume {resume}: no such folder")
    folder = resume or new_run(Path(f"history-{variant}"), out)
    commit_points: dict[int, list] = {}
    due = _spread(len(all_of_them), at_most)
    while due:
        for number in due:
            commit_points[number] = _measure(all_of_them[number], variant, definition, file, entries, folder)
            print(_line(all_of_them[number], commit_points[number]), file=sys.stderr, flush=True)
        due = halves(
            all_of_them,
            commit_points,
            [change for series in _places(commit_points).values() for change in _steps(series, step)],
        )
    points = _places(commit_points)
    steps = [change for series in points.values() for change in _steps(series, step)]
    rows = [point for series in points.values() for point in series]
    table.write_frame(folder / "history.csv", reports.table(rows))
    _charts(points, steps, folder)
    if as_json:
        shown = [{**asdict(change), "before": change.before.commit, "after": change.after.commit} for change in steps]
        print(json.dumps({"folder": str(folder), "points": json.loads(reports.table(rows).to_json(orient="records")),
                          "steps": shown}, indent=1))  # fmt: skip
        return
    for change in steps:
        print(change.text)
    if not steps:
        print(f"no step of {step:g} % or more in {len(commit_points)} of {len(all_of_them)} commits")
    print(f"history: {folder / 'history.csv'}, {folder / 'history.png'}")


def _spread(count: int, at_most: int | None) -> list[int]:
    """The numbers of `at_most` of `count` commits, the first and the last among them."""
    if at_most is None or at_most >= count:
        return list(range(count))
    return sorted({round(k * (count - 1) / (at_most - 1)) for k in range(at_most)})


def halves(commits: list, commit_points: dict[int, list], steps: list) -> list[int]:
    """The middle one of the commits that are not measured, between the two of each step."""
    number = {commit.hash: place for place, commit in enumerate(commits)}
    due = set()
    for step in steps:
        span = [n for n in range(number[step.before.commit] + 1, number[step.after.commit]) if n not in commit_points]
        due |= {span[len(span) // 2]} if span else set()
    return sorted(due)


def _measure(commit, variant: str, experiment, file: Path, entries, folder: Path) -> list:
    """Points of a commit: of each place of its run, or one with the reason why there is none."""
    from harness.errors import UserError
    from harness.plan import plan
    from harness.renderer import versions
    from rayrace.run import here
    from reports.compare import history as reports
    from reports.run.missing import Missing

    try:
        versions.others(commit.hash, [entries[variant]])
    except UserError as error:
        why = Missing(str(error))
        return [reports.Point(commit.hash, commit.date, commit.subject, "", why, why)]
    planned = plan.make(experiment, file, entries, (variant,), commit.hash)
    into = folder / commit.short
    begun = (into / "run.json").exists()
    output.make_folder(into)
    here(experiment, planned, entries, into, begun, math.inf)
    return reports.read(into, commit.hash, commit.date, commit.subject)


def _places(commit_points: dict[int, list]) -> dict[str, list]:
    """Points by place, in the order of the commits; those of no place, which were not measured, are at each."""
    ordered = [point for number in sorted(commit_points) for point in commit_points[number]]
    names = list(dict.fromkeys(point.place for point in ordered if point.place)) or [""]
    return {name: [point for point in ordered if point.place in (name, "")] for name in names}


def _steps(points: list, step: float) -> list:
    from reports.compare import history as reports

    return reports.steps(points, step / 100)


def _line(commit, points: list) -> str:
    """What was found of a commit, in a line."""
    from reports.paper import quantity
    from reports.run.missing import Missing

    parts = []
    for point in points:
        missing = isinstance(point.instructions, Missing)
        count = str(point.instructions) if missing else f"{point.instructions:.5g} instructions"
        time = str(point.time) if isinstance(point.time, Missing) else f"{quantity.text(point.time)} × the present time"
        parts.append(", ".join(dict.fromkeys((*([point.place] * (len(points) > 1)), count, time))))
    return f"{commit.short} {commit.subject}: " + "; ".join(parts)


def _charts(points: dict[str, list], steps: list, folder: Path) -> None:
    """Draws history.png, and history-2.png and so on of further places."""
    from reports.compare import history_figure
    from reports.paper import style

    for number, (place, series) in enumerate(points.items(), start=1):
        path = folder / ("history" if number == 1 else f"history-{number}")
        style.figure(path, "", history_figure.draw, series, [step for step in steps if step.place == place])
