"""The command line. Every command imports what it needs when it runs, so that --help is quick."""

import sys
from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(
    help="Races ray tracers and keeps an honest score: speed beside accuracy, each renderer a process of its own.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

RendererOption = Annotated[list[Path] | None, typer.Option("--renderer", help="Folder of a renderer, or of several.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON for a script.")]


def main() -> None:
    """The entry point: 0 good, 1 something that was measured failed, 2 wrong use, 130 stopped by Ctrl-C."""
    from harness.errors import UserError

    try:
        app()
    except UserError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(2)
    except OSError as error:
        print(f"error: {error.filename or 'system'}: {error.strerror}", file=sys.stderr)
        sys.exit(2)


@app.command()
def run(
    experiment: Annotated[Path, typer.Argument(help="Experiment file (.toml).", metavar="EXPERIMENT.toml")],
    out: Annotated[
        Path | None, typer.Option(help="Folder for the run; it must not exist yet. Default: a new one in results/.")
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Print the cells and stop.")] = False,
    only: Annotated[str, typer.Option(help="Only these of its renderers, by commas.")] = "",
    settings: Annotated[
        list[str] | None, typer.Option("--set", help="Put key=value over the file: image.depth=5.")
    ] = None,
    report: Annotated[bool, typer.Option("--report", help="Write the report of the run too.")] = False,
    renderer: RendererOption = None,
) -> None:
    """Run an experiment: every scene x renderer x swept value, in fresh interleaved processes."""
    from harness import experiment as experiments
    from harness import plan, race, registry, terminal
    from harness.errors import UserError

    asked = experiments.load(experiment, tuple(settings or ()))
    known = registry.entries(tuple(renderer or ()))
    chosen = tuple(name.strip() for name in only.split(",") if name.strip())
    planned = plan.make(asked, experiment, known, chosen)
    if dry_run:
        terminal.show_plan(planned)
        return
    if out is None:
        folder = race.new_folder(experiment.stem, Path("results"))
    else:
        folder = out
        try:
            folder.mkdir(parents=True)
        except FileExistsError:
            raise UserError(f"{out}: exists already; give --out another folder") from None
    try:
        with terminal.progress() as tell:
            records = race.run(asked, planned, known, folder, tell)
    except KeyboardInterrupt:
        print(f"stopped; what had finished is in {folder}", file=sys.stderr)
        raise
    terminal.show_summary(records)
    print(f"run: {folder}")
    if report:
        from reports import report as reports

        print(f"report: {reports.write(folder, folder / 'report')}")
    raise typer.Exit(1 if any(record["status"] in race.BAD for record in records) else 0)


@app.command()
def render(
    scene: Annotated[Path, typer.Argument(help="Scene file.")],
    variant: Annotated[
        str, typer.Option("-r", "--variant", help="Who renders. Default: the first available of the fastest.")
    ] = "",
    out: Annotated[Path, typer.Option("-o", "--out", help="Picture: .png, .exr or .npy.")] = Path("picture.png"),
    width: Annotated[int, typer.Option(min=1, max=65536)] = 512,
    height: Annotated[int, typer.Option(min=1, max=65536)] = 512,
    depth: Annotated[int, typer.Option(min=0, help="Largest order of a ray.")] = 10,
    shadows: Annotated[bool, typer.Option(help="Shadow feelers.")] = True,
    region: Annotated[str, typer.Option(help="Only the pixels x0,y0,x1,y1.")] = "",
    precision: Annotated[str, typer.Option(help="float64, float32, mp60.")] = "float64",
    threads: Annotated[int, typer.Option(min=0, help="0: as many as the variant runs by default.")] = 0,
    frames: Annotated[int, typer.Option(min=0, help="Frames after the first, to time.")] = 0,
    timeout: Annotated[float, typer.Option(min=0.01, help="Seconds.")] = 3600.0,
    renderer: RendererOption = None,
    as_json: JsonOption = False,
) -> None:
    """Render a scene to a picture."""
    from harness import single

    single.render(
        scene,
        variant,
        out,
        width,
        height,
        depth,
        shadows,
        region,
        precision,
        threads,
        frames,
        timeout,
        tuple(renderer or ()),
        as_json,
    )


@app.command()
def trace(
    scene: Annotated[Path, typer.Argument(help="Scene file.")],
    rays: Annotated[Path, typer.Argument(help="CSV with the header ox,oy,oz,dx,dy,dz.", metavar="RAYS.csv")],
    variant: Annotated[
        str, typer.Option("-r", "--variant", help="Who traces. Default: the first available of the fastest.")
    ] = "",
    out: Annotated[Path | None, typer.Option("-o", "--out", help="HITS.csv. Default: standard output.")] = None,
    precision: Annotated[str, typer.Option(help="float64, float32, mp60.")] = "float64",
    timeout: Annotated[float, typer.Option(min=0.01, help="Seconds.")] = 3600.0,
    renderer: RendererOption = None,
) -> None:
    """First hits of a list of rays: hit,t,px,py,pz,nx,ny,nz,object."""
    from harness import single

    single.trace(scene, rays, variant, out, precision, timeout, tuple(renderer or ()))


@app.command()
def report(
    run_folder: Annotated[Path, typer.Argument(help="Folder that `rayrace run` wrote.", metavar="RUN")],
    out: Annotated[Path | None, typer.Option("-o", "--out", help="Folder for the report. Default: RUN/report.")] = None,
) -> None:
    """Write every table and figure of a run, and report.md."""
    from reports import report as reports

    print(reports.write(run_folder, out or run_folder / "report"))


@app.command("list")
def list_renderers(renderer: RendererOption = None, as_json: JsonOption = False) -> None:
    """The renderers, and why one is unavailable."""
    from harness import registry, terminal

    terminal.show_renderers(registry.entries(tuple(renderer or ())), as_json)


@app.command()
def doctor(as_json: JsonOption = False) -> None:
    """Is this machine fit to measure? It changes nothing."""
    from harness import doctor as doctors
    from harness import terminal

    terminal.show_findings(doctors.examine(), as_json)


@app.command()
def check(
    path: Annotated[Path, typer.Argument(help="Folder of a renderer.")],
) -> None:
    """Contract test of a renderer: does it keep to renderers/README.md and SPEC.md?"""
    from harness import check as checks
    from harness import terminal

    raise typer.Exit(terminal.show_checks(checks.examine(path)))


@app.command()
def generate(
    name: Annotated[str, typer.Argument(help="comparison")],
    spheres: Annotated[int, typer.Option(min=0)] = 48,
    lights: Annotated[int, typer.Option(min=0)] = 3,
    out: Annotated[Path | None, typer.Option("-o", "--out", help="Scene file. Default: standard output.")] = None,
) -> None:
    """Generate a scene: the comparison scene for any number of spheres and lights."""
    from harness.errors import UserError
    from harness.scene.generate import comparison

    if name != "comparison":
        raise UserError(f'no generator "{name}"; known: comparison')
    text = comparison(spheres, lights)
    if out is None:
        print(text, end="")
    else:
        out.write_text(text, encoding="utf-8")


@app.command()
def schema() -> None:
    """Print the JSON Schema of an experiment file (experiments/schema.json)."""
    import json

    from harness.experiment import Experiment

    print(json.dumps(Experiment.model_json_schema(), indent=1))
