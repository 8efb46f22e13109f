"""What the commands print: tables by rich on a terminal, plain lines elsewhere."""

import json
import statistics
import sys
from collections import Counter
from contextlib import contextmanager

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from harness.row import is_as_meant

console = Console(highlight=False, width=None if sys.stdout.isatty() else 160)


def show_plan(plan) -> None:
    """The cells of a plan, and what will not run and why."""
    from harness.repetition import unsupported

    table = Table("cell", "variant", "scene", "swept", "processes", "frames", "runs?", title=f"{len(plan.cells)} cells")
    for cell in plan.cells:
        swept = ", ".join(f"{key} = {value}" for key, value in cell.point.items())
        reason = cell.entry.unavailable or unsupported(cell.entry, cell.parameters, cell.needs)
        runs = f"no: {reason}" if reason else "yes"
        numbers = str(cell.processes), f"1 + {cell.parameters.frames}"
        table.add_row(*map(escape, (cell.key, cell.entry.name, cell.scene, swept, *numbers, runs)))
    console.print(table)


@contextmanager
def progress():
    """A function to call after each repetition: moves a bar on a terminal, prints a line for each elsewhere."""
    if not sys.stderr.isatty():
        yield lambda cell, record, done, total: print(_line(cell, record, done, total), file=sys.stderr, flush=True)
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    # Drawn between repetitions only: the harness is to sleep while a renderer is measured.
    with Progress(*columns, console=Console(stderr=True), auto_refresh=False) as bar:
        task = bar.add_task("starting", total=None)

        def tell(cell, record, done, total):
            bar.update(task, completed=done, total=total, description=escape(cell.label), refresh=True)
            if record["status"] != "ok" and record["repetition"] == 0:
                bar.console.print(escape(_line(cell, record, done, total)))

        yield tell


def _line(cell, record, done, total) -> str:
    if record["status"] != "ok":
        return f"[{done}/{total}] {cell.label}: {_verdict(record)}: {record['reason']}"
    frames = record["frames_s"]
    steady = f"{statistics.median(frames[1:]):.4g} s a frame" if len(frames) > 1 else "no steady frame"
    worst = (record["accuracy"] or {}).get("max_outside")
    error = "error unavailable" if worst is None else f"error {worst:.1e}"
    unranked = ", unranked" if record["unranked"] else ""
    load = ", load pass" if record["pass"] == "load" else ""
    return f"[{done}/{total}] {cell.label}{load}: first {frames[0]:.4g} s, {steady}, {error}{unranked}"


def _verdict(record) -> str:
    return "wrong as meant" if is_as_meant(record) else record["status"]


def show_summary(records: list[dict]) -> None:
    """How many repetitions ended how, with a reason for each kind of failure."""
    counts = Counter(_verdict(record) + (" (unranked)" if record["unranked"] else "") for record in records)
    print(", ".join(f"{count} {status}" for status, count in counts.most_common()) or "nothing to run")
    seen = {}
    for record in records:
        if record["status"] != "ok":
            seen.setdefault((record["variant"], _verdict(record), record["reason"]), record)
        if record["unranked"]:
            seen.setdefault((record["variant"], "unranked", record["unranked"]), record)
        for warning in record["warnings"]:
            seen.setdefault((record["variant"], "warning", warning), record)
    for variant, status, reason in seen:
        print(f"  {variant}: {status}: {reason}")


def show_renderers(entries: dict, as_json: bool) -> None:
    rows = [
        {
            "variant": name,
            "technology": entry.renderer.manifest.technology,
            "threads": entry.threads(),
            "device": entry.variant.device,
            "available": entry.unavailable is None,
            "reason": entry.unavailable,
            "simulated": entry.simulated,
            "exhibit": entry.variant.exhibit,
            "changes": entry.variant.changes,
            "features": list(entry.renderer.manifest.features),
            "folder": str(entry.renderer.folder),
        }
        for name, entry in entries.items()
    ]
    if as_json:
        print(json.dumps(rows, indent=1))
        return
    table = Table("variant", "technology", "threads", "available", "what it is")
    for row in rows:
        available = f"unavailable: {row['reason']}"
        if row["available"]:
            available = "simulated" if row["simulated"] else "yes"
        what = f"exhibit: {row['exhibit']}" if row["exhibit"] else row["changes"]
        table.add_row(*map(escape, (row["variant"], row["technology"], str(row["threads"]), available, what)))
    console.print(table)


def show_findings(findings: list, as_json: bool) -> None:
    if as_json:
        print(json.dumps([vars(finding) for finding in findings], indent=1))
        return
    table = Table("", "what", "found", "what to do")
    for finding in findings:
        mark = {"good": "good", "doubtful": "DOUBT", "unknown": "?"}[finding.verdict]
        table.add_row(*map(escape, (mark, finding.what, finding.found, finding.remedy)))
    console.print(table)


def show_kernels(rows, as_json: bool) -> int:
    """Print the rows of compile_report.py; the exit status: 1 if a compilation failed."""
    found = []
    for row in rows:
        found.append(row)
        if sys.stderr.isatty():
            print(f"\r{len(found)} kernels", end="", file=sys.stderr, flush=True)
    good = [row for row in found if row["status"] == "ok"]
    if as_json:
        print(json.dumps(found, indent=1))
    elif good:
        names = ("variant", "case", "precision", "memory", "walk", "target", "registers", "spilled", "local", "shared")
        table = Table(
            *names, "constant", "occupancy", "float64", title="Kernels: bytes a thread or block, occupancy in %"
        )
        for row in good:
            what = [row[name] for name in ("variant", "case", "precision", "scene_memory", "walk")]
            what.append(row["target"] + ("" if row["name"] == "render_pixels" else f" {row['name']}"))
            spilled = f"{row['spill_store_bytes']} + {row['spill_load_bytes']}"
            numbers = [row["registers"], spilled, row["local_bytes"], row["shared_bytes"], row["constant_bytes"]]
            share = "unknown" if row["occupancy"] is None else f"{100 * row['occupancy']:.0f}"
            table.add_row(*map(escape, what), *map(str, (*numbers, share, row["float64_instructions"])))
        console.print(table)
    if not as_json:
        for row in found:
            if row["status"] != "ok":
                what = f"{row['variant']}, {row['case']}, {row['precision']}"
                print(f"{what}: {row['status']}: {row['reason']}")
    return 1 if any(row["status"] == "failed" for row in found) else 0


def show_checks(checks) -> int:
    """Print each check as it ends; the exit status: 1 if one failed."""
    failed = 0
    for check in checks:
        print(
            f"{'ok  ' if check.passed else 'FAIL'}  {check.what}" + (f": {check.detail}" if check.detail else ""),
            flush=True,
        )
        failed += not check.passed
    print(f"checks failed: {failed}" if failed else "all checks passed")
    return 1 if failed else 0
