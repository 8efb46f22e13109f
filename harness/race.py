"""Runs a plan on this machine: one repetition at a time, each judged and stored before the next begins."""

import hashlib
import math
import sys
import tempfile
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from filelock import FileLock, Timeout

from harness import environment, gpu_use, job, judge, load_pass, reference, repetition, resume, row, store, trouble
from harness.builder import BuildError
from harness.experiment import Experiment
from harness.plan import Cell, Plan
from harness.registry import Entry


def host_lock() -> FileLock:
    """Held while measuring: two timed processes on one host disturb each other."""
    return FileLock(Path(tempfile.gettempdir()) / "rayrace-measuring.lock")


def run(
    experiment: Experiment,
    plan: Plan,
    known: dict[str, Entry],
    folder: Path,
    tell: Callable[[Cell, dict, int, int], None] = lambda *_: None,
    resumed: bool = False,
    budget: float = math.inf,
) -> list[dict]:
    """Run every repetition of the plan into `folder`; the records. `tell(cell, record, done, all)` hears of each.

    resumed: the folder is of a run that was cut off; only what it lacks is run (resume.py). budget: seconds after which
    nothing more is begun; as all cells have their turn before any has its second, what there is is a thinner study.
    """
    lock = host_lock()
    try:
        lock.acquire(timeout=0)
    except Timeout:
        print("another rayrace is measuring on this machine; waiting for it to end", file=sys.stderr)
        lock.acquire()
    facts = {
        "title": experiment.title,
        "experiment": experiment.model_dump(),
        "started": _now(),
        "command": sys.argv,
        "environment": environment.capture(),
        "cells": [row.facts(cell) for cell in plan.cells],
    }
    records = []
    if resumed:
        facts, records = _go_on(facts, *resume.check(folder, plan))
    run_store = store.Run(folder)
    try:
        run_store.describe(**facts)
        there = {(record["cell"], record["repetition"], record["pass"]) for record in records}
        order = [(cell, n) for cell, n in plan.order(experiment.seed) if (cell.key, n, "timed") not in there]
        total = len(records) + len(order)
        with tempfile.TemporaryDirectory(prefix="rayrace-caches-", ignore_cleanup_errors=True) as caches:
            bench = Bench(plan, known, run_store, Path(caches), experiment.measure.interval)
            for record in records:
                if record["picture"]:
                    bench.pictures.setdefault(record["cell"], record["picture"]["sha256"])
            end = time.monotonic() + budget
            for cell, number in order:
                if time.monotonic() >= end:
                    return records
                record = bench.repeat(cell, number)
                run_store.append(record)
                records.append(record)
                tell(cell, record, len(records), total)
            more = load_pass.cells(plan, records, experiment.measure.gpu_load)
            more = [cell for cell in more if (cell.key, 0, "load") not in there]
            for cell in more:
                record = bench.repeat(cell, 0, "load")
                run_store.append(record)
                records.append(record)
                tell(cell, record, len(records), total + len(more))
    finally:
        run_store.close()
        lock.release()
    return records


def _go_on(now: dict, before: dict, records: list[dict]) -> tuple[dict, list[dict]]:
    """What run.json says after a run is taken up again, and the rows that it has."""
    known = {cell["cell"] for cell in before["cells"]}
    again = {name: now[name] for name in ("started", "command", "experiment")}
    return {
        **{name: value for name, value in before.items() if name != "format"},
        "cells": [*before["cells"], *(cell for cell in now["cells"] if cell["cell"] not in known)],
        "resumed": [*before.get("resumed", []), again],
    }, records


class Bench:
    """What the repetitions of one run share: references, pictures seen, caches of compiled code."""

    def __init__(self, plan: Plan, known: dict[str, Entry], run_store: store.Run, caches: Path, interval: float):
        self.plan, self.known, self.store = plan, known, run_store
        self.caches, self.interval = caches, interval
        self.references: dict[str, tuple] = {}  # (Reference or NoReference, its files)
        self.pictures: dict[str, str] = {}  # sha256 of the first picture of a cell

    def repeat(self, cell: Cell, number: int, kind: str = "timed") -> dict:
        """Run one repetition of a cell, for the timed or the load pass; its record (store.py)."""
        stem = f"{cell.key}-{number}" if kind == "timed" else f"{cell.key}-{kind}-{number}"
        series = self.store.folder / "series" / f"{stem}.csv"
        started, before = _now(), trouble.look()
        result = repetition.run(
            cell.entry,
            self.plan.arrays[cell.scene_version],
            cell.parameters,
            cell.needs,
            timeout=cell.timeout,
            series=series,
            interval=self.interval,
            cache=self.caches / cell.key,
            log=self.store.folder / "logs" / stem,
        )
        disturbed = trouble.between(before, trouble.look())
        record = {
            **row.facts(cell),
            "repetition": number,
            "started": started,
            "shapes": job.count_shapes(self.plan.arrays[cell.scene_version]),
            "unranked": row.unranked(cell.entry, result.said),
            "pass": kind,
            **row.measured(result, series),
            "disturbed": disturbed,
            "gpu": _gpu(cell.entry, result, series),
            "build": self._build(cell),
            "picture": None,
            "accuracy": None,
        }
        if record["wall_s"] is not None:
            record["warnings"] += trouble.doubts(disturbed, record["wall_s"])
        if result.array is not None and result.status == "ok":
            record["picture"] = self._keep(cell, result.array, record["warnings"])
            self._judge(cell, result, record)
        record["status"], record["reason"] = result.status, result.reason
        return record

    def _build(self, cell: Cell) -> dict | None:
        try:
            built = None if cell.entry.unavailable else cell.entry.renderer.build(cell.parameters, cell.needs)
        except BuildError:
            return None
        if built is None:
            return None
        return {"seconds": built.seconds, "compiler": built.compiler, "command": list(built.command)}

    def _keep(self, cell: Cell, picture: np.ndarray, warnings: list[str]) -> dict:
        """Store the first picture of a cell; later ones must have the same bytes."""
        digest = hashlib.sha256(np.ascontiguousarray(picture).tobytes()).hexdigest()
        name = f"pictures/{cell.key}.npy"
        if self.pictures.setdefault(cell.key, digest) != digest:
            warnings.append("the picture is not the same as in the first repetition")
            name = f"pictures/{cell.key}-{digest[:8]}.npy"
        if not (self.store.folder / name).exists():
            store.save_whole(self.store.folder / name, picture)
        return {"file": name, "sha256": digest}

    def _judge(self, cell: Cell, result: repetition.Result, record: dict) -> None:
        found, files = self._reference(cell)
        if isinstance(found, reference.NoReference):
            record["accuracy"] = {"unavailable": found.reason}
            wrong = judge.not_finite(result.array)
        else:
            precision = cell.parameters.precision
            external = cell.entry.renderer.manifest.external
            verdict = judge.judge(result.array, found.picture, found.mask, precision, external)
            record["accuracy"] = {"reference": found.maker, **files, **verdict.record()}
            wrong = verdict.wrong
            if not external:  # others count other things
                wrong = wrong or judge.compare_rays(result.said.rays, found.rays, precision)
        if wrong:
            result.status, result.reason = "wrong picture", wrong

    def _reference(self, cell: Cell):
        """The reference for a cell and its files, made when first asked for and kept in the run."""
        maker = reference.choose(cell.entry, self.known, cell.parameters, cell.needs)
        if maker is None:
            return reference.NoReference("no other renderer here can make this picture"), {}
        arrays = self.plan.arrays[cell.scene_version]
        wanted = cell.parameters.picture()
        key = job.fingerprint(arrays, wanted, maker.name, maker.renderer.version)
        if key not in self.references:
            found = reference.make(maker, arrays, cell.parameters, cell.needs, self.caches / f"{maker.name}.reference")
            files = {}
            if isinstance(found, reference.Reference):
                files = {f"{name}_file": f"pictures/{key}.{name}.npy" for name in ("reference", "mask")}
                np.save(self.store.folder / files["reference_file"], found.picture)
                np.save(self.store.folder / files["mask_file"], found.mask)
            self.references[key] = found, files
        return self.references[key]


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds")


def _gpu(entry: Entry, result: repetition.Result, series: Path) -> dict | None:
    """What the GPU did, of a variant that runs on one."""
    if entry.variant.device != "cuda":
        return None
    if result.outcome is None or result.outcome.failed:
        return gpu_use.unavailable(result.reason)
    if row.simulated(entry, result.said):
        return gpu_use.unavailable(row.SIMULATED)
    return gpu_use.use(result.said, result.outcome, series)


def new_folder(title: str, parent: Path) -> Path:
    """A folder of its own for a new run: the time, and the experiment's name."""
    stamp = time.strftime("%Y%m%d-%H%M%S")
    for extra in ("", *(f"-{n}" for n in range(2, 100))):
        folder = parent / f"{stamp}-{title}{extra}"
        try:
            folder.mkdir(parents=True)
            return folder
        except FileExistsError:
            continue
    raise FileExistsError(f"{parent}/{stamp}-{title}")
