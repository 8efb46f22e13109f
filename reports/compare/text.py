"""Prints a comparison: a table on a terminal, elsewhere a line per cell, or JSON for a script."""

import json
import sys
from dataclasses import asdict

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from reports.compare.compare import VERDICTS, Comparison, Row
from reports.paper import quantity

COLOURS = {"slower": "red", "faster": "green", "picture changed": "yellow"}


def show(comparison: Comparison) -> None:
    """Prints a comparison."""
    for line in heading(comparison):
        print(line)
    if not sys.stdout.isatty():
        for row in comparison.rows:
            print(line_of(row))
    else:
        _show_table(comparison)
    print(", ".join(f"{count} {verdict}" for verdict, count in comparison.counts.items()))


def heading(comparison: Comparison) -> list[str]:
    """Returns the lines that a reader needs before any ratio."""
    lines = [f"A: {comparison.a}", f"B: {comparison.b}"]
    if comparison.machine:
        lines.append("WARNING: the machines differ, so a ratio compares machines as much as renderers")
    lines += [f"  {line}" for line in comparison.machine]
    if comparison.others:
        lines += ["other differences:", *(f"  {line}" for line in comparison.others)]
    floors = [
        f"{which} {quantity.percentage(floor.value)}"
        if floor.value is not None
        else f"{which} unavailable: {floor.reason}"
        for which, floor in zip("AB", comparison.floors, strict=True)
    ]
    rule = "the larger one is used" if comparison.floor is not None else "only the intervals decide"
    drift = f"drift of the machine between them: {comparison.drift.source}"
    return [*lines, f"noise floor: {'; '.join(floors)}; {rule}", drift]


def line_of(row: Row) -> str:
    """Returns a row as plain text."""
    return ": ".join(filter(None, [_verdict(row), row.name, "; ".join(filter(None, [_times(row), *_notes(row)]))]))


def _verdict(row: Row) -> str:
    return f"{row.verdict} ({row.time})" if row.time not in ("", row.verdict) else row.verdict


def _times(row: Row) -> str:
    if row.ratio is None:
        return ""
    of = f" of {row.witness.name}, as {row.witness.why}" if row.witness.why else ""
    return f"{quantity.plain(row.a.value)} s -> {quantity.plain(row.b.value)} s, B / A = {quantity.text(row.ratio)}{of}"


def _notes(row: Row) -> list[str]:
    changed = row.picture is not None and not row.picture.same
    counts = row.counts.text if row.counts else ""
    return [note for note in (row.reason, f"picture: {row.picture}" if changed else "", counts) if note]


def _show_table(comparison: Comparison) -> None:
    """Prints a table; reasons and pictures go below it, as a column for them would be one word wide."""
    table = Table("cell", "A (s)", "B (s)", "B / A", "verdict")
    for row in comparison.rows:
        numbers = ["", "", ""]
        if row.ratio is not None:
            numbers = [quantity.plain(row.a.value), quantity.plain(row.b.value), quantity.text(row.ratio)]
        table.add_row(*map(escape, (row.name, *numbers, _verdict(row))), style=COLOURS.get(row.verdict))
    console = Console(highlight=False)
    console.print(table)
    for row in comparison.rows:
        for note in _notes(row):
            console.print(escape(f"{row.name}: {note}"))


def as_json(comparison: Comparison) -> str:
    """Returns a comparison as JSON; unknown numbers are null."""
    facts = {
        "a": str(comparison.a),
        "b": str(comparison.b),
        "machine": comparison.machine,
        "others": comparison.others,
        "floors": [{"value": floor.value, "reason": floor.reason} for floor in comparison.floors],
        "floor": comparison.floor,
        "drift": {"value": comparison.drift.value, "told": comparison.drift.source},
        "counts": {verdict: comparison.counts.get(verdict, 0) for verdict in VERDICTS},
        "cells": [{"verdict": row.verdict, **asdict(row)} for row in comparison.rows],
    }
    return json.dumps(facts, indent=1, allow_nan=False)
