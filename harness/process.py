"""Runs one renderer process: a launcher that starts it, a measurer that watches it, and what the two found."""

import contextlib
import json
import os
import select
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from harness import cuda
from harness import launcher as launcher_module

# What a renderer needs of the caller's environment. The rest is left out: its size and content change timings
# (Mytkowicz et al., ASPLOS 2009) and differ from user to user.
KEPT = (
    *("PATH", "HOME", "LANG", "LC_ALL", "TMPDIR", "LD_LIBRARY_PATH", "PYTHONPATH"),
    *(cuda.SIMULATOR, "CUDA_VISIBLE_DEVICES", "CUDA_HOME", "CUDA_PATH"),
)

PATIENCE = 10.0  # s, for the measurer's last words
DIED = '{"failed": "the launcher died"}'


@dataclass(frozen=True)
class Outcome:
    """How one process ended. Times in s on the monotonic clock of this machine, memory in bytes."""

    failed: str | None  # it could not be started
    spawned: float
    exited: float
    code: int | None
    signal: int | None
    timed_out: bool
    user_s: float  # of it, its descendants that were waited for, and its orphans
    system_s: float
    wait4_peak_bytes: int
    wait4_floor_bytes: int
    measurer: dict | None  # the measurer's words about itself; None if it was not asked to watch
    orphans: int | None = None  # descendants that nobody waited for; None if the system does not give them to us
    orphans_s: float | None = None  # their CPU time, which is in user_s and system_s

    @property
    def wall_s(self) -> float:
        return self.exited - self.spawned


def _packages() -> list[str]:
    """Where Python's packages are: with it, renderers can leave out `site`.

    `site` runs what packages leave in *.pth files (numba-cuda: 20 ms and 4 MB), in each process and whoever needs it.
    """
    given = [path for path in os.environ.get("PYTHONPATH", "").split(os.pathsep) if path]
    installed = [path for path in sys.path if Path(path).name in ("site-packages", "dist-packages")]
    return list(dict.fromkeys([*given, str(Path(__file__).parents[1]), *installed]))


def run(
    command: list[str],
    folder: Path,
    stdout: Path,
    stderr: Path,
    timeout: float,
    series: Path | None = None,
    interval: float = 0.05,
) -> Outcome:
    """Run `command` in `folder`; with `series`, watch it every `interval` seconds into that CSV file."""
    environment = {name: os.environ[name] for name in KEPT if name in os.environ}
    environment["PYTHONPATH"] = os.pathsep.join(_packages())
    environment["CUDA_DEVICE_ORDER"] = "PCI_BUS_ID"  # NVML's: the device that runs is the one that is watched
    spec = folder.parent / f"{folder.name}.launch.json"
    spec.write_text(
        json.dumps(
            {
                "command": command,
                "folder": str(folder),
                "environment": environment,
                "stdout": str(stdout),
                "stderr": str(stderr),
                "timeout": timeout,
            }
        )
    )
    # -P: the current folder may hold modules of the same names
    watch = [sys.executable, "-P", "-m", "harness.measurer", str(series), str(interval)]
    measurer = _start(watch) if series else None
    if measurer:
        measurer.stdout.readline()  # ready: its imports must not run beside the renderer
    launcher = _start([sys.executable, "-I", "-S", launcher_module.__file__, str(spec)])
    try:
        started = json.loads(launcher.stdout.readline() or DIED)
        if "failed" in started:
            return Outcome(started["failed"], 0.0, 0.0, None, None, False, 0.0, 0.0, 0, 0, None)
        if measurer:
            _tell(measurer, {**started, "launcher": launcher.pid})
        end = json.loads(launcher.stdout.readline() or DIED)
        if "failed" not in end:
            audit = _last_words(measurer, end) if measurer else None
            _tell(launcher, {})  # it may reap
            end |= json.loads(launcher.stdout.readline() or DIED)
        if "failed" in end:
            launcher_module.kill_group(started["pid"], signal.SIGKILL)
            return Outcome(end["failed"], 0.0, 0.0, None, None, False, 0.0, 0.0, 0, 0, None)
        return Outcome(failed=None, spawned=started["spawned"], measurer=audit, **end)
    finally:
        for process in (launcher, measurer):
            if process:
                with contextlib.suppress(BrokenPipeError):  # it died before it read all
                    process.stdin.close()
                process.wait()
                process.stdout.close()
        spec.unlink(missing_ok=True)


def _start(command: list[str]) -> subprocess.Popen:
    """Start a helper in a session of its own, so that Ctrl-C reaches the harness alone."""
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True)


def _tell(process: subprocess.Popen, message: dict) -> None:
    with contextlib.suppress(BrokenPipeError):
        process.stdin.write(json.dumps(message) + "\n")
        process.stdin.flush()


def _last_words(measurer: subprocess.Popen, end: dict) -> dict | None:
    """Have the measurer look at the dead once more; its audit. None if it is dead itself, or stuck."""
    _tell(measurer, end)
    if not select.select([measurer.stdout], [], [], PATIENCE)[0]:
        measurer.kill()
        return None
    line = measurer.stdout.readline()
    return json.loads(line) if line else None
