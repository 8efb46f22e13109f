"""Where the time of rendering goes: a profile of a steady frame by the functions of the source.

Two jobs are profiled whole, the second with more frames. What it has more is due to those frames alone: starting,
loading and compiling cancel out, as when instructions are counted (harness/race/counting.py).
"""

import dataclasses
import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from harness.process import repetition
from harness.process.scratch import scratch
from harness.race.counting import smaller, special, under
from harness.renderer.parameters import Parameters
from harness.renderer.registry import Entry
from harness.single import callgrind
from harness.statistics import steady
from harness.system import counters

SAMPLES_S = 6.0  # s that the frames take of which samples are taken
RATE = 250  # samples a second
MOST = 2000  # frames
QUIET = 'exec 3>&1; exec "$@" >/dev/null'  # py-spy writes to standard output too, which is the program's
BETWEEN = "Failed to get process executable name"  # it looked in the moment when the shell became the program
NO_PY_SPY = "py-spy is not installed (pip install 'rayrace[profile]')"


@dataclass(frozen=True)
class Profile:
    """What a steady frame takes, by stack of functions, the outermost first.

    unit: "instructions" or "seconds". tool: with its version. size: width and height, where it is another picture than
    was asked for, since Valgrind is slow.
    """

    tool: str
    unit: str
    stacks: dict[callgrind.Stack, float]
    size: tuple[int, int] | None = None

    @property
    def total(self) -> float:
        return sum(self.stacks.values())

    def functions(self) -> list[tuple[str, float, float]]:
        """Each function with what it took itself and with what it called, the largest first."""
        own: dict[str, float] = {}
        whole: dict[str, float] = {}
        for stack, weight in self.stacks.items():
            own[stack[-1]] = own.get(stack[-1], 0.0) + weight
            for name in set(stack):
                whole[name] = whole.get(name, 0.0) + weight
        return sorted(((n, own.get(n, 0.0), w) for n, w in whole.items()), key=lambda row: (-row[1], -row[2], row[0]))


def take(entry: Entry, arrays: dict, parameters: Parameters, needs: tuple[str, ...], timeout: float) -> Profile | str:
    """The profile of a frame of `entry`, or why there is none: by py-spy of a Python program, else by callgrind."""
    if entry.variant.device != "cpu":
        return "it runs on another device, whose functions no tool here sees"
    interpreted = entry.variant.command[0] == "{python}"
    able = _py_spy() if interpreted else counters.valgrind()
    if isinstance(able, str):
        return able
    with scratch() as cache:

        def run(frames: int, words: list[str], options: tuple[str, ...] = (), environment: dict | None = None):
            wrapped = under(entry, options, environment or {}, words)
            run_job = dataclasses.replace(job, frames=frames)
            return repetition.run(wrapped, arrays, run_job, needs, timeout, cache=cache / "kernels")

        job = dataclasses.replace(parameters, least_frame=0.0)
        if interpreted:
            return _sampled(run, able.version)
        options, environment = special(entry)
        job = smaller(job)
        costs = _counted(lambda frames, words: run(frames, words, (*options, *callgrind.OPTIONS), environment))
        if isinstance(costs, str):
            return costs
        size = None if job.bounds() == parameters.bounds() else (job.width, job.height)
        return Profile(f"callgrind {able.version}", "instructions", costs, size)


def _py_spy() -> counters.Tool | str:
    path = shutil.which("py-spy", path=f"{Path(sys.executable).parent}") or shutil.which("py-spy")
    return NO_PY_SPY if path is None else counters.Tool(path, counters.version(path), slow=False)


def _counted(run: Callable) -> dict | str:
    """Instructions of a frame by stack, or why there are none."""
    jobs: list[dict] = []
    for frames in (1, 3):
        with scratch() as here:
            result = run(frames, callgrind.words(here))
            if result.status != "ok":
                return f"in Valgrind: {result.status}: {result.reason}"
            jobs.append(callgrind.read(here))
    more = {key: (cost - jobs[0].get(key, 0)) / 2 for key, cost in jobs[1].items()}
    return callgrind.stacks({key: cost for key, cost in more.items() if cost > 0}) or "Valgrind left no counts"


def _sampled(run: Callable, version: str) -> Profile | str:
    """Seconds of a frame by stack, or why there are none."""
    plain = run(1, [])
    if plain.status != "ok":
        return f"before it was sampled: {plain.status}: {plain.reason}"
    frames = int(max(1, min(MOST, SAMPLES_S / max(steady.rough(plain.said.frames_s), SAMPLES_S / MOST))))
    jobs = []
    for count in (1, 1 + frames):
        with scratch() as here:
            file = here / "stacks"
            record = [_py_spy().name, "record", "-f", "raw", "-F", "-r", str(RATE), "-o", str(file), "--"]
            for _ in range(3):
                result = run(count, ["sh", "-c", QUIET, "py-spy", *record, "sh", "-c", 'exec "$@" >&3', "program"])
                if BETWEEN not in result.stderr:
                    break
            if result.status != "ok":
                return f"in py-spy: {result.status}: {result.reason} {result.stderr.strip()[-200:]}"
            if not file.is_file():
                return f"py-spy left no samples: {result.stderr.strip()[-200:]}"
            jobs.append(collapsed(file.read_text("utf-8", errors="replace")))
    names = dict.fromkeys((*jobs[0], *jobs[1]))
    more = {name: (jobs[1].get(name, 0) - jobs[0].get(name, 0)) / (RATE * frames) for name in names}
    weights = {name: seconds for name, seconds in more.items() if seconds > 0}
    return Profile(f"py-spy {version}", "seconds", weights) if weights else "py-spy took no samples"


def collapsed(text: str) -> dict[callgrind.Stack, int]:
    """Samples by stack, from lines of "function (file.py:1);function (file.py:2) 7", without the numbers of lines."""
    counts: dict[callgrind.Stack, int] = {}
    for line in text.splitlines():
        names, _, count = line.rpartition(" ")
        if not count.isdigit():
            continue
        stack = tuple(name.strip() for name in names.split(";"))
        counts[stack] = counts.get(stack, 0) + int(count)
    return counts
