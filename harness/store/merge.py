"""Merges the parts of a run, which jobs made on several hosts, into one run. Hosts are pooled only on request."""

from collections.abc import Collection
from pathlib import Path

from harness.errors import UserError
from harness.store import confined, jobs, lines
from harness.store.record import identity, key, killed_by_others, lost


def hosts(parts: list[dict]) -> dict[str, dict]:
    """The hosts of all parts and their environments, in the order in which they began. parts: the run.json of each."""
    environments = {}
    for facts in sorted(parts, key=lambda facts: facts.get("started", "")):
        environments.update(facts.get("hosts", {}))
    return environments


def standing(records: list[dict]) -> dict[tuple, dict]:
    """The valid rows by key(). Of two rows of one repetition: the one that ran, and was not killed by others; of two
    such, the first."""
    rows: dict[tuple, dict] = {}
    for record in records:
        before = rows.get(key(record))
        if before is None or before["status"] == "unavailable" or killed_by_others(before):
            rows[key(record)] = record
    return rows


def merged(
    folder: Path,
    front: dict,
    parts: list[tuple[dict, list[dict]]],
    job_lines: list[dict],
    wanted: Collection[str] | None,
) -> tuple[dict, list[dict]]:
    """run.json and rows of the whole run. front: its own run.json; parts: run.json and rows of each; job_lines: those
    of jobs.jsonl; wanted: the hosts to pool, or None. UserError if None and there are several hosts.
    """
    environments = hosts([facts for facts, _ in parts])
    if wanted is None and len(environments) > 1:
        remedy = "choose with --host, or see all with: rayrace report"
        raise UserError(f"{folder}: of several hosts, which are not pooled: {', '.join(environments)}", remedy=remedy)
    chosen = list(environments) if wanted is None else [host for host in environments if host in wanted]
    whole = len(chosen) == len(environments)  # then lost rows, which no host has run, are included
    rows = standing([record for _, part_rows in parts for record in part_rows])
    records = [record for record in rows.values() if record["host"] in chosen]
    if whole:
        records += _lost(folder, front, jobs.Jobs(folder, job_lines).last(), rows)
    pooled = [facts for facts, _ in parts if set(facts.get("hosts", ())) & set(chosen)]
    facts = {
        **front,
        "hosts": {host: environments[host] for host in chosen},
        "environment": _together([environments[host] for host in chosen]) or front["environment"],
        "pairs": [part["pair"] for part in pooled if part.get("pair")],
        "cells": _cells(front["cells"], pooled, records, whole),
    }
    ends = [part["ended"] for part in pooled if "ended" in part]
    if pooled and len(ends) == len(pooled):
        facts["ended"] = max(ends, key=lambda end: end["at"])
    return facts, records


def turns(front: dict, batch: dict) -> list[tuple]:
    """key() of each repetition of a batch, without load passes. front: run.json; batch: of its executor.batches."""
    experiment, pair = front["experiment"], batch["pair"]

    def processes(variant: str) -> int:
        count = (experiment["override"].get(variant) or {}).get("processes") or experiment["processes"]
        if not isinstance(count, int) or not 0 <= count * len(batch["cells"]) <= lines.MOST:
            raise UserError(f"processes of {variant}: {count!r}, for {len(batch['cells'])} cells: no run has so many")
        return count

    kinds = ("timed", "cold") if experiment["measure"].get("cold") else ("timed",)
    wanted = [(*name, kind) for name in batch["cells"] for kind in kinds] + ([(*pair, "pair")] if pair else [])
    counts = [(*name, 0, "count") for name in batch["cells"] if experiment["measure"].get("count")]
    return [(*name, number, kind) for *name, kind in wanted for number in range(processes(name[0]))] + counts


def _lost(folder: Path, front: dict, last: dict[int, jobs.Job], rows: dict[tuple, dict]) -> list[dict]:
    """Rows of the repetitions that ended jobs should have run and no job has."""
    cells = {identity(cell): cell for cell in front["cells"]}
    lost_rows = []
    for number, batch in enumerate(front["executor"]["batches"]):
        job = last.get(number)
        if job is None or not job.ended:
            continue
        reason = job.reason or f"job {job.name} ended without it"
        for missing in turns(front, batch):
            if missing not in rows:
                *name, repetition, kind = missing
                if tuple(name) not in cells:
                    why = f"{'/'.join(name)} is a cell of a batch, but not of the run"
                    raise UserError(why, file=folder / "run.json")
                lost_rows.append(lost(cells[tuple(name)], repetition, kind, job.status or "failed", reason, job.at))
    return lost_rows


def _cells(front: list[dict], parts: list[dict], records: list[dict], whole: bool) -> list[dict]:
    """The cells in the order of the plan, as the parts that ran them describe them: hosts differ in threads."""
    ran = {record["cell"] for record in records}
    there = {identity(record) for record in records}
    described: dict[tuple, dict[str, dict]] = {}
    for part in parts:
        for cell in part["cells"]:
            if cell["cell"] in ran:
                described.setdefault(identity(cell), {})[cell["cell"]] = cell
    cells = []
    for cell in front:
        if whole or identity(cell) in there:
            cells += described.get(identity(cell), {cell["cell"]: cell}).values()
    return cells


def _together(environments: list[dict]) -> dict | None:
    """One environment for hosts that are pooled: the first host's, under all their names."""
    if len(environments) < 2:
        return environments[0] if environments else None
    return {**environments[0], "host": ", ".join(dict.fromkeys(environment["host"] for environment in environments))}


def move(record: dict, prefix: str) -> None:
    """Puts `prefix` before all file names of a record."""
    for table, name in confined.files(record):
        table[name] = prefix + table[name]
