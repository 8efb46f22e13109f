"""Reads the parts of a run, made by jobs on several hosts, as one run. Hosts are never pooled unasked."""

from collections.abc import Collection
from pathlib import Path

from harness.errors import UserError
from harness.store import confined, jobs
from harness.store.record import identity, key, lost


def hosts(parts: list[dict]) -> dict[str, dict]:
    """Returns the hosts of all parts with their environments, in the order in which they began, from each run.json."""
    found = {}
    for facts in sorted(parts, key=lambda facts: facts.get("started", "")):
        found.update(facts.get("hosts", {}))
    return found


def standing(records: list[dict]) -> dict[tuple, dict]:
    """Rows by key(): of two, the one that ran; of two that ran, the first."""
    rows: dict[tuple, dict] = {}
    for record in records:
        before = rows.get(key(record))
        if before is None or before["status"] == "unavailable":
            rows[key(record)] = record
    return rows


def merged(
    folder: Path, front: dict, parts: list[tuple[dict, list[dict]]], told: list[dict], wanted: Collection[str] | None
) -> tuple[dict, list[dict]]:
    """run.json and rows of the whole. front: its own run.json; parts: of each its run.json and its rows; told: the
    lines of jobs.jsonl; wanted: hosts, or None for all there are, of which there must be one.
    """
    found = hosts([facts for facts, _ in parts])
    if wanted is None and len(found) > 1:
        remedy = "choose with --host, or see all with: rayrace report"
        raise UserError(f"{folder}: of several hosts, which are not pooled: {', '.join(found)}", remedy=remedy)
    chosen = list(found) if wanted is None else [host for host in found if host in wanted]
    whole = len(chosen) == len(found)  # then what no host has run is told too
    rows = standing([record for _, mine in parts for record in mine])
    records = [record for record in rows.values() if record["host"] in chosen]
    if whole:
        records += _lost(folder, front, jobs.last(jobs.of(told)), rows)
    mine = [facts for facts, _ in parts if set(facts.get("hosts", ())) & set(chosen)]
    facts = {
        **front,
        "hosts": {host: found[host] for host in chosen},
        "environment": _together([found[host] for host in chosen]) or front["environment"],
        "pairs": [told["pair"] for told in mine if told.get("pair")],
        "cells": _cells(front["cells"], mine, records, whole),
    }
    ends = [told["ended"] for told in mine if "ended" in told]
    if mine and len(ends) == len(mine):
        facts["ended"] = max(ends, key=lambda end: end["at"])
    return facts, records


def turns(front: dict, batch: dict) -> list[tuple]:
    """key() of all that a batch runs but load passes; both as in run.json."""
    experiment, pair = front["experiment"], batch["pair"]

    def processes(variant: str) -> int:
        return (experiment["override"].get(variant) or {}).get("processes") or experiment["processes"]

    kinds = ("timed", "cold") if experiment["measure"].get("cold") else ("timed",)
    wanted = [(*name, kind) for name in batch["cells"] for kind in kinds] + ([(*pair, "pair")] if pair else [])
    return [(*name, number, kind) for *name, kind in wanted for number in range(processes(name[0]))]


def _lost(folder: Path, front: dict, last: dict[int, jobs.Job], rows: dict[tuple, dict]) -> list[dict]:
    """Rows of what jobs that have ended should have run, and nobody has."""
    cells = {identity(cell): cell for cell in front["cells"]}
    found = []
    for number, batch in enumerate(front["executor"]["batches"]):
        job = last.get(number)
        if job is None or not job.ended:
            continue
        reason = job.reason or f"job {job.name} ended without it"
        for missing in turns(front, batch):
            if missing not in rows:
                *name, repetition, kind = missing
                if tuple(name) not in cells:
                    raise UserError(
                        f"{'/'.join(name)} is a cell of a batch, and none of the run", file=folder / "run.json"
                    )
                found.append(lost(cells[tuple(name)], repetition, kind, job.status or "failed", reason, job.at))
    return found


def _cells(front: list[dict], parts: list[dict], records: list[dict], whole: bool) -> list[dict]:
    """The cells in the order of the plan, as those say who ran them: hosts differ in their number of threads."""
    ran = {record["cell"] for record in records}
    there = {identity(record) for record in records}
    known: dict[tuple, dict[str, dict]] = {}
    for told in parts:
        for cell in told["cells"]:
            if cell["cell"] in ran:
                known.setdefault(identity(cell), {})[cell["cell"]] = cell
    found = []
    for cell in front:
        if whole or identity(cell) in there:
            found += known.get(identity(cell), {cell["cell"]: cell}).values()
    return found


def _together(environments: list[dict]) -> dict | None:
    """Returns one environment for hosts that are pooled: the first's, under all their names."""
    if len(environments) < 2:
        return environments[0] if environments else None
    return {**environments[0], "host": ", ".join(dict.fromkeys(told["host"] for told in environments))}


def move(record: dict, prefix: str) -> None:
    """Put a prefix before the names of all files of a record."""
    for table, name in confined.files(record):
        table[name] = prefix + table[name]
