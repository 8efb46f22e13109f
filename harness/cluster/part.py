"""One job on a cluster: runs a batch of a run on its host, as a run of its own (store.py).

Before it measures, it checks that renderers, scenes and software are those of the submission. However it ends, finished
repetitions are stored, and end.json says why it ended.
"""

import contextlib
import errno
import json
import os
import shutil
import signal
import socket
import sys
import time
from pathlib import Path

from harness.cluster import batch
from harness.errors import UserError, of_system
from harness.experiment.experiment import Experiment
from harness.machine import software
from harness.plan import plan, resume
from harness.process import calibration, repetition
from harness.process.repetition import Result
from harness.race import race
from harness.race.bench import timestamp
from harness.race.host import ThisHost
from harness.race.stopping import Stopped, heed
from harness.renderer import registry
from harness.store import clean, confined, lines, merge, store
from harness.store.alone import locked
from harness.store.record import identity, killed_by_others
from harness.system import output

PARTS, END = "parts", "end.json"
LEAST = 1 << 20  # bytes: a disk with less room is full, as a job writes more
BLOCK, LONGEST = 4096, 1 << 20  # bytes of end.json, most of them blank; and at most
CHECKED = ("renderer_version", "scene_version", "needs")  # of a cell; its threads are the host's
SILENT = {"status": "silent", "reason": "it was killed before it could say why"}  # end.json until the job ends
TAKES = 3  # measurements of the host's peaks when the job begins
WARNED = (signal.SIGTERM, signal.SIGUSR2)  # sent by a scheduler before it kills
PATIENCE = 1.0  # s: longer than from the first signal of a scheduler to its last
STARTED = time.monotonic()  # of the job, nearly: this is imported as it begins


class Refused(Exception):
    """The run on this host would differ from the one that was submitted."""


def work(folder: str, number: int) -> None:
    """Runs the missing repetitions of batch `number` of the run in `folder`. SystemExit(1) unless all are done."""
    run = Path(folder)
    place = _place(run / PARTS / f"{number:04d}-{job_name()}")
    heed(WARNED, ": cancelled, pre-empted, or at the end of its time")  # in a Dask worker's own task it does nothing
    end = SILENT
    try:
        place.mkdir(parents=True)
        _say(place, end)  # reserves a block of the disk
        with locked(run / PARTS / f"{number:04d}.lock", lambda: UserError("another job runs the same batch")):
            left = _measure(run, number, place)
        late = f"its time was up with {left} repetitions to do"
        end = {"status": "timeout", "reason": late} if left else {"status": "", "reason": ""}
    except Refused as error:
        end = {"status": "unavailable", "reason": str(error)}
    except Stopped as error:
        end = {"status": "killed", "reason": str(error)}
    except UserError as error:
        end = {"status": "failed", "reason": str(error)}
    except OSError as error:
        end = {"status": "failed", "reason": of_system(error, place)}
        if error.errno == errno.ENOSPC or _is_full(place):  # numpy reports only how much it has written
            end["reason"] = f"no space is left on the disk of {place}; make room, and resume"
    finally:
        _say(place, end)
    if end["reason"]:
        raise SystemExit(1)


def _place(wanted: Path) -> Path:
    """`wanted` with a suffix, if it exists: a job that was queued again keeps its name."""
    names = [wanted, *(wanted.with_name(f"{wanted.name}-{again}") for again in range(2, 100))]
    return next((name for name in names if not name.exists()), wanted)


def _measure(run: Path, number: int, place: Path) -> int:
    """Runs the missing repetitions, as far as time allows; returns how many are still missing."""
    front, _ = store.read_front(run)
    executor = front["executor"]
    experiment = Experiment.model_validate_json(json.dumps(front["experiment"]))
    different = software.differences(executor["software"], software.here())
    if different:
        raise Refused("; ".join(different))
    entries = registry.entries(tuple(map(Path, executor["renderers"])))
    whole = plan.make(experiment, Path(executor["file"]), entries, tuple(executor["only"]))
    try:
        own_batch = batch.restored(executor["batches"][number], whole)
    except KeyError as error:
        raise Refused(f"the plan no longer has {error}: the experiment's file or its renderers have changed") from None
    different = resume.of_cells(front["cells"], own_batch.cells, CHECKED)
    if different:
        raise Refused("; ".join(different[:5]))
    there = finished(run, number)
    keys = {batch.name(cell): cell.key for cell in own_batch.cells}
    elsewhere = [{**record, "cell": keys[identity(record)]} for record in there]
    part = {"batch": number, "job": job_facts(), "speed": speed()}
    budget = executor["time"] - executor["warning"] - (time.monotonic() - STARTED)
    small = own_batch.of(whole)
    more = {"budget": budget, "host": JobHost(_log), "part": part, "elsewhere": elsewhere}
    records = race.run(experiment, small, entries, place, _print, **more)
    done = {(record["cell"], record["repetition"], record["pass"]) for record in [*elsewhere, *records]}
    return sum(
        (turn.cell.key, turn.number, turn.kind) not in done for turn in small.order(experiment.seed, experiment.order)
    )


class JobHost(ThisHost):
    """The host of a job. A scheduler signals all processes at once, and a renderer's end may be seen before this
    process handles its own signal; without the pause the renderer would count as failed."""

    @staticmethod
    def run(*job, **more) -> Result:
        result = repetition.run(*job, **more)
        if result.status in ("failed", "killed"):
            time.sleep(PATIENCE)
        return result


def finished(run: Path, number: int | None = None) -> list[dict]:
    """Rows that need not be run again, of the parts of batch `number` or of all batches. Without unavailable ones, as
    another host may have what one lacks, and those that others killed."""
    pattern = f"{PARTS}/{'*' if number is None else f'{number:04d}'}-*/run.json"
    rows = [record for path in sorted(run.glob(pattern)) for record in store.read(path.parent)[1]]
    standing = merge.standing(rows).values()
    return [record for record in standing if record["status"] != "unavailable" and not killed_by_others(record)]


def speed() -> dict:
    """Measures the peak rates of one thread of this host, TAKES times: {float64, bytes} as lists of rates a second, or
    {unavailable: reason}."""
    takes = [calibration.peaks(1) for _ in range(TAKES)]
    bad = next((take for take in takes if "unavailable" in take), None)
    return bad or {key: [take["one"][key] for take in takes] for key in ("float64", "bytes")}


def job_name() -> str:
    """The scheduler's name for the job of this process; without a scheduler, host and process number."""
    if "RAYRACE_JOB" in os.environ:  # executors/dask.py
        return os.environ["RAYRACE_JOB"]
    array, task = os.environ.get("SLURM_ARRAY_JOB_ID"), os.environ.get("SLURM_ARRAY_TASK_ID")
    if array and task:
        return f"{array}_{task}"
    return os.environ.get("SLURM_JOB_ID") or f"{socket.gethostname()}-{os.getpid()}"


def job_facts() -> dict:
    """For run.json: the job's name, partition, nodes and restarts, as far as Slurm reports them."""
    variables = {"partition": "SLURM_JOB_PARTITION", "nodes": "SLURM_JOB_NODELIST", "restarts": "SLURM_RESTART_COUNT"}
    facts = {key: os.environ[name] for key, name in variables.items() if name in os.environ}
    return {"name": job_name(), **facts}


def _log(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _print(cell, record, done, total, left_s) -> None:
    """Prints a line for a repetition to the log of the job."""
    turn = f"{record['pass']} {record['repetition']}"
    print(f"[{done}/{total}] {cell.label}, {turn}: {record['status']} {record['reason']}", flush=True)


def _say(place: Path, end: dict) -> None:
    """Writes end.json in place, as a full disk has no room for a new file; and a line to the log of the job."""
    record = {**end, "at": timestamp(), "job": job_facts(), "hostname": socket.gethostname()}
    text = lines.as_json(record).encode().ljust(BLOCK)
    try:
        with open(output.opened_in_place(place / END, os.O_WRONLY | os.O_CREAT), "wb") as file:
            file.write(text)
            os.fsync(file.fileno())
    except OSError as error:
        _log(f"{place / END}: {error.strerror}")
    if end is not SILENT:
        with contextlib.suppress(OSError):  # the log is full too
            _log(f"{place.name}: {end['status'] or 'done'} {end['reason']}")


def _is_full(place: Path) -> bool:
    try:
        return shutil.disk_usage(place).free < LEAST
    except OSError:
        return False


def ending(place: Path) -> dict | None:
    """end.json of the part in `place`; None if there is none, or it is incomplete."""
    try:
        end = clean.parsed(confined.content(place / END, LONGEST))
    except (OSError, ValueError, UserError):
        return None
    whole = isinstance(end, dict) and all(isinstance(end.get(name), str) for name in ("status", "reason", "hostname"))
    return end if whole else None
