"""Runs a plan on this machine: one repetition at a time, each judged and stored before the next begins."""

import hashlib
import sys
import tempfile
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from filelock import FileLock, Timeout

from harness import environment, events, job, judge, reference, repetition, store
from harness.builder import BuildError
from harness.experiment import Experiment
from harness.plan import Cell, Plan
from harness.registry import Entry

BAD = ("failed", "timeout", "killed", "wrong picture")
CPU_TOLERANCE = 0.10  # between wait4 and the measurer's series
PHASE_TOLERANCE = 0.02  # of the wall time that no phase covers


def host_lock() -> FileLock:
    """Held while measuring: two timed processes on one host disturb each other."""
    return FileLock(Path(tempfile.gettempdir()) / "rayrace-measuring.lock")


def run(
    experiment: Experiment,
    plan: Plan,
    known: dict[str, Entry],
    folder: Path,
    tell: Callable[[Cell, dict, int, int], None] = lambda *_: None,
) -> list[dict]:
    """Run every repetition of the plan into `folder`; the records. `tell(cell, record, done, all)` hears of each."""
    lock = host_lock()
    try:
        lock.acquire(timeout=0)
    except Timeout:
        print("another rayrace is measuring on this machine; waiting for it to end", file=sys.stderr)
        lock.acquire()
    run_store = store.Run(folder)
    records = []
    try:
        run_store.describe(
            title=experiment.title,
            experiment=experiment.model_dump(),
            started=_now(),
            command=sys.argv,
            environment=environment.capture(),
            cells=[_cell_facts(cell) for cell in plan.cells],
        )
        order = plan.order(experiment.seed)
        with tempfile.TemporaryDirectory(prefix="rayrace-caches-", ignore_cleanup_errors=True) as caches:
            bench = Bench(plan, known, run_store, Path(caches), experiment.measure.interval)
            for cell, number in order:
                record = bench.repeat(cell, number)
                run_store.append(record)
                records.append(record)
                tell(cell, record, len(records), len(order))
    finally:
        run_store.close()
        lock.release()
    return records


class Bench:
    """What the repetitions of one run share: references, pictures seen, caches of compiled code."""

    def __init__(self, plan: Plan, known: dict[str, Entry], run_store: store.Run, caches: Path, interval: float):
        self.plan, self.known, self.store = plan, known, run_store
        self.caches, self.interval = caches, interval
        self.references: dict[str, tuple] = {}  # (Reference or NoReference, its files)
        self.pictures: dict[str, str] = {}  # sha256 of the first picture of a cell

    def repeat(self, cell: Cell, number: int) -> dict:
        """Run one repetition of a cell; its record (store.py)."""
        stem = f"{cell.key}-{number}"
        series = self.store.folder / "series" / f"{stem}.csv"
        started = _now()
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
        record = {
            **_cell_facts(cell),
            "repetition": number,
            "started": started,
            **_measured(result, series),
            "build": self._build(cell),
            "picture": None,
            "accuracy": None,
        }
        if result.array is not None and result.status == "ok":
            record["picture"] = self._keep(cell, result.array, record["warnings"])
            self._judge(cell, result, record)
        record["status"], record["reason"] = result.status, result.reason
        return record

    def _build(self, cell: Cell) -> dict | None:
        try:
            renderer = cell.entry.renderer
            built = None if renderer.unavailable else renderer.build(cell.parameters, cell.needs)
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
            np.save(self.store.folder / name, picture)
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


def _cell_facts(cell: Cell) -> dict:
    entry = cell.entry
    return {
        "cell": cell.key,
        "variant": entry.name,
        "renderer": entry.renderer.manifest.name,
        "renderer_version": entry.renderer.version,
        "technology": entry.renderer.manifest.technology,
        "scene": cell.scene,
        "scene_version": cell.scene_version,
        "point": cell.point,
        "parameters": cell.parameters.values(),
        "needs": list(cell.needs),
    }


def _measured(result: repetition.Result, series: Path) -> dict:
    """The measured part of a record."""
    outcome, said = result.outcome, result.said
    empty = ("wall_s", "phases", "frames_s", "cpu", "memory", "rays", "used", "versions", "measurer", "series")
    record = {**dict.fromkeys(empty), "warnings": [] if result.status != "ok" else list(said.faults)}
    if outcome is None or outcome.failed:
        return record
    phases = cover(said, outcome.spawned, outcome.exited)
    record |= {
        "wall_s": outcome.wall_s,
        "phases": phases,
        "frames_s": [frame["end"] - frame["start"] for frame in said.frames],
        "cpu": {"user_s": outcome.user_s, "system_s": outcome.system_s, "series_s": last_cpu(series)},
        "memory": _memory(said, outcome),
        "rays": said.rays,
        "used": said.used,
        "versions": said.versions,
        "measurer": outcome.measurer,
        "series": f"series/{series.name}" if series.exists() else None,
    }
    missing = 1 - sum(end - start for _, start, end in phases) / outcome.wall_s
    if result.status == "ok" and abs(missing) > PHASE_TOLERANCE:
        record["warnings"].append(f"its phases leave {missing:.1%} of the wall time uncovered")
    doubt = _cpu_doubt(record["cpu"], outcome)
    if doubt:
        record["warnings"].append(doubt)
    return record


def cover(said: events.Said, spawned: float, exited: float) -> list[list]:
    """Phases as [name, start, end] since `spawned`, with `start` before the first and `exit` after the last.

    What lies between phases is left uncovered: the renderer must account for it.
    """
    marks = [[p["name"], p["start"] - spawned, p["end"] - spawned] for p in said.phases]
    wall = exited - spawned
    if not marks:
        return [["start", 0.0, wall]]
    return [["start", 0.0, marks[0][1]], *marks, ["exit", marks[-1][2], wall]]


def last_cpu(series: Path) -> float | None:
    """CPU time (s) in the last whole row of a series; None if it has none."""
    try:
        whole, _, _ = series.read_text(encoding="utf-8").rpartition("\n")
    except OSError:
        return None
    rows = whole.splitlines()[1:]
    return float(rows[-1].split(",")[1]) if rows else None


def _cpu_doubt(cpu: dict, outcome) -> str | None:
    """How wait4 and the series differ by more than the last, unseen tick explains."""
    if cpu["series_s"] is None or outcome.measurer is None:
        return None
    total = cpu["user_s"] + cpu["system_s"]
    unseen = outcome.measurer["interval_s"] * 2 * max(1, total / outcome.wall_s)
    if abs(total - cpu["series_s"]) > max(CPU_TOLERANCE * total, unseen):
        return f"CPU time: wait4 says {total:.3g} s, the measurer saw {cpu['series_s']:.3g} s"
    return None


def _memory(said: events.Said, outcome) -> dict:
    """The renderer's own peak where it tells it, else wait4's, which cannot be below the launcher's floor."""
    own = said.memory or {}
    if own.get("peak_bytes"):
        names = ("peak_bytes", "render_peak_bytes", "peak_virtual_bytes", "method")
        return {
            **{name: own.get(name) for name in names},
            "floor_bytes": None,
            "wait4_peak_bytes": outcome.wait4_peak_bytes,
        }
    return {
        "peak_bytes": outcome.wait4_peak_bytes,
        "render_peak_bytes": None,
        "peak_virtual_bytes": None,
        "method": "wait4",
        "floor_bytes": outcome.wait4_floor_bytes,
        "wait4_peak_bytes": outcome.wait4_peak_bytes,
    }


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
