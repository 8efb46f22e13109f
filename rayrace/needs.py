"""The command `needs`: what a picture of a scene can do without, and what that costs and saves, in a table."""

import json
import sys
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from rayrace.options import (
    AdaptiveDepthOption,
    AdaptiveThresholdOption,
    CutoffOption,
    DepthOption,
    FeelersOption,
    FocalDistanceOption,
    GlossyRaysOption,
    HeightOption,
    JsonOption,
    LensRadiusOption,
    PrecisionOption,
    RendererOption,
    SamplesOption,
    SceneArgument,
    SeedOption,
    ShadowsOption,
    SppOption,
    VariantOption,
    WidthOption,
    choosing,
    unnamed,
)

CHARTS = (".png", ".svg", ".pdf")
FRAMES = 3  # steady frames of a process, of which the median counts


@choosing("sampler", "vector")
def needs(
    scene: SceneArgument,
    variant: VariantOption = "",
    width: WidthOption = None,
    height: HeightOption = None,
    depth: DepthOption = 10,
    shadows: ShadowsOption = True,
    samples: SamplesOption = 1,
    spp: SppOption = 0,
    adaptive_depth: AdaptiveDepthOption = 3,
    adaptive_threshold: AdaptiveThresholdOption = 0.1,
    lens_radius: LensRadiusOption = 0.0,
    focal_distance: FocalDistanceOption = 0.0,
    feelers: FeelersOption = 0,
    glossy_rays: GlossyRaysOption = 0,
    seed: SeedOption = 0,
    cutoff: CutoffOption = "0",
    precision: PrecisionOption = "float64",
    processes: Annotated[int, typer.Option(min=1, help="Of each model; an interval of times needs 5.")] = 5,
    timeout: Annotated[float, typer.Option(min=0.01, help="Seconds, of each process.")] = 600.0,
    out: Annotated[Path | None, typer.Option("-o", "--out", help="Chart of errors and times: .png, .svg, ..")] = None,
    sheet: Annotated[
        Path | None, typer.Option(help="Contact sheet: the picture without each thing, and its difference.")
    ] = None,
    within: Annotated[
        str,
        typer.Option(help="Find the smallest model with an RMSE of at most 1/255, 0.001, ..", metavar="ERROR"),
    ] = "",
    reduced: Annotated[
        Path | None,
        typer.Option(
            help="With --within: file for that model's scene, .txt. Default: reduced.txt, or a new name if it exists."
        ),
    ] = None,
    exhaustive: Annotated[
        bool, typer.Option("--exhaustive", help="With --within: try all combinations, too, where they are few.")
    ] = False,
    renderer: RendererOption = None,
    as_json: JsonOption = False,
    **chosen: str | None,
) -> None:
    """Leave out everything that a scene and its job model, one at a time: the error each makes, the time it saves."""
    from harness.errors import UserError
    from harness.judge.cache import Kept
    from harness.picture import picture
    from harness.process import repetition
    from harness.process.session import Sessions
    from harness.race.audit import LEAST_FRAME, Audit
    from harness.race.host import ThisHost
    from harness.reduction import leave_out
    from harness.renderer import registry
    from harness.renderer.builder import cache_folder
    from harness.scene import load
    from harness.scene.needs import needs as needs_of
    from harness.single import single, smallest, worth
    from rayrace import bundled, facts, terminal
    from rayrace.choice import error_limit

    for option, path in (("-o", out), ("--sheet", sheet)):
        if path and path.suffix not in CHARTS:
            raise UserError(f"{option} {path}: expected a chart, {', '.join(CHARTS)}")
        if path:
            picture.check_folder(path)
    if within and reduced and reduced.suffix != ".txt":
        raise UserError(f"--reduced {reduced}: expected a scene, .txt")
    if within:
        picture.check_folder(reduced or Path("reduced.txt"))
    if exhaustive and not within:
        raise UserError("--exhaustive: only with --within")
    limit = error_limit("--within", within) if within else None
    read = load(bundled.scene(scene))
    image = single.image(
        "", **single.size(read, width, height), depth=depth, shadows=shadows, samples=samples, spp=spp or None,
        adaptive_depth=adaptive_depth, adaptive_threshold=adaptive_threshold,
        lens_radius=lens_radius, focal_distance=focal_distance or None, feelers=feelers, glossy_rays=glossy_rays,
        seed=seed, cutoff=cutoff, precision=precision, **chosen,
    )  # fmt: skip
    job, entries = image.parameters(1, FRAMES, LEAST_FRAME), registry.entries(tuple(renderer or ()))
    entry = single.pick(variant, entries, job, needs_of(read, job))
    if why := entry.unavailable or repetition.unsupported(entry, job, needs_of(read, job)):
        raise UserError(f"{entry.name} cannot render this scene: {why}")
    job = replace(job, threads=entry.threads())
    full = worth.Model(read, job)
    host, greedy, best, times = ThisHost(terminal.say), None, None, []
    with host.exclusive(), Sessions() as sessions:
        true = worth.truth_of(full, entries, Kept(cache_folder("references")), sessions.run)
        listed, way = leave_out.leave_outs(read, job), worth.Way(entry, sessions.run, timeout, Audit(host), processes)
        if limit:
            worth.shoot_full(full, way)
            smallest.check(full, true, limit)
        study = worth.measure(full, true, way, listed)
        times += study.times
        if limit:
            search = smallest.Search(study, listed, limit, way)
            greedy = search.greedy()
            times += greedy.times
            if exhaustive:
                best = _exhaustive(search, greedy, times)
    warned = facts.warn(single.warned(read, job))
    worths = sorted(study.worths, key=lambda row: -row.error.get("rmse", -1.0))
    smallest_facts = {}
    if greedy:
        with nullcontext(reduced) if reduced else unnamed("reduced.txt", "--reduced") as path:
            smallest_facts = _smallest(greedy, best, limit, path, entry.name)
    _tell(study, worths, entry.name, smallest_facts, times, warned, as_json)
    if out:
        from reports.worth import figure

        figure.write(out, [row.record() for row in worths], study.error["rmse"])
    if sheet:
        from harness.store import record
        from reports.worth import sheet as sheets

        changed = [
            (row.name, record.rmse_of(row.error), row.picture) for row in worths if row.change and row.change.pixels > 0
        ]
        sheets.write(sheet, study.full.picture, changed)
    if any(row.unavailable and not row.unavailable.startswith("unsupported") for row in study.worths):
        raise typer.Exit(1)


def _exhaustive(search, greedy, times: list) -> dict:
    """What is told of a harness.single.smallest.Best, for JSON; {unavailable: reason} if there is none. times: to which
    those that it was timed by are added."""
    from harness.errors import UserError

    try:
        best = search.exhaustive(greedy)
    except UserError as why:
        return {"unavailable": str(why)}
    times += best.times
    ratio = {"ratio": best.over.value, "low": best.over.low, "high": best.over.high, "verdict": best.verdict}
    left = [leave_out.name for leave_out in best.left]
    facts = {"models": best.tried, "within": best.within, "left_out": left, "error": best.error}
    return {**facts, "greedy_over_best": ratio}


def _smallest(smallest, best, limit: float, path: Path, name: str) -> dict:
    """Writes the scene of a harness.single.smallest.Smallest; returns what is told of it, for JSON. best: of
    _exhaustive, or None."""
    from harness.scene import written
    from reports.run import command

    files = [str(file) for file in written.write(smallest.model.scene, path)]
    facts = {
        "limit": limit,
        "left_out": [leave_out.name for leave_out in smallest.left],
        "error": smallest.error,
        "time": {
            "ratio": smallest.time.value,
            "low": smallest.time.low,
            "high": smallest.time.high,
            "verdict": smallest.faster,
        },
        "memory_ratio": {"unavailable": "the peak is not known"} if smallest.memory is None else smallest.memory,
        "models_rendered": smallest.rendered,
        "files": files,
        "command": command.of_job(str(path), name, smallest.model.job, "reduced.npy"),
    }
    if best:
        facts["exhaustive"] = best
    return facts


def _tell(study, worths: list, name: str, told_smallest: dict, times: list, warned: list[str], as_json: bool) -> None:
    """Prints a harness.single.worth.Study, its worths in the order given, the smallest model, {} if none is asked for,
    and why the times (of harness.race.turns) are doubtful, as a run does."""
    from rich.markup import escape
    from rich.table import Table

    from harness.store import record
    from rayrace.terminal import console, show_reasons
    from reports.paper import quantity

    full = study.full
    seconds, doubts = full.times.seconds, list(dict.fromkeys(doubt for timing in times for doubt in timing.doubts))
    if as_json:
        full_facts = {"seconds": seconds.value, "low": seconds.low, "high": seconds.high, "error": study.error}
        full_facts |= {"processes": seconds.processes, "doubts": full.times.doubts}
        facts = {"truth": study.truth.maker, **study.truth.facts(), "noise_floor": study.floor.value}
        facts["doubts"] = doubts
        rows = [worth.record() for worth in worths]
        facts |= {"without": rows} | ({"smallest": told_smallest} if told_smallest else {})
        facts |= {"warnings": warned}
        print(json.dumps({"renderer": name, "job": full.job.values(), "full": full_facts, **facts}, indent=1))
        return
    error = {"truth": study.truth.maker, "against": "scene", **study.truth.facts(), **study.error}
    print(
        f"{name}, {full.job.width} x {full.job.height}: {quantity.seconds(seconds)} a frame; {record.error_of(error)}"
    )
    table = Table(title="Without it", title_justify="left")
    table.add_column("left out", overflow="fold")
    for head in (
        "pixels\nchanged",
        "largest\nchange",
        "RMSE\nfrom the truth",
        "FLIP",
        "time of\na frame",
        "peak\nmemory",
    ):
        table.add_column(head, justify="right")
    table.add_column("", overflow="fold")
    for worth in worths:
        table.add_row(escape(worth.name), *_cells(worth), escape(worth.verdict))
    console.print(table)
    print("time, memory: times those of the full model; in brackets the 95 % interval, ~ where it is not resolved")
    if study.floor.value is None:
        print(f"noise floor unavailable: {study.floor.reason}", file=sys.stderr)
    if told_smallest:
        _tell_smallest(told_smallest, study.error)
    show_reasons([record for timing in times for record in timing.records])


def _tell_smallest(smallest: dict, before: dict) -> None:
    """Prints the smallest model for people. before: `error` of the full model."""
    from harness.store import record

    rendered = f"of {smallest['models_rendered']} rendered"
    print(f"\nThe smallest model found with an RMSE of {smallest['limit']:.3g} or less, {rendered}:")
    print("".join(f"  without {name}\n" for name in smallest["left_out"]) or "  the full model\n", end="")
    rmse = f"RMSE {record.rmse_of(before)} before, {record.rmse_of(smallest['error'])} after"
    print(f"{rmse}; time {_ratio(smallest['time'])} times that of the full model")
    every = smallest.get("exhaustive")
    if every and "unavailable" in every:
        print(f"the best of all combinations unavailable: {every['unavailable']}")
    elif every:
        tried = f"{every['models']} combinations of what changes the picture"
        print(f"all {tried} were rendered, {every['within']} are within the limit")
        print(f"this one takes {_ratio(every['greedy_over_best'])} times as long as the quickest of them")
    print(f"scene: {', '.join(smallest['files'])}\n{smallest['command']}")


def _ratio(time: dict) -> str:
    interval = "" if time["low"] is None else f" [{time['low']:.2f}, {time['high']:.2f}]"
    return f"{'~' * (time['verdict'] == 'not resolved')}{time['ratio']:.2f}{interval}"


def _cells(worth) -> list[str]:
    """The numbers of a row, for people."""
    from harness.store import record

    if worth.unavailable:
        return [""] * 6
    time = f"{worth.time.value:.2f}" + (
        f" [{worth.time.low:.2f}, {worth.time.high:.2f}]" if worth.time.low is not None else ""
    )
    if worth.faster == "not resolved":
        time = f"~{time}"
    memory = "unavailable" if worth.memory is None else f"{worth.memory:.2f}"
    rmse = record.rmse_of(worth.error)
    return [
        record.percentage(worth.change.pixels),
        f"{worth.change.largest:.2g}",
        rmse,
        f"{worth.flip:.2g}",
        time.replace("[", "\\["),
        memory,
    ]
