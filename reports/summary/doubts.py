"""Writes the section on doubts: warnings of scenes and repetitions, and processes that waited for a core."""

import itertools
import re
from pathlib import Path

from harness.store.record import UNCHECKED
from harness.system import trouble
from reports.paper import markdown, quantity
from reports.run.results import Cell, Results, grouped, place
from reports.summary.summary import where

STARVED = 0.9  # of a core: a renderer that computes all the time, and gets its core, uses more
SHORTEST = 0.2  # s of a process; of a shorter one starting is a large part


def write(results: Results, _: Path | None = None) -> str:
    """Returns the section of the report."""
    warnings = kinds(results)
    text = markdown.bullets(warnings) if warnings else "No scene and no process has a warning."
    return f"## Measurement warnings\n\n{text}"


def kinds(results: Results) -> list[str]:
    """Returns the doubts as Markdown, one for each variant and kind."""
    return [*map(markdown.escape, results.facts.get("warnings", [])), *_warnings(results)]


def _warnings(results: Results) -> list[str]:
    """Returns an item for each variant and kind of doubt, with its places."""
    by_kind: dict[tuple[str, str], list[tuple[str, tuple]]] = {}
    for cell in results.cells:
        for kind, text in _doubts(results, cell):
            by_kind.setdefault((cell.variant, kind), []).append((text, cell.place))
    pairs = grouped((row for row in results.records if row.get("pass") == "pair"), lambda row: row["cell"])
    for records in pairs.values():
        for kind, text in _of_rows(records, "a second process of the A/A pair"):
            by_kind.setdefault((records[0]["variant"], kind), []).append((text, place(records[0])))
    return [
        f"{markdown.escape(variant)}: {markdown.escape(doubts[0][0])}"
        + (f", and {len(doubts) - 1} more like it" if len({text for text, _ in doubts}) > 1 else "")
        + f" ({where(results, [at for _, at in doubts])})"
        for (variant, _), doubts in by_kind.items()
    ]


def _doubts(results: Results, cell: Cell) -> list[tuple[str, str]]:
    """Returns the doubts about a cell, each with its kind: its text without numbers."""
    doubts = [(_kind(cell.lost), f"ok{cell.lost}")] if cell.lost and cell.status == "ok" else []
    doubts += _of_rows([results.records[row] for row in cell.timed])
    loaded = [results.records[row] for row in cell.loaded]
    doubts += _of_rows(loaded, "" if cell.as_meant else "a process of its load pass")
    if not cell.apart and _are_unchecked([results.records[row] for row in cell.counting]):
        text = f"{UNCHECKED}none of its processes had its turn before the run ended"
        doubts.append((text, text))
    share = _share_of_a_core(cell)
    if share is not None and share < STARVED and not cell.gpu:
        used = f"used {quantity.percentage(share)} of one core over its life"
        doubts.append(("starved", f"{used}: it waited, or other programs took the cores"))
    return doubts


def _are_unchecked(records: list[dict]) -> bool:
    """Returns whether no later frame of a cell was checked, though its renderer keeps contract 2."""
    return bool(records) and all(
        "checked" in record and record["checked"] is None and len(record["frames_s"] or []) > 1 for record in records
    )


def _of_rows(records: list[dict], what: str = "") -> list[tuple[str, str]]:
    """Returns the doubts about the repetitions of a cell; if `what` names them, also which of them are not ok."""
    warnings = [record["warnings"] for record in records]
    seldom = trouble.seldom(warnings)
    bad = [
        f"{what} is not ok: {record['status']}: {record['reason']}"
        for record in records
        if what and record["status"] != "ok"
    ]
    return [(_kind(text), text) for text in [*bad, *itertools.chain(*warnings)] if text not in seldom]


def _kind(text: str) -> str:
    return re.sub(r"[-+.\de]*\d", "#", text)


def _share_of_a_core(cell: Cell) -> float | None:
    """Returns CPU time over wall time of its repetitions that are long enough; None if there are none."""
    cpu, wall = cell.by_row("cpu_s"), cell.by_row("wall_s")
    long = [row for row in cpu if wall[row] > SHORTEST]
    return sum(cpu[row] for row in long) / sum(wall[row] for row in long) if long else None
