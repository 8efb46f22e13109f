"""What the commands print: tables on a terminal, plain lines elsewhere."""

import json
import math
import re
import sys
from collections import Counter

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from harness.store.record import is_as_meant, percentage
from harness.system import trouble

console = Console(highlight=False, width=None if sys.stdout.isatty() else 160)
MOST_ROWS = 200  # of cells that are shown one by one
MOST_SOURCES = 8  # of a prediction that are named


def say(text: str) -> None:
    """Prints a line to standard error at once."""
    print(text, file=sys.stderr, flush=True)


def show_experiments(titles: dict[str, str], as_json: bool) -> None:
    """The bundled experiments by name, with their titles."""
    if as_json:
        print(json.dumps(titles, indent=1))
        return
    table = Table("experiment", "title")
    for name, title in titles.items():
        table.add_row(escape(name), escape(title))
    console.print(table)
    print("rayrace run NAME runs one; rayrace experiments NAME copies it into this folder, to edit it")


def show_plan(forecast, budget: float, as_json: bool, jobs=None) -> None:
    """The cells of a plan, what will not run and why, how long it will take, and what of it fits in a budget (s).

    jobs: None, or what it asks of a cluster (campaign.Forecast).
    """
    if as_json:
        record = forecast.record(budget)
        print(json.dumps({**record, "cluster": jobs.record()} if jobs else record, indent=1))
        return
    plan = forecast.plan
    if len(plan.cells) <= MOST_ROWS:
        _show_cells(forecast.lines)
    else:
        _show_groups(forecast.lines)
    processes = f"{len(forecast.due)} of {len(forecast.order)} processes are due"
    sources = [f"{count} cells from {source}" for source, count in forecast.sources.items()]
    sources = [
        *sources[:MOST_SOURCES],
        *([f"and {len(sources) - MOST_SOURCES} more"] if len(sources) > MOST_SOURCES else []),
    ]
    prediction = f"{spell(forecast.seconds)} predicted ({'; '.join(sources)})" if sources else "no time estimate yet"
    print(f"{processes}; {prediction}" if forecast.due else "nothing is due")
    for variant, count in forecast.unknown.items():
        print(f"unknown for {count} cells: too few finished repetitions of {variant} on this machine")
    for variant, count in forecast.uncounted.items():
        print(f"unknown for the counts of {count} cells: no instructions of {variant} were counted on this machine yet")
    for constraint, count in plan.left_out:
        print(f'left out by where "{constraint}": {count} cells')
    pair = f"twice in every round, for the noise floor: {plan.pair.label}" if plan.pair else plan.pair_reason
    print(f"A/A pair: {pair}" if plan.pair else f"no A/A pair: {pair}")
    if jobs:
        print(jobs.text)
    if not math.isinf(budget):
        cut = forecast.cut(budget)
        fits = "unknown" if cut is None else f"{cut[0]} of {len(forecast.due)} processes, which makes"
        rounds = "" if cut is None else f" {cut[1]} whole rounds of {forecast.rounds}"
        print(f"in {spell(budget)} fit: {fits}{rounds}")


def _show_cells(lines: list) -> None:
    names = "cell", "variant", "scene", "swept", "processes", "frames", "runs?", "each"
    table = Table(*names, title=f"{len(lines)} cells")
    for line in lines:
        cell = line.cell
        swept = ", ".join(f"{key} = {value}" for key, value in cell.point.items())
        runs = f"no: {line.skipped}" if line.skipped else "yes"
        each = "" if line.skipped else spell(line.later and line.later.seconds)
        numbers = str(cell.processes), f"1 + {cell.parameters.frames}"
        table.add_row(*map(escape, (cell.key, cell.entry.name, cell.scene, swept, *numbers, runs, each)))
    console.print(table)


def _show_groups(lines: list) -> None:
    """Too many cells to be read one by one: a row for each variant and scene, and each reason not to run."""
    groups = {}
    for line in lines:
        groups.setdefault((line.cell.entry.name, line.cell.scene, line.skipped or ""), []).append(line)
    table = Table("variant", "scene", "cells", "swept", "due", "runs?", "in all", title=f"{len(lines)} cells")
    for (variant, scene, skipped), some in groups.items():
        values = {}
        for line in some:
            for key, value in line.cell.point.items():
                values.setdefault(key, {})[repr(value)] = None
        swept = ", ".join(f"{key} ({len(distinct)})" for key, distinct in values.items())
        seconds = [line.seconds for line in some]
        total = "" if skipped else spell(None if None in seconds else sum(seconds))
        due = str(sum(line.left for line in some))
        runs = f"no: {skipped}" if skipped else "yes"
        table.add_row(*map(escape, (variant, scene, str(len(some)), swept, due, runs, total)))
    console.print(table)


def spell(seconds: float | None) -> str:
    """A time for people."""
    if seconds is None:
        return "unknown"
    if seconds < 100:
        return f"{seconds:.2g} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 120 else f"{minutes // 60} h {minutes % 60} min"


def verdict(record) -> str:
    return "wrong as meant" if is_as_meant(record) else record["status"]


def _ok_first(counted: tuple[str, int]) -> tuple:
    return not counted[0].startswith("ok"), -counted[1], counted[0]


def show_summary(records: list[dict]) -> None:
    """How many repetitions ended how, with a reason for each kind of failure."""
    counts = Counter(verdict(record) + (" (unranked)" if record["unranked"] else "") for record in records)
    print(", ".join(f"{count} {status}" for status, count in sorted(counts.items(), key=_ok_first)) or "nothing to run")
    show_reasons(records)


def show_reasons(records: list[dict]) -> None:
    """Why repetitions failed, take no part in comparisons, or are doubtful: each reason once for a variant."""
    seen, cells = {}, {}
    for record in records:
        cells.setdefault((record["cell"], record["pass"]), []).append(record["warnings"])
    seldom = {key: trouble.seldom(warnings) for key, warnings in cells.items()}
    for record in records:
        if record["status"] != "ok":
            seen.setdefault((record["variant"], verdict(record), record["reason"]), record["reason"])
        if record["unranked"]:
            kind = re.sub(r"\d[\d.e+-]*", "#", record["unranked"])  # its numbers differ from row to row
            seen.setdefault((record["variant"], "unranked", kind), record["unranked"])
        for warning in record["warnings"]:
            if warning not in seldom[record["cell"], record["pass"]]:
                seen.setdefault((record["variant"], "warning", warning), warning)
    for (variant, status, _), reason in seen.items():
        print(f"  {variant}: {status}: {reason}")


def show_rows(rows: dict, as_json: bool) -> None:
    """The rows of the catalogue of failures: name, code, what fails, what grows."""
    if as_json:
        print(json.dumps({name: row.facts() for name, row in rows.items()}, indent=1))
        return
    table = Table("row", "code", "what fails", "under a growing")
    for name, row in rows.items():
        table.add_row(*map(escape, (name, row.code, row.title, row.stress)))
    console.print(table)
    print("rayrace stress ROW runs one; rayrace run stability runs all of them")


def show_row(row, as_json: bool) -> None:
    """The share of wrong answers of each method of a row (reports.stability), level by level."""
    curves = [
        {
            "variant": curve.variant,
            "precision": curve.precision,
            "method": curve.way.name,
            "naive": curve.way.naive,
            "points": [
                {
                    "level": point.level,
                    "share": point.share if point.answered else None,
                    "unavailable": None if point.answered else str(point.answers),
                }
                for point in curve.points
            ],
        }
        for curve in row.curves
    ]
    if as_json:
        print(json.dumps({**row.facts, "row": row.name, "curves": curves}, indent=1))
        return
    table = Table(title=f"{row.label}: {row.facts['title']}; share of wrong answers", title_justify="left")
    table.add_column(row.facts["stress"], justify="right")
    for curve in curves:
        table.add_column(f"{curve['variant']} {curve['precision']}\n{curve['method']}", justify="right")
    columns = [{point["level"]: point for point in curve["points"]} for curve in curves]
    for level in row.levels:
        cells = [points.get(level) for points in columns]
        shown = [
            "" if cell is None else "unavailable" if cell["unavailable"] else _share(cell["share"]) for cell in cells
        ]
        table.add_row(f"{level:g}", *shown)
    console.print(table)
    for reason in dict.fromkeys(point["unavailable"] for points in columns for point in points.values()):
        if reason:
            print(f"unavailable: {reason}")


def _share(share: float) -> str:
    return "0" if share == 0 else percentage(share)


def show_status(status, as_json: bool) -> None:
    """How far a run is, and each of its jobs."""
    if as_json:
        print(json.dumps(status.record(), indent=1))
        return
    counted = ", ".join(f"{count} {name}" for name, count in sorted(status.statuses.items(), key=_ok_first))
    print(f"{status.folder}: {status.facts['title']}")
    print(f"{status.done} of {status.all} repetitions are done" + (f": {counted}" if counted else ""))
    if status.lines:
        table = Table("batch", "job", "host", "cells", "done", "state")
        for line in status.lines:
            name, host = (line.job.name, line.host) if line.job else ("", "")
            done = f"{line.done} of {line.all}"
            table.add_row(*map(escape, (str(line.number), name, host, str(line.cells), done, line.said)))
        console.print(table)
    for text in status.unlike:
        print(f"hosts: {text}")
    if status.done < status.all and not status.live:
        print(f"go on with: rayrace run EXPERIMENT.toml --resume {status.folder}")


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
        rows = [
            {"verdict": finding.verdict, "what": finding.what, "found": finding.value, "remedy": finding.remedy}
            for finding in findings
        ]
        print(json.dumps(rows, indent=1))
        return
    table = Table("", "what", "found", "what to do")
    for finding in findings:
        mark = {"good": "good", "doubtful": "DOUBT", "unknown": "?"}[finding.verdict]
        table.add_row(*map(escape, (mark, finding.what, finding.value, finding.remedy)))
    console.print(table)
    print(verdict_of(findings))


def verdict_of(findings: list) -> str:
    """Returns what the findings of the doctor say together."""
    doubts, unknown = (
        [finding.what for finding in findings if finding.verdict == kind] for kind in ("doubtful", "unknown")
    )
    rest = f"{len(unknown)} of {len(findings)} are unknown"
    if doubts:
        return f"verdict: fit to measure with doubts: {', '.join(doubts)}; {rest}"
    return f"verdict: fit to measure; {rest}"


def show_kernels(rows, as_json: bool) -> int:
    """Print the rows of compile_report.py; the exit status: 1 if a compilation failed."""
    kernels = []
    for row in rows:
        kernels.append(row)
        if sys.stderr.isatty():
            print(f"\r{len(kernels)} kernels", end="", file=sys.stderr, flush=True)
    good = [row for row in kernels if row["status"] == "ok"]
    if as_json:
        print(json.dumps(kernels, indent=1))
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
        for row in kernels:
            if row["status"] != "ok":
                what = f"{row['variant']}, {row['case']}, {row['precision']}"
                print(f"{what}: {row['status']}: {row['reason']}")
    return 1 if any(row["status"] == "failed" for row in kernels) else 0


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
