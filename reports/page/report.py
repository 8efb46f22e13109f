"""The report of a run: every table and figure, and report.md and report.html that hold them. Same run, same bytes."""

from pathlib import Path

from harness.errors import UserError
from reports import page
from reports.accuracy import (
    accuracy_table,
    budget_table,
    chaos_figure,
    convergence_figure,
    cutoff_figure,
    pareto_figure,
    precision_figure,
)
from reports.gpu import blocks_figure, gpu_figure, gpu_table, launch_figure, scene_memory_table
from reports.page import doubts, provenance, summary
from reports.paper import markdown
from reports.pictures import fault_figure, gallery_figure, pictures_figure
from reports.run import results
from reports.scaling import complexity, hierarchy, limits, needs, roofline_figure
from reports.stability import cost as stability_cost
from reports.stability import figure as stability_figure
from reports.stability import overview as stability_overview
from reports.stability import pictures as stability_pictures
from reports.stability import summary as stability_summary
from reports.stability import window as stability_window
from reports.times import (
    cpu_figure,
    cpu_table,
    machine_table,
    memory_table,
    peers,
    startup_figure,
    startup_table,
    times_figure,
    times_table,
)

PARTS = (
    summary, doubts, machine_table, times_table, times_figure, accuracy_table, pareto_figure, budget_table,
    startup_table, startup_figure, memory_table, peers, pictures_figure, gallery_figure, needs, cpu_table, cpu_figure,
    gpu_table, gpu_figure, roofline_figure, limits, scene_memory_table, launch_figure, blocks_figure, fault_figure,
    complexity, hierarchy, convergence_figure, cutoff_figure, precision_figure, chaos_figure,
)  # fmt: skip
# Of a run that puts methods under stress, where nothing is ranked.
STABILITY = (
    stability_summary, machine_table, stability_overview, stability_pictures, stability_window, stability_cost,
    stability_figure,
)  # fmt: skip


def write(run: Path, out: Path) -> Path:
    """Write the report of the run in the folder `run` into the folder `out`; the path of its report.html."""
    write_loaded(results.load(Path(run)), Path(out))
    return Path(out) / page.NAME


def write_loaded(loaded: results.Results, out: Path) -> list[tuple[str, str]]:
    """The same of a run that is loaded; its sections, each (name, Markdown)."""
    out.mkdir(parents=True, exist_ok=True)
    loaded.repetitions.to_csv(out / "repetitions.csv", index=False, na_rep="NaN", lineterminator="\n")
    told = [(part, _section(part, loaded, out)) for part in (STABILITY if loaded.facts.get("stability") else PARTS)]
    rows = "Every repetition, one row each: [repetitions.csv](repetitions.csv)"
    told.append((provenance, f"{_section(provenance, loaded)}\n\n{rows}"))
    named = [(part.__name__.rpartition(".")[2], text) for part, text in told if text]
    title = f"# {markdown.escape(loaded.facts['title'])}"
    text = "\n\n".join([title, *(text for _, text in named)]) + "\n"
    (out / "report.md").write_text(text, encoding="utf-8")
    page.write(loaded, named, out)
    return named


def _section(part, loaded: results.Results, *out: Path) -> str:
    """Writes one section. UserError for faults of a stored run that its schema does not catch (store/schema.py)."""
    try:
        return part.write(loaded, *out)
    except (UserError, OSError):
        raise
    except Exception as error:
        name, why = part.__name__.rpartition(".")[2], f"{type(error).__name__}: {error}"
        remedy = "the run is damaged, or of another version of rayrace; else this is a bug of rayrace"
        raise UserError(
            f"{loaded.folder}: the section {name} cannot be made of this run: {why}", remedy=remedy
        ) from error
