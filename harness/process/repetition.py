"""One repetition: a variant does one job in a process of its own; the result and its checks."""

import contextlib
import math
import os
import signal
import stat
import sys
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from harness.process import crash, dialog, process
from harness.process.dialog import Dialog
from harness.process.scratch import must_have_room, remove, scratch
from harness.renderer import builder, events, job, methods, places
from harness.renderer.builder import BuildError, Built, fill
from harness.renderer.limits import DEFAULT, Limits
from harness.renderer.parameters import Parameters
from harness.renderer.registry import Entry
from harness.system import output, ownership

UNSUPPORTED = 3  # exit status
BY_OTHERS = "by SIGKILL, perhaps for using too much memory (see dmesg)"
DENIED = "Permission denied", "failed to map segment", "Operation not permitted"  # of execve(2) and dlopen(3)
HEAVIEST = 1e100  # dropped weight of a pixel; of more, what is worked out from it leaves float64
# Parameters that a manifest names the values of.
METHODS = "precision", "kernel", *(method.name for method in methods.METHODS if method.listed)


@dataclass
class Result:
    """The result of one process. `status` is "ok", or names what went wrong, with the reason."""

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
    for method in METHODS:
        if method == "glossy_weight" and "glossy" not in needs:
            continue
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
    limits: Limits = DEFAULT,
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
    return start(entry, arrays, parameters, needs, timeout, series, interval, cache, log, limits)


def start(
    entry, arrays, parameters, needs, timeout=600.0, series=None, interval=0.05, cache=None, log=None, limits=DEFAULT
) -> Result:
    """`run` without asking the manifest first whether the renderer can do the job."""
    try:
        built = entry.renderer.build(parameters, needs)
    except BuildError as error:
        return Result("failed", f"its build failed: {error}")
    with scratch() as here:
        given = write_job(entry, here, arrays, parameters, needs)
        sealed = job.seal(here / "job")
        own = cache or here / "cache"
        ownership.make(own)
        command = command_of(entry, built)
        command += job.flags(here / "job", here / "out", entry.variant.name, own, parameters, given)
        stdout, stderr = here / "stdout", here / "stderr"
        (here / "neutral").mkdir()
        with contextlib.ExitStack() as stack:
            talk = None
            if is_checked(entry, parameters):
                talk = stack.enter_context(contextlib.closing(Dialog(here / "dialog", stdout)))
                command.append(f"--dialog={here / 'dialog'}")
            how = timeout, series, interval, limits, cache, entry.renderer.home, talk
            outcome = process.run(command, here / "neutral", stdout, stderr, *how)
        if outcome.failed:
            return Result("failed", outcome.failed + _noexec(outcome.failed, built, own))
        if outcome.over and outcome.over[0] == "disk" and ownership.is_ours(own):
            remove(own)  # the next repetition would find no room in it
        gone = [path for path in (stdout, stderr) if not _is_file(path)]
        fault = tampered(here, sealed)
        if gone:
            fault = f"removed or replaced the file of its {gone[0].name}"
        said, text = events.read(_unless(gone, stdout)), end_of(_unless(gone, stderr))
        fault = fault or (talk and _unkept(outcome, said))
        result = collect(outcome, said, text, fault, here / "out", parameters, needs, arrays)
        if result.status == "ok" and talk and said.frames[0]["checksums"] != places.checksum(result.array):
            result.status, result.array = "failed", None
            result.reason = "the checksum of frame 0 is not that of its picture (FRM-2)"
        if result.status == "failed":
            result.reason += _noexec(result.reason, built, own)
        elif result.status == "ok" and outcome.unwatched:
            result.status, result.reason, result.array = "failed", outcome.unwatched, None
        if log:
            for path in (stdout, stderr):
                with open(_unless(gone, path), "rb") as source:
                    output.data(Path(f"{log}.{path.name}"), source.read(limits.output))
    return result


def is_checked(entry: Entry, parameters: Parameters) -> bool:
    """Whether the later frames of a job have places of their own, and checksums (contract 2)."""
    later = parameters.kind == "image" and parameters.frames > 0
    return later and entry.contract >= 2 and hasattr(os, "mkfifo")


def _unkept(outcome: process.Outcome, said: events.Said) -> str | None:
    """None, or how a renderer did not keep to FRM-1 or FRM-2."""
    lacking = next((frame["index"] for frame in said.frames if frame["checksums"] is None), None)
    if outcome.code != 0 or said.faults or len(said.frames) < 2:  # its own reason comes first
        return None
    if lacking is not None:
        return f"frame {lacking} has no checksum of its picture (FRM-2)"
    return dialog.fault(outcome.places, said.frames)


def _noexec(reason: str, built: Built | None, cache: Path) -> str:
    """What to do where a program or library was refused as its file system is mounted with noexec; else ""."""
    if not any(words in reason for words in DENIED):
        return ""
    for folder in (*([built.folder] if built else []), cache):
        if barred := builder.noexec(folder):
            return f"; {barred}"
    return ""


def write_job(entry: Entry, here: Path, arrays: dict[str, np.ndarray], parameters: Parameters, needs) -> tuple:
    """Write the job into `here / "job"`, and an empty `here / "out"`; the needs as the renderer is given them.

    If there is a job, these are its arrays.
    """
    # A renderer that finds the disk full fails, and its row would say so for ever.
    must_have_room(here, 8 * math.prod(parameters.shape()) if parameters.kind == "image" else 0)
    given = entry.renderer.given(parameters, needs)
    if (here / "job").exists():
        job.describe(here / "job", parameters, given)
    else:
        job.write(here / "job", arrays, parameters, given)
    (here / "out").mkdir()
    return given


def command_of(entry: Entry, built: Built | None) -> list[str]:
    """The command of a variant, without the flags of a job."""
    places = {"folder": str(entry.renderer.folder), "python": sys.executable}
    if built:
        places["build"] = str(built.folder)
    return [fill(word, places) for word in entry.variant.command]


def tampered(here: Path, sealed: dict[str, tuple]) -> str | None:
    """None, or what a renderer changed of its job, which was as `sealed`."""
    touched = job.changed(here / "job", sealed)
    return f"changed its job: {events.words(', '.join(touched))}" if touched else None


def _unless(gone: list[Path], path: Path) -> Path:
    return Path(os.devnull) if path in gone else path


def end_of(path: Path, start: int = 0) -> str:
    """The last words in a file, of those after its first `start` bytes."""
    with open(path, "rb") as file:
        file.seek(max(start, path.stat().st_size - 2**16))
        return file.read(2**16).decode("utf-8", errors="replace").strip()


def _is_file(path: Path) -> bool:
    try:
        return stat.S_ISREG(os.lstat(path).st_mode)
    except OSError:
        return False


def collect(
    outcome: process.Outcome, said: events.Said, text: str, fault: str | None, out: Path, parameters, needs, arrays
) -> Result:
    """The Result of a job that ended, with `text` as the end of its standard error; its arrays are in the folder `out`.

    fault: None, or what is already known to be wrong.
    """
    rays = len(arrays["rays"]) if parameters.kind == "rays" else 0
    events.tidy(said, outcome.spawned, outcome.exited)
    result = Result("ok", "", outcome, said, None, text)
    why = said.error or events.words(crash.reason(text)) or "it did not say why"
    if outcome.timed_out:
        stopped = ", in which it was stopped by a signal" if outcome.stopped else ""
        result.status, result.reason = "timeout", f"killed after {outcome.wall_s:.3g} s{stopped}"
    elif outcome.over:
        limit, result.reason = outcome.over
        result.status = "killed" if limit == "memory" and outcome.signal == signal.SIGKILL else "failed"
    elif outcome.signal == signal.SIGKILL:
        result.status, result.reason = "killed", BY_OTHERS
    elif outcome.signal == signal.SIGXFSZ:
        result.status, result.reason = "failed", "wrote a file that is larger than the limit of disk"
    elif outcome.signal is not None:
        result.status, result.reason = "failed", f"ended by {_signal(outcome.signal)}: {why}"
    elif outcome.code == UNSUPPORTED:
        result.status, result.reason = "unsupported", why
    elif outcome.code != 0:
        result.status, result.reason = "failed", f"exit {outcome.code}: {why}"
    else:
        fault = fault or _incomplete(said, parameters)
        if fault is None:
            result.array, fault = _load(out, said, parameters, rays)
        if fault is None and "cutoff" in needs:
            result.dropped, fault = _load_dropped(out, said, parameters)
        if fault:
            result.status, result.reason = "failed", fault
    del said.frames[parameters.frames + 1 :]  # of more than were asked for, which may be millions
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
        return f"reported frames {events.words(frames)}, expected 0 to {parameters.frames}"
    first, *later = (frame["renders"] for frame in said.frames)
    if first != 1:
        return f"frame 0 is of {first} renders, expected 1"
    if later and later[0] > 1 and not parameters.least_frame:
        return f"frames of {later[0]} renders, which nobody asked for"
    if len(set(later)) > 1:
        return f"frames of {events.words(later)} renders, expected always the same"
    return None


def _load(out: Path, said: events.Said, parameters: Parameters, rays: int):
    """The array that the renderer returned, and what is wrong with it."""
    array, fault = read_array(out, said.output)
    if fault:
        return None, fault
    if array.dtype not in (np.float64, np.float32):
        return None, f"{said.output} holds {array.dtype}, expected float64 or float32"
    if parameters.kind == "image" and array.shape != parameters.shape():
        return None, f"{said.output} has shape {array.shape}, expected {parameters.shape()}"
    if parameters.kind == "rays" and array.shape != (rays, 8):
        return None, f"{said.output} has shape {array.shape}, expected {(rays, 8)}"
    array = np.array(array)
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
    if not (array.min(initial=0) >= 0 and float(array.max(initial=0)) <= HEAVIEST):
        return None, f"{said.dropped} holds weights that are not finite, or below 0"
    return array.astype(np.float64), None


def read_array(out: Path, name: str | None):
    """The array in the file that a renderer says it wrote into its output folder, and what is wrong with it.

    It is not read before it is looked at: a file can say that it holds more than there is memory for.
    """
    if name is None:
        return None, "printed no output event"
    try:
        is_there = name in os.listdir(out) and _is_file(out / name)
    except OSError:
        is_there = False
    if not is_there:
        return None, f'returned no file "{name}" in its output folder'
    try:
        return np.lib.format.open_memmap(out / name, "r"), None
    except Exception as error:  # of many kinds: the bytes can be anything
        return None, f"{name} is no array: {events.words(error)}"


def _are_hits(rows: np.ndarray) -> bool:
    hit = rows[:, 7] >= 0
    whole = rows[:, 7] == np.floor(rows[:, 7])
    return bool(np.all(whole & np.where(hit, np.isfinite(rows).all(axis=1), rows[:, 7] == -1)))
