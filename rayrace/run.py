"""The commands `run` and `status`: an experiment, here or on a cluster, and its progress."""

import contextlib
import math
import shlex
import sys
from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

from rayrace.options import JsonOption, RendererOption, percent


def run(
    experiment: Annotated[
        Path, typer.Argument(help="Experiment file (.toml), or the name of a bundled one.", metavar="EXPERIMENT")
    ],
    out: Annotated[
        Path | None, typer.Option(help="Folder for the run; it must not exist yet. Default: a new one in results/.")
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Print the cells, what will not run, and the predicted time; and stop.")
    ] = False,
    only: Annotated[
        list[str] | None,
        typer.Option(
            help="Only these renderers, by commas or one by one, also others than the experiment lists.",
            metavar="NAME,..",
        ),
    ] = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", help="Put key=value over the file: image.depth=5.")
    ] = None,
    resume: Annotated[
        Path | None, typer.Option(help="Go on with the run in this folder: only what it lacks.", metavar="RUN")
    ] = None,
    against: Annotated[
        str,
        typer.Option(
            help="Compare each renderer with another version of it in the same run: in a folder, or at a commit.",
            metavar="FOLDER|COMMIT",
        ),
    ] = "",
    fail_slower: Annotated[
        float | None,
        typer.Option(
            parser=percent,
            help="With --against: exit 1 if a cell is slower by more, 2 if this run cannot tell.",
            metavar="PERCENT",
        ),
    ] = None,
    budget: Annotated[
        Path | None,
        typer.Option(
            help="Exit 1 if a cell takes more instructions than in this file (`rayrace export --format budget`), 2 if "
            "nothing can be compared."
        ),
    ] = None,
    max_minutes: Annotated[
        float | None,
        typer.Option(min=0, help="Begin nothing more after so long; every cell has its turn before a second."),
    ] = None,
    executor: Annotated[
        str,
        typer.Option(help="local; slurm or dask: jobs on a cluster, one to a host. Default: local.", metavar="NAME"),
    ] = "",
    detach: Annotated[
        bool, typer.Option("--detach", help="Submit jobs and stop; `rayrace status` tells of them.")
    ] = False,
    report: Annotated[bool, typer.Option("--report", help="Write the report of the run too.")] = False,
    renderer: RendererOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="With --dry-run: print JSON for a script.")] = False,
) -> None:
    """Run an experiment: every scene x renderer x swept value, in fresh interleaved processes."""
    from harness import executors
    from harness.cluster import campaign
    from harness.errors import UserError
    from harness.experiment import experiment as experiments
    from harness.plan import plan
    from harness.renderer import registry
    from harness.store import confined, store
    from rayrace import bundled, terminal

    typed, experiment = experiment, bundled.experiment(experiment)
    keys = Counter(setting.partition("=")[0].strip() for setting in settings or ())
    if twice := [key for key, count in keys.items() if count > 1]:
        raise UserError(f"--set {twice[0]}: is given {keys[twice[0]]} times", remedy="give each key once")
    folders = tuple(renderer or ())
    entries = registry.entries(folders)
    definition = experiments.load(experiment, tuple(settings or ()), _taking_part(entries, folders), entries)
    chosen = tuple(dict.fromkeys(name.strip() for text in only or () for name in text.split(",") if name.strip()))
    if fail_slower is not None and not against:
        raise UserError("--fail-slower: only with --against; `rayrace compare` has it for two runs")
    if budget and not definition.measure.count:
        raise UserError("--budget: the experiment counts no instructions", remedy="--set measure.count=true")
    limits = _limits(fail_slower, budget)
    planned = plan.make(definition, experiment, entries, chosen, against)
    for warning in planned.warnings:
        print(f"warning: {warning}", file=sys.stderr)
    seconds = math.inf if max_minutes is None else 60 * max_minutes
    if resume and out:
        raise UserError("--resume goes on in the run's own folder; leave --out out")
    if resume and resume.is_dir():
        confined.check_to_write(resume)
    before = store.executor(resume) if resume else None
    if before and executor and executor != before:
        raise UserError(f"--executor {executor}: {resume} was submitted through {before}; leave --executor out")
    name = before or executor or "local"
    if name not in executors.NAMES:
        raise UserError(f"--executor {name}: known: {', '.join(executors.NAMES)}")
    if name == "local" and detach:
        raise UserError("--detach: only of jobs on a cluster, with --executor")
    if name != "local" and definition.measure.until is not None:
        raise UserError("measure.until: of a run here; the jobs of a cluster do not know of each other's rounds")
    if name != "local" and against:
        raise UserError("--against: of a run here; jobs on several hosts are not compared")
    if detach and report:
        raise UserError("--report: not with --detach; write it with `rayrace report RUN` when the jobs have ended")
    if name != "local" and max_minutes is not None:
        raise UserError("--max-minutes: of a run here; jobs have the time of the experiment's [slurm]")
    if dry_run:
        from harness.plan import forecast

        made = forecast.make(planned, definition, results_folder(), None if before else resume)
        jobs = None
        if name != "local":
            batches = campaign.plan_batches(definition, planned, name, made.predictor)
            jobs = campaign.Forecast(campaign.table(definition, name), batches)
        terminal.show_plan(made, seconds, as_json, jobs)
        return
    if as_json:
        raise UserError("--json: only with --dry-run")
    folder = resume or new_run(experiment, out)
    options = {"--only": only, "--set": settings, "--renderer": renderer, "--against": [against] * bool(against)}
    options |= {"--budget": [budget] * bool(budget)}
    options |= {"--fail-slower": [] if fail_slower is None else [f"{fail_slower:g}"]}
    given = (str(word) for option, values in options.items() for value in values or () for word in (option, value))
    again = shlex.join(["rayrace", "run", str(typed), *given, "--resume", str(folder)])
    if name == "local":
        records, left = here(definition, planned, entries, folder, resume is not None, seconds, again, limits)
    else:
        front = campaign.Campaign(folder, definition, experiment, planned, name)
        records, left = _on_cluster(front, chosen, folders, resume is not None, detach, again)
    remainder = f"{left} repetitions are left; go on with: {again}" if left else ""
    _finish(folder, records, remainder, report, limits)


def _limits(slower: float | None, file: Path | None) -> dict | None:
    """What run.json says of the gate, {slower_percent, budget}, None without any; the budget is read now."""
    if slower is None and file is None:
        return None
    from reports.compare import budget

    return {"slower_percent": slower, "budget": budget.read(file).model_dump() if file else None}


def new_run(experiment: Path, out: Path | None) -> Path:
    """A new folder for a run of an experiment: `out`, or one in results/. UserError if `out` exists."""
    from harness.errors import UserError
    from harness.race import race

    if out is None:
        return race.new_folder(experiment.stem, results_folder(say=True))
    try:
        out.mkdir(parents=True)
    except FileExistsError:
        raise UserError(f"{out}: exists already; give --out another folder") from None
    return out


def _taking_part(entries, folders: tuple[Path, ...]) -> tuple[tuple[str, ...], ...]:
    """The variants of each renderer that the command line names, without exhibits: they take part in the run."""
    from harness.renderer import registry

    return tuple(
        tuple(name for name, entry in entries.items() if entry.renderer.folder == folder and not entry.variant.exhibit)
        for folder in registry.named(folders)
    )


def results_folder(say: bool = False) -> Path:
    """The folder for new runs: results/ here, or beside the renderer's folder that this is, or is in."""
    here = Path.cwd()
    inside = [place for place in (here, *here.parents) if (place / "renderer.toml").is_file()]
    if not inside:
        return Path("results")
    if say:
        print(f"{inside[-1]} is a renderer's folder; the run goes to {inside[-1].parent / 'results'}", file=sys.stderr)
    return inside[-1].parent / "results"


def here(
    experiment,
    planned,
    entries,
    folder: Path,
    resumed: bool,
    budget: float,
    again: str = "",
    limits: dict | None = None,
) -> tuple[list[dict], int]:
    """Run it in this process; its rows, and how many repetitions are left. again: the command that goes on with it.

    limits: of its gate, if it has one.
    """
    from harness.errors import UserError, of_system
    from harness.plan import predict
    from harness.race import enough, race, stopping
    from harness.race.host import ThisHost
    from rayrace import terminal
    from rayrace.progress import progress

    stopping.heed()
    order = planned.order(experiment.seed, experiment.order)
    try:
        with progress(planned.cells) as shown:
            earlier = predict.history(results_folder(), but=folder)
            arguments = {"tell": shown.tell, "begins": shown.begins, "kept": shown.kept, "host": ThisHost(terminal.say)}
            arguments["gate"] = limits
            records = race.run(
                experiment, planned, entries, folder, **arguments, resumed=resumed, budget=budget, earlier=earlier
            )
    except UserError:  # says itself what to do
        _leave(folder, resumed, len(order), again)
        raise
    except OSError as error:
        raise UserError(of_system(error, folder), remedy=_leave(folder, resumed, len(order), again)) from error
    except BaseException as error:
        left = _leave(folder, resumed, len(order), again)
        with contextlib.suppress(OSError):  # the terminal may be gone
            print(f"stopped; {left}", file=sys.stderr, flush=True)
        if isinstance(error, stopping.Stopped):
            stopping.end(error)
        raise
    done = {(record["cell"], record["repetition"], record["pass"]) for record in records}
    last = enough.rounds(experiment.measure.until, planned, records)
    due = [turn for turn in order if last is None or turn.number < last]
    return records, sum((turn.cell.key, turn.number, turn.kind) not in done for turn in due)


def _leave(folder: Path, resumed: bool, count: int, again: str) -> str:
    """What is kept of a run of `count` repetitions that ended early, and how to go on. The folder of a new run that did
    not begin is removed if nothing is in it."""
    from harness.errors import UserError
    from harness.store import alone, store

    if not resumed and folder.is_dir() and {path.name for path in folder.iterdir()} <= {alone.NAME}:
        with contextlib.suppress(OSError):
            (folder / alone.NAME).unlink(missing_ok=True)
            folder.rmdir()
        return "nothing was measured"
    begun, rows = (folder / "run.json").exists(), folder / "repetitions.jsonl"
    if not folder.is_dir() or (begun and not rows.exists()):
        return f"{folder} is gone, and what had finished with it"
    if not begun:
        return "nothing was measured"
    try:
        done = len(store.read(folder)[1])
    except UserError:  # damaged meanwhile
        done = rows.read_bytes().count(b"\n")
    kept = f"{done} of {count} repetitions are kept in {folder}"
    return f"{kept}; go on with: {again}" if again else kept


def _on_cluster(front, only, renderers, resumed: bool, detach: bool, again: str) -> tuple[list[dict], int]:
    """Submit what is missing of a Campaign, and follow it; its rows, and how many repetitions are left."""
    from harness.cluster import campaign
    from harness.plan import predict
    from harness.store import alone, likeness, store
    from rayrace.progress import progress

    def say(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    folder = front.folder
    with alone.only_one(folder):
        where = campaign.executor_of(folder, front.name, front.table)
        if resumed:
            front.go_on()
        else:
            predictor = predict.Predictor(predict.history(results_folder(), but=folder))
            batches = campaign.plan_batches(front.experiment, front.plan, front.name, predictor)
            say(campaign.Forecast(front.table, batches).text)
            front.begin(batches, only, renderers)
        front.submit(where, say)
        if detach:
            print(f"run: {folder}\nlook with: rayrace status {folder}; come back with: {again}")
            raise typer.Exit(0)
        try:
            with progress(front.plan.cells) as shown:
                front.follow(where, shown.tell, say)
        except KeyboardInterrupt:
            say(f"its jobs go on; come back with: {again}; end them with: rayrace status {folder} --cancel")
            raise
    for line in likeness.of_run(folder):
        say(f"hosts: {line}")
    _, records = store.read(folder, hosts=store.hosts(folder))
    return records, sum(map(len, front.missing().values()))


def _finish(folder: Path, records: list[dict], left: str, report: bool, limits: dict | None) -> None:
    """Say what came of it. Exit 1 if something failed that should not, or with the status of its gates. left: what is
    said if repetitions are left."""
    from harness.store import record
    from rayrace import outcome, terminal
    from rayrace.progress import unless_gone

    unless_gone()
    terminal.show_summary(records)
    outcome.show(folder, records)
    if left:
        print(left)
    print(f"run: {folder}")
    if report:
        from reports.page import several

        print(f"report: {several.make([folder], folder / 'report')}")
    status = outcome.compared(folder, limits)
    raise typer.Exit(int(any(map(record.failed, records))) if status is None else status)


def status(
    folder: Annotated[Path, typer.Argument(help="Folder of a run, here or on a cluster.", metavar="RUN")],
    cancel: Annotated[bool, typer.Option("--cancel", help="End its jobs; what has finished is kept.")] = False,
    as_json: JsonOption = False,
) -> None:
    """How far a run is: repetitions that are done, jobs that wait or run, and why others ended."""
    from harness.cluster import status as states
    from rayrace import terminal

    if cancel:
        count = states.cancel(folder)
        print(f"{count} jobs are cancelled" if count else "it has no jobs to cancel", file=sys.stderr)
    terminal.show_status(states.of(folder), as_json)
