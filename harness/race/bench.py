"""Runs the repetitions of a run: starts each, judges it, and makes its row."""

import hashlib
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

import numpy as np

from harness.judge import judge
from harness.plan.plan import Cell, Plan
from harness.process import repetition
from harness.process.session import Sessions
from harness.race import counting, energy_use, frames, gpu_use, row
from harness.race.audit import Audit, Measured, Task
from harness.race.host import Host
from harness.race.judging import Judging
from harness.renderer import events, job
from harness.renderer.builder import BuildError
from harness.renderer.registry import Entry
from harness.scene import doubts
from harness.store import record as rows
from harness.store import store
from harness.system import output

RAYS = "primary", "reflected", "transmitted", "shadow", "non_finite"


class Bench:
    """Shared by the repetitions of one run: their judge, the pictures seen, caches of compiled code."""

    def __init__(
        self,
        plan: Plan,
        entries: dict[str, Entry],
        run_store: store.Run,
        caches: Path,
        interval: float,
        host: Host,
        untimed: Sessions,
    ):
        """untimed: of host.untimed(), runs what is put under stress and the pictures that others are judged by."""
        self.plan, self.store = plan, run_store
        self.caches, self.host, self.untimed = caches, host, untimed
        self.judging = Judging(plan, entries, run_store.folder, caches, host, untimed)
        self.pictures: dict[str, str] = {}  # sha256 of the first picture of a cell
        self.audit, self.turns = Audit(host, interval), frames.Turns()

    def repeat(self, cell: Cell, number: int, kind: str = "timed") -> dict:
        """Run one repetition of a cell, for one of the passes of a run; its record (store.py)."""
        if kind == "count":
            return self._count(cell, number)
        stem = f"{cell.key}-{number}" if kind == "timed" else f"{cell.key}-{kind}-{number}"
        series = self.store.folder / "series" / f"{stem}.csv"
        output.clear(series)  # the measurer opens it by its name
        calibrated = self.plan.peaks and kind == "timed" and cell.refused is None
        peaks = self.host.peaks(cell.parameters.threads) if calibrated else None
        started, begun = timestamp(), self.host.clock()
        build = self._build(cell)  # what other programs do meanwhile disturbs nothing
        arrays = self.plan.arrays[cell.scene_version]
        # Cells under stress are many, and how long they compile is not asked.
        cache = self.caches / (f"{cell.entry.name}.stress" if cell.stressed else cell.key)
        parts = cell.entry, arrays, cell.parameters, cell.needs, cell.scene_version, cell.key
        run = self.untimed.run if cell.stressed else None
        if cell.without and cell.without.unavailable:
            run = partial(_refuse, *cell.without.unavailable.split(": ", 1))
        log = self.store.folder / "logs" / stem
        made = self.audit.measure(Task(*parts, cell.timeout, cell.limits), series, cache, log, kind == "cold", run)
        result = made.result
        record = {
            "host": self.store.host,
            **cell.facts(),
            "repetition": number,
            "started": started,
            "shapes": job.count_shapes(arrays),
            "scene_bytes": job.count_bytes(arrays),
            "lights": len(arrays["lights"]),
            "unranked": row.STRESSED if cell.stressed else row.unranked(cell.entry, result.said),
            "pass": kind,
            "peaks": peaks,
            **made.record,
            "gpu": _gpu(cell.entry, result, series),
            "energy": _energy(result, series),
            "build": build,
            "picture": None,
            "agreement": None,
            "error": None,
            "bound": None,
            "stability": None,
            "truth_s": None,
            "checked": None,
        }
        if cell.stressed and result.array is not None:  # one that is no valid answer too: it is counted, and fails
            record["stability"] = cell.stressed.record(result, cell.parameters)
            if cell.parameters.kind == "image":
                record["picture"] = self._keep(cell, result.array, record["warnings"])
            wrong = judge.broken(result)
            if wrong and result.status == "ok":
                result.status, result.reason = "wrong picture", wrong
        elif result.array is not None and result.status == "ok":
            if cell.parameters.kind == "rays":
                record["rays"] = {**dict.fromkeys(RAYS, 0), "primary": len(result.array)}
            record["picture"] = self._keep(cell, result.array, record["warnings"])
            if number == 0 and record["picture"] and cell.parameters.region is None and any(record["shapes"].values()):
                record["warnings"] += filter(None, [doubts.one_colour(result.array)])
            verdict = self.judging.judge(cell, result, record["picture"])
            record["agreement"], record["error"], record["bound"], wrong = verdict
            record["truth_s"] = self.judging.truth_s
            if wrong:
                result.status, result.reason = "wrong picture", wrong
        record["status"], record["reason"] = result.status, result.reason
        if result.status == "ok" and not cell.stressed:
            record["unranked"] = self.audit.unranked(made, record["unranked"])
            if kind == "timed" and record["unranked"] is None:
                self._check_frames(cell, number, made, record)
        record["took_s"] = self.host.clock() - begun
        return record

    def _check_frames(self, cell: Cell, number: int, made: Measured, record: dict) -> None:
        """Has a later frame of a good repetition checked, if it is the repetition's turn."""
        reason = frames.unchecked(cell.entry, cell.parameters)
        if not reason and cell.parameters.frames and self.turns.is_due(cell.key, number, cell.processes):
            choice = frames.choose(made.result, cell.parameters)
            run, fault = partial(self.audit.again, made), partial(self.judging.frame, cell)
            reason = frames.verdict(choice, made.result, cell.parameters, run, fault) or ""
            record["checked"] = choice.record()
        if reason.startswith(rows.UNCHECKED):
            record["checked"] = {"unavailable": reason.removeprefix(rows.UNCHECKED)}
            record["warnings"].append(reason)
        elif reason:
            record["unranked"] = reason

    def _count(self, cell: Cell, number: int) -> dict:
        """The record of a count, without anything that a table of times could take."""
        started, begun, arrays = timestamp(), self.host.clock(), self.plan.arrays[cell.scene_version]
        # A cache of its own: it may compile for another processor.
        cache = self.caches / f"{cell.key}.count"
        status, reason, counts = counting.count(cell, arrays, self.host, cache)
        return {
            **rows.blank(cell.facts(), number, "count", status, reason, started),
            "host": self.store.host,
            "shapes": job.count_shapes(arrays),
            "scene_bytes": job.count_bytes(arrays),
            "lights": len(arrays["lights"]),
            "unranked": row.unranked(cell.entry, events.Said()),
            "counts": counts,
            "operations": counting.operations(cell, arrays, self.host, cache),
            "took_s": self.host.clock() - begun,
        }

    def _build(self, cell: Cell) -> dict | None:
        try:
            built = None if cell.entry.unavailable else cell.entry.renderer.build(cell.parameters, cell.needs)
        except BuildError:
            return None
        if built is None:
            return None
        return {"seconds": built.seconds, "compiler": built.compiler, "command": list(built.command)}

    def _keep(self, cell: Cell, picture: np.ndarray, warnings: list[str]) -> dict | None:
        """Store the first picture of a cell; later ones must have the same bytes, hits too, which are not stored."""
        digest = hashlib.sha256(np.ascontiguousarray(picture).tobytes()).hexdigest()
        name = f"pictures/{cell.key}.npy"
        first = cell.key not in self.pictures
        if self.pictures.setdefault(cell.key, digest) != digest:
            what = "hits are" if cell.parameters.kind == "rays" else "picture is"
            warnings.append(f"the {what} not the same as in the first repetition")
            name = f"pictures/{cell.key}-{digest[:8]}.npy"
        if cell.parameters.kind == "rays":
            return None
        # A picture may be there whose row is missing, as the run was cut off between the two.
        if first or not (self.store.folder / name).exists():
            store.save_whole(self.store.folder / name, picture)
        return {"file": name, "sha256": digest}


def _refuse(status: str, reason: str, *_, **__) -> repetition.Result:
    """The Result of what nobody need try."""
    return repetition.Result(status, reason)


def _energy(result: repetition.Result, series: Path) -> dict | None:
    """Returns the energy of the processor in a repetition; None if nothing ran."""
    if result.outcome is None or result.outcome.failed:
        return None
    return energy_use.use(result.said, result.outcome, series)


def _gpu(entry: Entry, result: repetition.Result, series: Path) -> dict | None:
    """Returns the GPU use of a repetition, if its variant runs on one."""
    if entry.variant.device == "cpu":
        return None
    if result.outcome is None or result.outcome.failed:
        return gpu_use.unavailable(result.reason)
    if row.simulated(entry, result.said):
        return gpu_use.unavailable(row.SIMULATED)
    if row.is_processor(result.said.device):
        return gpu_use.unavailable("its device is a processor")
    return gpu_use.use(result.said, result.outcome, series)


def timestamp() -> str:
    """The time of day, ISO 8601."""
    return datetime.now(UTC).isoformat(timespec="microseconds")
