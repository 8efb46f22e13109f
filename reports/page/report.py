"""Writes the report of a run: tables, figures, report.md and report.html. The same run gives the same bytes."""

import re
from pathlib import Path

from harness.errors import UserError
from harness.system import output
from reports import page
from reports.accuracy import (
    accuracy_table,
    budget_table,
    chaos_figure,
    convergence_figure,
    cutoff_figure,
    front_figure,
    pareto_figure,
    precision_figure,
)
from reports.compare import versions
from reports.gpu import blocks_figure, gpu_figure, gpu_table, launch_figure, scene_memory_table
from reports.paper import markdown, table
from reports.pictures import fault_figure, gallery_figure, pictures_figure
from reports.run import results
from reports.scaling import complexity, hierarchy, limits, needs, roofline_figure, speedup, sweep_figure
from reports.stability import cost as stability_cost
from reports.stability import figure as stability_figure
from reports.stability import overview as stability_overview
from reports.stability import pictures as stability_pictures
from reports.stability import summary as stability_summary
from reports.stability import window as stability_window
from reports.study import ladder_table
from reports.summary import doubts, glance, provenance, summary
from reports.times import (
    counts_table,
    cpu_figure,
    cpu_table,
    energy_table,
    machine_table,
    memory_table,
    peers,
    startup_figure,
    startup_table,
    times_figure,
    times_table,
)
from reports.worth import worth

PARTS = (
    glance, versions, summary, doubts, machine_table, ladder_table, times_table, times_figure, sweep_figure, speedup,
    accuracy_table, front_figure, pareto_figure, budget_table, startup_table, startup_figure, memory_table, peers,
    pictures_figure, gallery_figure, worth, needs, cpu_table, cpu_figure, counts_table, energy_table, gpu_table,
    gpu_figure, roofline_figure, limits, scene_memory_table, launch_figure, blocks_figure, fault_figure, complexity,
    hierarchy, convergence_figure, cutoff_figure, precision_figure, chaos_figure,
)  # fmt: skip
# For a run that puts methods under stress, where nothing is ranked.
STABILITY = (
    glance, stability_summary, machine_table, stability_overview, stability_pictures, stability_window, stability_cost,
    stability_figure,
)  # fmt: skip


def write(run: Path, out: Path) -> Path:
    """Writes the report of the run in the folder `run` into the folder `out`; returns the path of its report.html."""
    write_loaded(results.load(Path(run)), Path(out))
    return Path(out) / page.NAME


def write_loaded(loaded: results.Results, out: Path) -> list[tuple[str, str]]:
    """Writes the report of a loaded run; returns its sections, each (name, Markdown)."""
    output.make_folder(out)
    table.write_frame(out / "repetitions.csv", loaded.repetitions)
    parts = STABILITY if loaded.facts.get("stability") else PARTS
    names = {part: part.__name__.rpartition(".")[2] for part in (*parts, provenance)}
    sections = [(name, text) for part, name in names.items() if (text := _section(part, name, loaded, out))]
    sections = _without_the_unavailable(sections)
    title = f"# {markdown.escape(loaded.facts['title'])}"
    text = "\n\n".join([title, *(text for _, text in sections)]) + "\n"
    output.text(out / "report.md", text)
    page.write(loaded, sections, out)
    return sections


def _without_the_unavailable(sections: list[tuple[str, str]]) -> list[tuple[str, str]]:
    """Returns sections without those that have only a reason, and a last one that lists these, by reason."""
    kept, reasons = [], {}
    for name, text in sections:
        parts = []
        for part in re.split(r"^(?=## )", text, flags=re.MULTILINE):
            if match := re.fullmatch(markdown.UNAVAILABLE, part):
                reasons.setdefault(match["reason"], []).append(match["title"])
            else:
                parts.append(part)
        kept += [(name, "".join(parts).rstrip("\n"))] * bool("".join(parts))
    lines = [f"{'; '.join(titles)}: unavailable: {reason}" for reason, titles in reasons.items()]
    return kept + [("unavailable", f"## Not in this run\n\n{markdown.bullets(lines)}")] * bool(lines)


def _section(part, name: str, loaded: results.Results, out: Path) -> str:
    """Writes one section. UserError for faults of a stored run that its schema does not catch (store/schema.py)."""
    try:
        return part.write(loaded, out)
    except (UserError, OSError):
        raise
    except Exception as error:
        why = f"{loaded.folder}: cannot write the section {name} of this run: {type(error).__name__}: {error}"
        remedy = "the run is damaged, or of another version of rayrace; else this is a bug of rayrace"
        raise UserError(why, remedy=remedy) from error
