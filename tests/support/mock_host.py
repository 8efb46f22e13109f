"""A mock host with a clock of its own: renderers that take exactly as long as they are told to, in no time at all.

"Takes 0.123 s a frame, 12 % outliers, drifts 3 % a minute, warms up for 7 frames" is
Mock({"a": Behaviour(0.123, outliers=0.12, warmup=7)}, drift_per_minute=0.03). What goes through it is the whole of the
harness but the processes: the plan's order, the store, the judge, the reports.
"""

import contextlib
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from harness.experiment import experiment as experiments
from harness.plan import plan
from harness.process import process
from harness.process.dialog import Answer
from harness.process.repetition import Result
from harness.renderer import events, manifest, places, registry

MANIFEST = """contract = 2
name = "{name}"
technology = "mock"
description = "takes as long as it is told to"
features = ["sphere", "ambient", "diffuse", "phong", "reflection", "region"]
[methods]
precision = ["float64"]
[[variant]]
name = "{name}"
command = ["none"]
"""
COUNTERS = "steal_s", "busy_s", "own_s", "waited_s", "swapped_pages", "held_back_s", "throttled"
RAYS = {"primary": 1, "reflected": 0, "transmitted": 0, "shadow": 0, "non_finite": 0}


@dataclass(frozen=True)
class Behaviour:
    """Times in s. noise: relative standard deviation of a process; frame_noise: of its frames. outliers: the share of
    frames that take 2 to 10 times as long; process_outliers: of processes, likewise. warmup: frames at the start that
    take `warmup_factor` times as long. fails: the status of every process. false: so many of its first
    processes say that each frame took 1 us. copies: its later frames are not the pictures of their places."""

    frame: float
    start: float = 0.05
    noise: float = 0.0
    frame_noise: float = 0.0
    outliers: float = 0.0
    process_outliers: float = 0.0
    warmup: int = 0
    warmup_factor: float = 3.0
    fails: str = ""
    false: int = 0
    copies: bool = False


class Mock:
    """A Host (harness/race/host.py) that lets no time pass but its own. `now`: s since it was made.

    drift_per_minute: by which everything gets slower, of its time at the start.
    """

    def __init__(self, behaviours: dict[str, Behaviour], seed: int = 1, drift_per_minute: float = 0.0):
        self.behaviours, self.drift = behaviours, drift_per_minute
        self.rng = np.random.default_rng(seed)
        self.now = 0.0
        self.started: list[str] = []

    references = None

    def exclusive(self):
        return contextlib.nullcontext()

    def clock(self) -> float:
        return self.now

    def look(self) -> dict:
        return dict.fromkeys(COUNTERS, "a mock machine")

    def run(self, entry, arrays, parameters, needs, timeout=600.0, series=None, cache=None, **more):
        if entry.name not in self.behaviours or parameters.frames == 0:  # the judge; a frame that is made again
            return Result("ok", "", self._outcome(self.now), self._said([], self.now), _picture(parameters))
        told = self.behaviours[entry.name]
        self.started.append(entry.name)
        if told.fails:
            return Result(told.fails, "as it was told to")
        spawned = self.now
        self._pass(told.start)
        level = told.frame * (1 + told.noise * self.rng.standard_normal()) * self._jump(told.process_outliers)
        false = self.started.count(entry.name) <= told.false
        frames = []
        for index in range(parameters.frames + 1):
            seconds = level * (1 + told.frame_noise * self.rng.standard_normal()) * self._jump(told.outliers)
            start = self.now
            self._pass(seconds * (told.warmup_factor if index < told.warmup else 1))
            end = start + 1e-6 if false else self.now
            frames.append({"index": index, "start": start, "end": end, "parts": None, "renders": 1})
            frames[-1]["checksums"] = "0" * 8 if told.copies else places.checksum(_picture(parameters))
        answer = Answer(frames[0]["end"], (0, 0), frames[:1])
        outcome = replace(self._outcome(spawned), places=answer)
        return Result("ok", "", outcome, self._said(frames, spawned), _picture(parameters))

    def untimed(self):
        return contextlib.nullcontext(self)

    def close(self):
        pass

    def _pass(self, seconds: float) -> None:
        self.now += seconds * (1 + self.drift * self.now / 60)

    def _jump(self, share: float) -> float:
        return self.rng.uniform(2, 10) if self.rng.random() < share else 1.0

    def _outcome(self, spawned: float) -> process.Outcome:
        wall = self.now - spawned
        ended = {"code": 0, "signal": None, "timed_out": False, "user_s": wall, "system_s": 0.0}
        peak = {"wait4_peak_bytes": 10**7, "wait4_floor_bytes": 10**6}
        return process.Outcome(failed=None, spawned=spawned, exited=self.now, **ended, **peak, measurer=None)

    def _said(self, frames: list[dict], spawned: float) -> events.Said:
        first = frames[0]["start"] if frames else spawned
        phases = [
            {"name": "load", "start": spawned, "end": first},
            {"name": "render", "start": first, "end": self.now},
        ]
        return events.Said(phases=phases, frames=frames, rays=dict(RAYS))


def _picture(parameters) -> np.ndarray:
    return np.full(parameters.shape(), 0.5)


def planned(write, folder: Path, measure: str, processes: int, scene: str) -> tuple:
    """An experiment of two mock renderers, a and b, its plan, and who is known. measure: lines of its [measure]."""
    write("scene.txt", scene)
    head = f'title = "t"\nscenes = ["scene.txt"]\nrenderers = ["a", "b"]\nprocesses = {processes}\nframes = 1\n'
    file = write("e.toml", f"{head}[image]\nwidth = 4\nheight = 4\n[measure]\n{measure}\n")
    known, wanted = entries(folder / "renderers", "a", "b"), experiments.load(file)
    return wanted, plan.make(wanted, file, known), known


def entries(folder: Path, *names: str) -> dict[str, registry.Entry]:
    """Renderers for the mock by name, one folder each; and `cpp`, who judges them."""
    known = {}
    for name in (*names, "cpp"):
        place = folder / name
        place.mkdir(parents=True, exist_ok=True)
        (place / "renderer.toml").write_text(MANIFEST.format(name=name), encoding="utf-8")
        made = manifest.load(place)
        known[name] = registry.Entry(registry.Renderer(place, made), made.variant[0])
    return known
