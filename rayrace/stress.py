"""The command `stress`: one row of the catalogue of failures, its answers in a table and its chart."""

import math
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated

import typer

from rayrace.options import JsonOption, RendererOption

FIRST = ("cpp", "cpp-threads", "numba", "numba-parallel", "numpy", "python")  # of which one is the default
BUNDLED = Path("stability")  # the experiment that has all rows with their methods


def stress(
    row: Annotated[str, typer.Argument(help="Row of the catalogue. Without it, the rows are listed.")] = "",
    variants: Annotated[
        list[str] | None,
        typer.Option("-r", "--variant", help="Who is put under stress, one or more. Default: cpp if it is available."),
    ] = None,
    precision: Annotated[
        list[str] | None, typer.Option(help="float32 or float64. Default: both.", metavar="NAME")
    ] = None,
    out: Annotated[Path | None, typer.Option("-o", "--out", help="Folder for the run. Default: in results/.")] = None,
    renderer: RendererOption = None,
    as_json: JsonOption = False,
) -> None:
    """Take one kind of failure from mild to extreme: where each method breaks, with a chart."""
    from harness import stress as catalogue
    from harness.errors import UserError
    from harness.experiment import experiment as experiments
    from harness.experiment.experiment import Stress
    from harness.plan import plan
    from harness.renderer import registry
    from harness.store.record import failed
    from rayrace import bundled, run, terminal

    rows = catalogue.rows()
    if not row:
        terminal.show_rows(rows, as_json)
        return
    if row not in rows:
        near = get_close_matches(row, rows, n=1)
        hint = f"did you mean {near[0]}?" if near else "rayrace stress lists them"
        raise UserError(f"{row}: no such row of the catalogue", remedy=hint)
    entries = registry.entries(tuple(renderer or ()))
    file = bundled.experiment(BUNDLED)
    experiment = experiments.load(file)
    changed = {
        "title": f"{row}: {rows[row].title}",
        "stress": tuple(table for table in experiment.stress if table.row == row) or (Stress(row=row),),
        "sweep": {**experiment.sweep, **({"precision": tuple(precision)} if precision else {})},
    }
    for variant in variants or FIRST:
        if variant not in entries:
            raise UserError(registry.unknown(variant, entries))
    why = {}
    for chosen in [tuple(variants)] if variants else [(name,) for name in FIRST]:
        made = experiment.model_copy(update={**changed, "renderers": chosen})
        try:
            planned = plan.make(made, file, entries)
        except plan.NoCells:
            why["the row is not for them (where of stability.toml)"] = chosen
            continue
        if any(cell.refused is None for cell in planned.cells):
            break
        why |= {cell.refused: chosen for cell in planned.cells}
    else:
        reasons = "; ".join(f"{', '.join(chosen)}: {reason}" for reason, chosen in why.items())
        raise UserError(f"{row} cannot run: {reasons}")
    folder = run.new_run(file.with_stem(row), out)
    records, _ = run.here(made, planned, entries, folder, False, math.inf)
    _tell(folder, as_json)
    raise typer.Exit(1 if any(map(failed, records)) else 0)


def _tell(folder: Path, as_json: bool) -> None:
    """Print the answers of a run of one row, after writing its chart into the run's report."""
    from rayrace import terminal
    from reports.page import several
    from reports.run import results
    from reports.stability import stability

    page = several.make([folder], folder / "report")
    (row,) = stability.rows(results.load(folder))
    terminal.show_row(row, as_json)
    chart = folder / "report" / f"stability-{row.name}.png"
    if not as_json:
        print(f"chart: {chart}" if chart.is_file() else "chart: unavailable, no cell has an answer")
        print(f"report: {page}")
