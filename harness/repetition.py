"""One repetition: a variant does one job in a process of its own, and the record of it."""

import os
import shutil
import signal
import stat
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from harness import events, job, process
from harness.builder import BuildError, fill
from harness.job import Parameters
from harness.registry import Entry

UNSUPPORTED = 3  # exit status
# Parameters that a manifest names the values of.
METHODS = (
    *("precision", "walk", "accel", "kernel", "vector", "scene_memory", "floating_point"),
    *("sphere", "triangle", "slab", "merge", "offset", "fresnel", "phong", "renormalise", "glossy_weight"),
)


@dataclass
class Result:
    """What came of one process. `status` is "ok", or says what went wrong, with the reason."""

    status: str
    reason: str = ""
    outcome: process.Outcome | None = None
    said: events.Said = field(default_factory=events.Said)
    array: np.ndarray | None = None  # the picture, or the hits
    stderr: str = ""
    dropped: np.ndarray | None = None  # weight that was cut off, of each pixel (CUT-2), where there is a cut-off


def unsupported(entry: Entry, parameters: Parameters, needs: tuple[str, ...]) -> str | None:
    """None, or why the manifest says that the variant cannot do this job."""
    manifest = entry.renderer.manifest
    wanted = [*entry.renderer.given(parameters, needs), *(["rays"] if parameters.kind == "rays" else [])]
    if parameters.bounds() != (0, 0, parameters.width, parameters.height):
        wanted.append("region")
    missing = [name for name in wanted if name not in manifest.features]
    if missing:
        return f"does not support {', '.join(missing)}"
    for method in METHODS if "glossy" in needs else METHODS[:-1]:
        chosen, choices = getattr(parameters, method), entry.methods.get(method, (getattr(Parameters, method),))
        if method == "kernel" and "general" in choices:  # what can carry all can carry any
            continue
        if chosen not in choices:
            return f"has no {method} {chosen} (has {', '.join(choices)})"
    if entry.variant.threads == 1 and parameters.threads > 1:
        return "runs one thread"
    return None


def run(
    entry: Entry,
    arrays: dict[str, np.ndarray],
    parameters: Parameters,
    needs: tuple[str, ...],
    timeout: float = 600.0,
    series: Path | None = None,
    interval: float = 0.05,
    cache: Path | None = None,
    log: Path | None = None,
) -> Result:
    """Let `entry` do the job if its manifest says that it can; the Result. Never raises for what the renderer does.

    series: CSV file for the measurer, or None to start none. cache: folder for the renderer's compiled code.
    log: path stem; standard output and error are kept at log.stdout and log.stderr.
    """
    if entry.unavailable:
        return Result("unavailable", entry.unavailable)
    reason = unsupported(entry, parameters, needs)
    if reason:
        return Result("unsupported", reason)
    return start(entry, arrays, parameters, needs, timeout, series, interval, cache, log)


def start(entry, arrays, parameters, needs, timeout=600.0, series=None, interval=0.05, cache=None, log=None) -> Result:
    """`run` without asking the manifest first whether the renderer can do the job."""
    try:
        built = entry.renderer.build(parameters, needs)
    except BuildError as error:
        return Result("failed", f"its build failed: {error}")
    with tempfile.TemporaryDirectory(prefix="rayrace-", ignore_cleanup_errors=True) as scratch:
        here = Path(scratch)
        given = entry.renderer.given(parameters, needs)
        job.write(here / "job", arrays, parameters, given)
        for name in ("out", "neutral"):
            (here / name).mkdir()
        cache = cache or here / "cache"
        cache.mkdir(parents=True, exist_ok=True)
        places = {"folder": str(entry.renderer.folder), "python": sys.executable}
        if built:
            places["build"] = str(built.folder)
        command = [fill(word, places) for word in entry.variant.command]
        command += job.flags(here / "job", here / "out", entry.name, cache, parameters, given)
        stdout, stderr = here / "stdout", here / "stderr"
        outcome = process.run(command, here / "neutral", stdout, stderr, timeout, series, interval)
        result = _collect(outcome, here / "out", stdout, stderr, parameters, needs)
        if log:
            for path in (stdout, stderr):
                if path.exists():
                    shutil.copyfile(path, f"{log}.{path.name}")
    return result


def _collect(outcome, out: Path, stdout: Path, stderr: Path, parameters: Parameters, needs) -> Result:
    if outcome.failed:
        return Result("failed", outcome.failed)
    said = events.read(stdout)
    events.tidy(said, outcome.spawned, outcome.exited)
    with open(stderr, "rb") as file:
        file.seek(max(0, stderr.stat().st_size - 2**16))
        text = file.read().decode("utf-8", errors="replace").strip()
    result = Result("ok", "", outcome, said, None, text)
    last_line = text.splitlines()[-1] if text else ""
    why = said.error or events.words(last_line) or "it did not say why"
    if outcome.timed_out:
        result.status, result.reason = "timeout", f"killed after {outcome.wall_s:.3g} s"
    elif outcome.signal == signal.SIGKILL:
        result.status, result.reason = "killed", "by SIGKILL, perhaps for using too much memory (see dmesg)"
    elif outcome.signal is not None:
        result.status, result.reason = "failed", f"ended by {_signal(outcome.signal)}: {why}"
    elif outcome.code == UNSUPPORTED:
        result.status, result.reason = "unsupported", why
    elif outcome.code != 0:
        result.status, result.reason = "failed", f"exit {outcome.code}: {why}"
    else:
        fault = _incomplete(said, parameters)
        if fault is None:
            result.array, fault = _load(out, said, parameters)
        if fault is None and "cutoff" in needs:
            result.dropped, fault = _load_dropped(out, said, parameters)
        if fault:
            result.status, result.reason = "failed", fault
    return result


def _signal(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:  # a real-time signal
        return f"signal {number}"


def _incomplete(said: events.Said, parameters: Parameters) -> str | None:
    if said.faults:
        return said.faults[0]
    frames = [frame["index"] for frame in said.frames]
    if frames != list(range(parameters.frames + 1)):
        return f"reported frames {frames}, expected 0 to {parameters.frames}"
    return None


def _load(out: Path, said: events.Said, parameters: Parameters):
    """The array that the renderer returned, and what is wrong with it."""
    array, fault = read_array(out, said.output)
    if fault:
        return None, fault
    if array.dtype not in (np.float64, np.float32):
        return None, f"{said.output} holds {array.dtype}, expected float64 or float32"
    if parameters.kind == "image" and array.shape != parameters.shape():
        return None, f"{said.output} has shape {array.shape}, expected {parameters.shape()}"
    if parameters.kind == "rays" and (array.ndim != 2 or array.shape[1] != 8):
        return None, f"{said.output} has shape {array.shape}, expected (rays, 8)"
    if parameters.kind == "rays" and not _are_hits(array):
        return array, f"{said.output} holds a row that is neither a hit nor a miss"
    return array, None


def _load_dropped(out: Path, said: events.Said, parameters: Parameters):
    """The dropped weight of each pixel, and what is wrong with it."""
    if said.dropped is None:
        return None, "its output event names no array of dropped weights (CUT-2)"
    array, fault = read_array(out, said.dropped)
    if fault:
        return None, fault
    if array.dtype not in (np.float64, np.float32) or array.shape != parameters.shape()[:2]:
        return None, f"{said.dropped} holds {array.dtype} {array.shape}, expected floats {parameters.shape()[:2]}"
    if not (np.isfinite(array).all() and array.min(initial=0) >= 0):
        return None, f"{said.dropped} holds weights that are not finite, or below 0"
    return array.astype(np.float64), None


def read_array(out: Path, name: str | None):
    """The array in the file that a renderer says it wrote into its output folder, and what is wrong with it."""
    if name is None:
        return None, "printed no output event"
    try:
        is_there = name in os.listdir(out) and stat.S_ISREG(os.lstat(out / name).st_mode)
    except OSError:
        is_there = False
    if not is_there:
        return None, f'returned no file "{name}" in its output folder'
    try:
        with open(out / name, "rb") as file:
            return np.lib.format.read_array(file, allow_pickle=False), None
    except Exception as error:  # of many kinds: the bytes can be anything
        return None, f"{name} is no array: {events.words(error)}"


def _are_hits(rows: np.ndarray) -> bool:
    hit = rows[:, 7] >= 0
    whole = rows[:, 7] == np.floor(rows[:, 7])
    return bool(np.all(whole & np.where(hit, np.isfinite(rows).all(axis=1), rows[:, 7] == -1)))
