"""The command line. Every command imports what it needs when it runs, so that --help is quick."""

import contextlib
import io
import os
import signal
import sys
from pathlib import Path
from typing import Annotated

import typer

from rayrace import history as cli_history
from rayrace import needs as cli_needs
from rayrace import picture
from rayrace import profile as cli_profile
from rayrace import run as cli_run
from rayrace import stress as cli_stress
from rayrace.once import Once
from rayrace.options import JsonOption, RendererOption, percent

HostOption = Annotated[str, typer.Option(help="Of a run on several hosts: the one that is meant.", metavar="NAME")]

app = typer.Typer(
    help="Races ray tracers and keeps an honest score: speed beside accuracy, each renderer a process of its own.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def main() -> None:
    """The entry point: 0 good, 1 something that was measured failed, 2 wrong use, or a gate cannot tell, 130 stopped by
    Ctrl-C."""
    from harness.errors import Failure, UserError, fit, of_system
    from harness.race import stopping

    _open_closed()
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="surrogateescape")  # names of files need not be Unicode
    stopping.heed((signal.SIGTERM, signal.SIGHUP))  # so that folders for a while are removed
    try:
        try:
            app()
        finally:
            _flush()
    except UserError as error:
        _end(str(error))
    except Failure as error:
        print(f"error: {fit(str(error))}", *filter(None, [error.output]), sep="\n", file=sys.stderr)
        sys.exit(1)
    except OSError as error:
        _end(of_system(error))
    except stopping.Stopped as error:
        stopping.end(error)


def _open_closed() -> None:
    """Opens the standard streams that are closed, which read and write nothing: a file would get their numbers."""
    for number, name, mode in ((0, "stdin", "r"), (1, "stdout", "w"), (2, "stderr", "w")):
        try:
            os.fstat(number)
        except OSError:
            null = os.open(os.devnull, os.O_RDWR)
            if null != number:
                os.dup2(null, number)
                os.close(null)
            setattr(sys, name, open(number, mode, closefd=False))  # noqa: SIM115


def _flush() -> None:
    """Writes what is left of the output. Ends if nobody reads it any more; OSError if it cannot be written."""
    try:
        sys.stderr.flush()
    except OSError:  # a terminal that is gone: the interpreter tries again, and ends with status 120
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
    try:
        sys.stdout.flush()
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # it tries again, and fails with a traceback
        if isinstance(error, BrokenPipeError):
            sys.exit(1)
        raise OSError(error.errno, error.strerror, "standard output") from None


def _end(text: str) -> None:
    with contextlib.suppress(OSError):  # the terminal may be gone
        print(f"error: {text}", file=sys.stderr, flush=True)
    sys.exit(2)


app.command(cls=Once)(cli_run.run)
app.command(cls=Once)(cli_run.status)
app.command(cls=Once)(cli_stress.stress)
app.command(cls=Once)(cli_needs.needs)
app.command(cls=Once)(cli_history.history)
app.command(cls=Once)(cli_profile.profile)
app.command(cls=Once)(picture.render)
app.command(cls=Once)(picture.trace)


def _version(flag: bool) -> None:
    if flag:
        from importlib.metadata import version

        print(f"rayrace {version('rayrace')}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_version, is_eager=True)
    ] = False,
) -> None:
    pass


@app.command(cls=Once)
def report(
    runs: Annotated[
        list[Path],
        typer.Argument(
            help="Folders that `rayrace run` wrote, or packed runs (.tar.xz); or one folder of such.", metavar="RUN .."
        ),
    ],
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="Folder for the report. Default, of one folder: RUN/report.")
    ] = None,
    pool: Annotated[
        bool, typer.Option("--pool", help="Take hosts of a cluster that are alike in all but their names as one.")
    ] = False,
    check: Annotated[
        bool, typer.Option("--check", help="Write nothing: make it again and tell what has other data; exit 1 if any.")
    ] = False,
    figures: Annotated[
        str,
        typer.Option(
            help="Size of figures and tables: page (HTML), thesis (150 mm; also PGF, for LaTeX), slides (300 mm), or a "
            "width in mm.",
            metavar="FORM",
        ),
    ] = "page",
) -> None:
    """Write every table and figure of a run, and report.html and report.md, which hold them.

    Of several runs each has its report, and one page has their machines side by side; nothing is pooled. Of a folder of
    runs, index.html has them all, the newest first; reports are made where they are missing or old.
    """
    from harness.errors import UserError
    from reports.page import index, several
    from reports.paper import form

    shape = form.parse(figures)
    if out is None and (len(runs) > 1 or runs[0].is_file()):
        raise UserError("name the folder of the report with -o FOLDER")
    folder = (out.resolve() if out.is_symlink() else out) if out else runs[0] / "report"
    if len(runs) == 1 and runs[0].is_dir() and not (runs[0] / "run.json").exists():
        if check:
            raise UserError(f"{runs[0]}: a folder of runs", remedy="--check takes runs")
        if shape.width:
            raise UserError(f"{runs[0]}: a folder of runs", remedy="--figures takes runs")
        print(index.make(runs[0], folder, pool, print))
        return
    if not check:
        print(several.make(runs, folder, pool, shape))
        if shape.smallest < form.LEAST:
            small = f"{shape.smallest:.2g} points; they have {form.LEAST:g} from {form.COLUMN:g} mm on"
            print(f"warning: the smallest letters of figures {shape.width:g} mm wide have {small}", file=sys.stderr)
        return
    said = several.check(runs, folder, pool)
    for line in said:
        print(line)
    print(f"{len(said)} of its figures and tables differ" if said else "every figure and table has the same data")
    raise typer.Exit(1 if said else 0)


@app.command(cls=Once)
def compare(
    run_a: Annotated[Path, typer.Argument(help="The run before, its folder or a packed one.", metavar="RUN_A")],
    run_b: Annotated[Path, typer.Argument(help="The run now.", metavar="RUN_B")],
    fail_slower: Annotated[
        float | None,
        typer.Option(
            parser=percent,
            help="Exit 1 if a cell is slower by more, or not ok now; 2 if these runs cannot tell.",
            metavar="PERCENT",
        ),
    ] = None,
    fail_more_instructions: Annotated[
        float | None,
        typer.Option(
            parser=percent,
            help="Exit 1 if a cell takes more instructions by more, or is not ok now; 2 if they cannot be compared.",
            metavar="PERCENT",
        ),
    ] = None,
    host: HostOption = "",
    as_json: JsonOption = False,
) -> None:
    """List what became faster or slower from one run to another, what is not resolved, and whose picture changed."""
    from harness.store import packed
    from rayrace import outcome
    from reports.compare import compare as comparisons
    from reports.compare import gate
    from reports.compare import text as compare_text

    with packed.opened(run_a) as a, packed.opened(run_b) as b:
        _must_have(host, a, b)
        comparison = comparisons.compare(a, b, host)
    limits = {gate.of_comparison: fail_slower, gate.of_instructions: fail_more_instructions}
    gates = [make(comparison, percent) for make, percent in limits.items() if percent is not None]
    if as_json:
        print(compare_text.as_json(comparison))
    else:
        compare_text.show(comparison)
    if gates:
        raise typer.Exit(outcome.conclude(gates, sys.stderr if as_json else None))


def _must_have(host: str, *folders: Path) -> None:
    """UserError if a host is named that none of the runs in the folders has."""
    from harness.errors import UserError
    from harness.store import store

    hosts = {
        name: environment["host"] for folder in folders if host for name, environment in store.hosts(folder).items()
    }
    if host and host not in {*hosts, *hosts.values()}:
        raise UserError(f"--host {host}: there are rows of {', '.join(hosts)}")


@app.command(cls=Once)
def export(
    run: Annotated[Path, typer.Argument(help="Folder that `rayrace run` wrote, or a packed run.", metavar="RUN")],
    form: Annotated[
        str,
        typer.Option(
            "--format", help="pyperf, hyperfine, github, budget, parquet or packed (.tar.xz).", metavar="NAME"
        ),
    ],
    out: Annotated[
        str, typer.Option("-o", "--out", help="File; -: standard output, of formats of text.", metavar="FILE")
    ] = "-",
    pictures: Annotated[
        bool,
        typer.Option(help="Of a packed run: with pictures and what renderers printed, or with rows and errors alone."),
    ] = True,
    truths: Annotated[
        bool,
        typer.Option(help="Of a packed run with pictures: also with the truths that errors are the distance from."),
    ] = True,
    what: Annotated[
        str,
        typer.Option(
            help="Of hyperfine: whole processes (process, the default) or their steady frames (frame).", metavar="NAME"
        ),
    ] = "",
    host: HostOption = "",
) -> None:
    """Write a run in the format of another tool, or in one file, which `report`, `compare` and `export` read too."""
    from harness.errors import UserError
    from harness.store import packed
    from reports import exporters

    for option, given in {"--no-pictures": pictures, "--no-truths": truths}.items():
        if form != "packed" and not given:
            raise UserError(f"{option}: only with --format packed; no other format has pictures")
    if form == "packed" and host:
        raise UserError("--host: not with --format packed, which has the rows of all hosts")
    with packed.opened(run) as folder:
        _must_have(host, folder)
        left_out = exporters.write(folder, form, None if out == "-" else Path(out), pictures, host, what, truths)
    print(f"exported: {exporters.HOLDS[form][exporters.chosen(form, what)]}", file=sys.stderr)
    for line in left_out:
        print(f"left out: {line}", file=sys.stderr)


@app.command("list", cls=Once)
def list_renderers(renderer: RendererOption = None, as_json: JsonOption = False) -> None:
    """The renderers, and why one is unavailable."""
    from harness.renderer import registry
    from rayrace import terminal

    terminal.show_renderers(registry.entries(tuple(renderer or ())), as_json)


@app.command(cls=Once)
def doctor(
    as_json: JsonOption = False,
    cuda: Annotated[
        bool, typer.Option("--cuda", help="What kernels take of a GPU: registers, memory, occupancy. Needs no GPU.")
    ] = False,
    scene: Annotated[list[Path] | None, typer.Option(help="With --cuda: a scene to compile for, not ours.")] = None,
    target: Annotated[
        list[str] | None, typer.Option(help="With --cuda: a compute capability. Default: sm_75, sm_80, sm_90, sm_100.")
    ] = None,
    renderer: RendererOption = None,
) -> None:
    """Is this machine fit to measure? It changes nothing."""
    from harness.errors import UserError
    from harness.machine import doctor as doctors
    from harness.process import scratch
    from rayrace import terminal

    if not cuda:
        if scene or target or renderer:
            raise UserError("--scene, --target, --renderer: only with --cuda")
        terminal.show_findings(doctors.examine(scratch.doubtful()), as_json)
        return
    from harness.contract import compile_report
    from harness.renderer import registry

    entries = compile_report.find(registry.entries(tuple(renderer or ())))
    rows = compile_report.examine(
        entries, compile_report.cases(tuple(scene or ())), tuple(target or compile_report.TARGETS)
    )
    raise typer.Exit(terminal.show_kernels(rows, as_json))


@app.command(cls=Once)
def check(
    path: Annotated[Path, typer.Argument(help="Folder of a renderer.")],
) -> None:
    """Contract test of a renderer: does it keep to renderers/README.md and SPEC.md?"""
    from harness.contract import check as checks
    from rayrace import terminal

    raise typer.Exit(terminal.show_checks(checks.examine(path)))


@app.command(cls=Once)
def experiments(
    name: Annotated[str, typer.Argument(help="The bundled experiment to copy. Without it, they are listed.")] = "",
    out: Annotated[Path | None, typer.Option("-o", "--out", help="Folder for the copy. Default: this one.")] = None,
    as_json: JsonOption = False,
) -> None:
    """List the bundled experiments, or copy one with its scenes into a folder, to edit and run it."""
    import json

    from harness.errors import UserError
    from rayrace import bundled, terminal

    if out and not name:
        raise UserError("-o: only with the name of an experiment, which is then copied")
    if name:
        copied = bundled.copy(name, out or Path())
        print(json.dumps([str(file) for file in copied]) if as_json else "\n".join(map(str, copied)))
    else:
        terminal.show_experiments(bundled.names(), as_json)


@app.command(cls=Once)
def generate(
    name: Annotated[str, typer.Argument(help="comparison, lattice, balls, tetra, knot or icosphere.")],
    spheres: Annotated[int | None, typer.Option(min=0, help="Of comparison. Default: 48.")] = None,
    lights: Annotated[int | None, typer.Option(min=0, help="Of comparison. Default: 3.")] = None,
    size: Annotated[
        int | None, typer.Option(min=0, help="Size factor. Default: 4 for balls, 6 for tetra, 2 for icosphere.")
    ] = None,
    material: Annotated[
        str | None, typer.Option(help="Of lattice: matte, mirror, perfect or glass. Default: perfect.", metavar="NAME")
    ] = None,
    radius: Annotated[float | None, typer.Option(min=0, help="Of lattice, spacing 1. Default: 0.4.")] = None,
    out: Annotated[Path | None, typer.Option("-o", "--out", help="Scene file. Default: standard output.")] = None,
) -> None:
    """Generate a scene: the comparison scene for any number of spheres and lights (.txt), a lattice of spheres that
    multiply errors (.txt), one of Haines' (.nff), the gallery's mesh, or a sphere of 20 * 4^size triangles (.obj)."""
    from harness.scene.generate.generated import written
    from harness.system import output

    text = written(name, out, spheres=spheres, lights=lights, size=size, material=material, radius=radius)
    if out is None:
        print(text, end="")
    else:
        output.text(out, text, own=False)


@app.command(cls=Once)
def schema() -> None:
    """Print the JSON Schema of an experiment file (experiments/schema.json)."""
    import json

    from harness.experiment.experiment import Experiment

    print(json.dumps(Experiment.model_json_schema(), indent=1))
