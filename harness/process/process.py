"""Runs one renderer process with a launcher that starts it and a measurer that watches it."""

import contextlib
import json
import os
import select
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from harness.process import launcher as launcher_module
from harness.process.dialog import Answer, Dialog
from harness.renderer.limits import DEFAULT, Limits
from harness.system import cuda, opencl

# What a renderer needs of the caller's environment. The rest is left out: its size and content change timings
# (Mytkowicz et al., ASPLOS 2009) and differ from user to user.
KEPT = (
    *("PATH", "HOME", "LANG", "LC_ALL", "TMPDIR", "LD_LIBRARY_PATH", "PYTHONPATH"),
    *(cuda.SIMULATOR, "CUDA_VISIBLE_DEVICES", "CUDA_HOME", "CUDA_PATH"),
    opencl.FOLDER,
)

PATIENCE = 10.0  # s, for the measurer's last words
START = 60.0  # s, for its first: it imports, and asks NVML
STUCK = 60.0  # s after which a launcher that should have spoken has been stopped, or worse
DIED = {"failed": "the launcher died"}
UNWATCHED = "its measurer "  # begins why nobody has watched
KILLED = f"{UNWATCHED}was killed by SIGKILL, perhaps as memory was short (see dmesg)"
IN_A_DRIVER = f"{UNWATCHED}ended, or waited for ever, perhaps in the driver of a GPU"


@dataclass(frozen=True)
class Outcome:
    """How one process ended. Times in s on the monotonic clock of this machine, memory in bytes."""

    failed: str | None  # it could not be started
    spawned: float
    exited: float
    code: int | None
    signal: int | None
    timed_out: bool
    user_s: float | None  # of it, its descendants that were waited for, and its orphans; None of one job of several
    system_s: float | None
    wait4_peak_bytes: int | None
    wait4_floor_bytes: int | None
    measurer: dict | None  # the measurer's words about itself; None if it was not asked to watch
    orphans: int | None = None  # descendants that nobody waited for; None if the system does not give them to us
    orphans_s: float | None = None  # their CPU time, which is in user_s and system_s
    stopped: bool = False  # by a signal, when it had timed out
    over: tuple[str, str] | None = None  # a limit that it was over, and what it did
    unwatched: str | None = None  # why the measurer, which was asked to watch, gave no account of itself
    places: Answer | None = None  # what it was answered that asked for the places of its samples

    @property
    def wall_s(self) -> float:
        return self.exited - self.spawned

    @property
    def alone(self) -> bool:
        """Did the process do this job alone, so that its processor time and memory are the job's?"""
        return self.user_s is not None


def _packages(home: Path | None) -> list[str]:
    """Where Python's packages are: with it, renderers can leave out `site`. home: of a renderer's own, found first.

    `site` runs what packages leave in *.pth files (numba-cuda: 20 ms and 4 MB), in each process and whoever needs it.
    """
    given = [path for path in os.environ.get("PYTHONPATH", "").split(os.pathsep) if path]
    installed = [path for path in sys.path if Path(path).name in ("site-packages", "dist-packages")]
    own = Path(__file__).parents[2]
    first = [str(home)] if home not in (None, own) else []
    return list(dict.fromkeys([*first, *given, str(own), *installed]))


class Process:
    """A renderer's process, started, with its launcher and its measurer. Close it whatever happens (a context)."""

    without_gpu = ""  # why measurers ask no GPU any more: the driver took one of them along

    def __init__(
        self,
        command: list[str],
        folder: Path,
        stdout: Path,
        stderr: Path,
        timeout: float,
        series: Path | None = None,
        interval: float = 0.05,
        limits: Limits = DEFAULT,
        cache: Path | None = None,
        home: Path | None = None,
        dialog: Dialog | None = None,
    ):
        """Start `command` in `folder`; with `series`, watch it every `interval` seconds into that CSV file.

        home: the folder that the packages of a renderer are found in before others. dialog: answers its question.

        What it writes into `cache` and beside `folder` is limited; nothing else lies there but its input.
        """
        self.timeout, self.limits, self.most, self.dialog = timeout, limits, limits.now(), dialog
        environment = {name: os.environ[name] for name in KEPT if name in os.environ}
        environment["PYTHONPATH"] = os.pathsep.join(_packages(home))
        environment["CUDA_DEVICE_ORDER"] = "PCI_BUS_ID"  # NVML's: the device that runs is the one that is watched
        self.own = (
            folder.parent / f"{folder.name}.tmp"
        )  # goes with the rest; no other process has it in its environment
        self.own.mkdir(exist_ok=True)
        environment["TMPDIR"] = str(self.own)
        self.spec = folder.parent / f"{folder.name}.launch.json"
        self.spec.write_text(
            json.dumps(
                {
                    "command": command,
                    "folder": str(folder),
                    "environment": environment,
                    "stdout": str(stdout),
                    "stderr": str(stderr),
                    "timeout": timeout,
                    "limits": self.most,
                    "places": [str(place) for place in (folder.parent, cache) if place],
                    # Counters of instructions, which `env` starts (counting.py), may need the rights of their file.
                    "confined": command[0] != "env",
                }
            )
        )
        # -P: the current folder may hold modules of the same names
        watch = [sys.executable, "-P", "-m", "harness.process.measurer", str(series), str(interval), self.without_gpu]
        self.measurer = _start(watch) if series else None
        self.stuck = False
        if self.measurer:
            self._word(START)  # ready: its imports must not run beside the renderer
        self.launcher = _start([sys.executable, "-I", "-S", launcher_module.__file__, str(self.spec)], _for_launcher())

    def __enter__(self) -> "Process":
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def begin(self) -> str | None:
        """Wait until it has started; None, or why it could not be."""
        self.started = _hear(self.launcher, 0.0)
        if self.started is DIED:
            end_marked(self.own)
        if "failed" not in self.started and self.measurer:
            _tell(self.measurer, {**self.started, "launcher": self.launcher.pid})
        return self.started.get("failed")

    def ended(self, seconds: float) -> bool:
        """Wait up to `seconds` for its end; has it ended?"""
        return bool(select.select([self.launcher.stdout], [], [], seconds)[0])

    def stop(self) -> None:
        """Have the launcher end it now."""
        with contextlib.suppress(BrokenPipeError):
            self.launcher.stdin.close()

    def end(self) -> Outcome:
        """Wait for its end, at most its timeout; the Outcome."""
        begun = time.monotonic()
        self._converse()
        audit, end = None, _hear(self.launcher, max(0.0, self.timeout - (time.monotonic() - begun)))
        if "failed" not in end:
            audit = self._last_words(end) if self.measurer else None
            _tell(self.launcher, {})  # it may reap
            end |= _hear(self.launcher, 0.0)
            if self.measurer and audit is None:
                end["unwatched"] = self._why_unwatched()
        if "failed" in end:
            launcher_module.kill_group(self.started["pid"], signal.SIGKILL)
            end_marked(self.own)
            return could_not_start(end["failed"])
        if end["over"]:
            name, used = end["over"]
            end["over"] = name, self.limits.excess(name, used, self.most[name])
        places = self.dialog and self.dialog.answered
        return Outcome(failed=None, spawned=self.started["spawned"], measurer=audit, places=places, **end)

    def _converse(self) -> None:
        """Answer the renderer's question, if it may have one; until then, or until it ends or its time is up."""
        if self.dialog:
            ready = select.select([self.launcher.stdout, self.dialog], [], [], self.timeout + STUCK)[0]
            if self.dialog in ready:
                self.dialog.answer()

    def _last_words(self, end: dict) -> dict | None:
        """Have the measurer look at the dead once more; its audit. None if it is dead itself, or stuck."""
        _tell(self.measurer, end)
        line = self._word(PATIENCE)
        return json.loads(line) if line else None

    def _word(self, seconds: float) -> bytes:
        """The next line of the measurer; empty if it is dead, or stuck, as in the driver of a GPU that is lost: then it
        is killed."""
        if not _speaks(self.measurer, seconds):
            self.stuck = True
            self.measurer.kill()
        return self.measurer.stdout.readline()

    def _why_unwatched(self) -> str:
        """Why the measurer gave no account. Unless somebody has killed it, later ones ask no GPU, so that they do."""
        if self.measurer.wait() == -signal.SIGKILL and not self.stuck:
            return KILLED
        Process.without_gpu = Process.without_gpu or f"{IN_A_DRIVER}, before"
        return IN_A_DRIVER

    def close(self) -> None:
        for process in (self.launcher, self.measurer):
            if process:
                with contextlib.suppress(BrokenPipeError):  # it died before it read all
                    process.stdin.close()
                with contextlib.suppress(subprocess.TimeoutExpired):
                    process.wait(STUCK)
                if process.returncode is None:
                    process.kill()
                    process.wait()
                    end_marked(self.own)
                process.stdout.close()
        self.spec.unlink(missing_ok=True)


def could_not_start(reason: str) -> Outcome:
    """The Outcome of a process that is not there."""
    return Outcome(reason, 0.0, 0.0, None, None, False, 0.0, 0.0, 0, 0, None)


def run(*arguments, **options) -> Outcome:
    """Run a Process, with its arguments, to its end; the Outcome."""
    with Process(*arguments, **options) as process:
        failed = process.begin()
        return could_not_start(failed) if failed else process.end()


def _hear(launcher: subprocess.Popen, seconds: float) -> dict:
    """Waits up to `seconds`, plus a margin, for the launcher's next message. Returns DIED if there is none."""
    if not _speaks(launcher, seconds + STUCK):
        launcher.send_signal(signal.SIGCONT)  # a renderer may stop it; it then does what is overdue
        _speaks(launcher, STUCK) or launcher.kill()
    try:
        return json.loads(launcher.stdout.readline())
    except ValueError:  # nothing, or not its words
        launcher.kill()
        return DIED


def _speaks(helper: subprocess.Popen, seconds: float) -> bool:
    """Wait until a helper has something to say, or has ended; False after so many seconds."""
    until = time.monotonic() + seconds
    while (left := until - time.monotonic()) > 0:
        if select.select([helper.stdout], [], [], min(left, 3600.0))[0]:
            return True
    return False


def end_marked(own: Path) -> None:
    """End the processes that have the folder `own` for their temporary files, where Linux tells: a dead launcher's."""
    mark = f"TMPDIR={own}\0".encode()
    alive = True
    while alive:  # they may be multiplying
        alive = False
        for place in Path("/proc").glob("[0-9]*"):
            with contextlib.suppress(OSError):
                if mark in (place / "environ").read_bytes():
                    os.kill(int(place.name), signal.SIGKILL)
                    alive = True


def _for_launcher() -> dict[str, str]:
    """The environment of the launcher, which a renderer can read (/proc): without what leads to the user's caches."""
    return {name: value for name, value in os.environ.items() if not name.startswith(("HOME", "RAYRACE_", "XDG_"))}


def _start(command: list[str], environment: dict[str, str] | None = None) -> subprocess.Popen:
    """Start a helper in a session of its own, so that Ctrl-C reaches the harness alone. No buffers: select sees all."""
    pipe = subprocess.PIPE
    return subprocess.Popen(command, bufsize=0, stdin=pipe, stdout=pipe, start_new_session=True, env=environment)


def _tell(process: subprocess.Popen, message: dict) -> None:
    with contextlib.suppress(BrokenPipeError, ValueError):  # ValueError: closed, to end it
        process.stdin.write(json.dumps(message).encode() + b"\n")
