"""How often `rayrace render --max-error` keeps its promise, on random scenes that nobody chose, and what it costs.

    .venv/bin/python tests/support/promises.py --scenes 40 --seed WORD > table.md
    .venv/bin/python tests/support/promises.py --limit 1/255 --files SCENE .. > table.md
    .venv/bin/python tests/support/promises.py --kept > table.md      # without what takes longest, hindsight
    .venv/bin/python tests/support/promises.py --hard > table.md      # on scenes in which a truth can be wrong


Each picture is compared with a truth of its own by another renderer (numba-parallel, 24 x 24 samples a pixel, in four
pictures). In hindsight the best method is the quickest of a grid whose picture is within the limit of that truth; both
are then timed in turn, in one process.
"""

import argparse
import hashlib
import itertools
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(Path(__file__).parent)]

import hard_scenes  # noqa: E402
from wild_scenes import draw  # noqa: E402

from harness.choice.trial import Method  # noqa: E402
from harness.judge import judge, truth  # noqa: E402
from harness.process.session import Sessions  # noqa: E402
from harness.renderer import registry  # noqa: E402
from harness.renderer.parameters import Parameters  # noqa: E402
from harness.scene import load, text  # noqa: E402
from harness.scene.flatten import flatten  # noqa: E402
from harness.scene.model import Scene  # noqa: E402
from harness.scene.needs import needs as needs_of  # noqa: E402
from harness.single import single  # noqa: E402
from harness.single.single import general  # noqa: E402
from harness.statistics import steady  # noqa: E402

LIMITS = ("1/32", "1/64", "1/128", "1/255", "1/512")
SIZES = ((64, 64), (80, 60), (104, 80), (128, 96))
SIDE, PICTURES = 12, 4  # as many samples as 24 x 24, in pictures whose spread tells their noise
SMALL_SIDE, DEEP = 48, (400, 2.0**-26)  # of scenes of small things; depth and cut-off of the truth of hard scenes
FIRST_SEED = 0x5EED0000  # of the independent truth
SIDES = (2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24, 32)
PATHS = ((1, 2.0**-6), (2, 2.0**-6), (4, 2.0**-8))  # depth and cut-off; and those of the truth
ADAPTIVE = tuple(itertools.product((2, 3, 4), (0.1, 0.03)))
TURNS = 7  # in which two methods are timed


class Subject:
    """A scene, its job and what renders it. job: shadows, and a lens if it has one."""

    def __init__(self, scene: Scene, job: dict, size: tuple[int, int], known: dict, run):
        self.scene, self.known, self.run = scene, known, run
        self.job = Parameters(width=size[0], height=size[1], **job)
        self.arrays = flatten(scene)

    def options(self) -> list[str]:
        words = ["--width", self.job.width, "--height", self.job.height]
        words += [] if self.job.shadows else ["--no-shadows"]
        if self.job.lens_radius:
            words += ["--lens-radius", self.job.lens_radius, "--focal-distance", self.job.focal_distance]
        return list(map(str, words))

    def shoot(self, name: str, job: Parameters, frames: int = 1):
        """The picture and the time of a frame; None where the variant cannot make it."""
        entry = self.known[name]
        made = replace(general(entry, job), threads=entry.threads(), frames=frames)
        result = self.run(entry, self.arrays, made, needs_of(self.scene, made), cache=single.kernels(entry))
        if result.status != "ok":
            return None
        return result.array, steady.rough(result.said.frames_s)

    def truth(self, name: str, depth: int, cutoff: float, side: int) -> tuple[np.ndarray, np.ndarray]:
        """The mean of pictures by a variant, and its standard error."""
        job = replace(self.job, sampler="jittered", samples=side, feelers=1, glossy_rays=1, depth=depth, cutoff=cutoff)
        return truth.mean(self.shoot(name, replace(job, seed=FIRST_SEED + k), 0)[0] for k in range(PICTURES))


def grid(subject: Subject, depth: int, cutoff: float):
    """Lists of jobs, each from the quickest to the slowest."""
    needs = needs_of(subject.scene, replace(subject.job, depth=8, feelers=1, glossy_rays=1, sampler="jittered"))
    feelers, glossy = ((1, 0) if need in needs else (0,) for need in ("soft", "glossy"))
    paths = [*PATHS, (depth, cutoff)] if depth else [(0, 0.0)]
    arithmetic = itertools.product(("float64", "float32"), ("off", "on"))
    for f, g, (d, w), (p, v) in itertools.product(feelers, glossy, paths, list(arithmetic)):
        job = replace(subject.job, feelers=f, glossy_rays=g, depth=d, cutoff=w, precision=p, vector=v)
        yield [job]
        for sampler in ("jittered", "uniform"):
            yield [replace(job, sampler=sampler, samples=n) for n in SIDES]
        if w == 0 or d <= 4:
            steps = [{"adaptive_depth": a, "adaptive_threshold": t} for a, t in ADAPTIVE]
            yield from ([replace(job, cutoff=0.0, sampler="adaptive", **step)] for step in steps)


def hindsight(subject: Subject, name: str, mine: Parameters, limit: float, right, depth: int, cutoff: float):
    """The quickest job of the grid within the limit that is quicker than `mine`; `mine` if none is."""
    best, least = mine, subject.shoot(name, mine, 4)[1]
    for jobs in grid(subject, depth, cutoff):
        for job in jobs:
            shot = subject.shoot(name, job)
            if shot is None or shot[1] > 1.2 * least:
                break
            if judge.errors(shot[0], *right, None)["rmse"] <= limit:
                seconds = min(shot[1], subject.shoot(name, job, 4)[1])
                if seconds < least:
                    best, least = job, seconds
                break
    return best


def slower(subject: Subject, name: str, mine: Parameters, best: Parameters) -> float:
    """The time of `mine` over that of `best`, the median of turns."""
    if mine == best:
        return 1.0
    return float(np.median([subject.shoot(name, mine)[1] / subject.shoot(name, best)[1] for _ in range(TURNS)]))


def random_subject(number: int, seed: str, folder: Path, known: dict, run) -> tuple[Path, Subject]:
    """A random scene, in a file of the folder."""
    wild = draw(list(np.frombuffer(hashlib.sha256(f"{seed} {number}".encode()).digest(), np.uint32)))
    job = {name: wild.job[name] for name in ("shadows", "lens_radius", "focal_distance") if name in wild.job}
    return wild.keep(folder / "scene.txt"), Subject(wild.scene, job, _size(number), known, run)


def _size(number: int) -> tuple[int, int]:
    return SIZES[number // len(LIMITS) % len(SIZES)]


def hard_subject(number: int, seed: str, folder: Path, known: dict, run) -> tuple[Path, Subject]:
    """A hard scene, in a file of the folder."""
    source = hard_scenes.draw(number, seed)
    file = folder / "scene.txt"
    file.write_text(source)
    return file, Subject(text.read(source), {"shadows": True}, _size(number), known, run)


def examine(file: Path, subject: Subject, limit: str, seconds: float, kept_only: bool, kind: str) -> dict:
    """One scene: what was promised, what was kept, and, unless `kept_only`, what the best would have taken.

    kind: of a hard scene, else "".
    """
    known = subject.known
    row = {"limit": limit, "size": f"{subject.job.width} x {subject.job.height}"}
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "p.npy"
        words = [sys.executable, "-m", "rayrace", "render", file.resolve(), "--max-error", limit, *subject.options()]
        words += ["-o", out, "--json", "--max-seconds", seconds]
        path = {**os.environ, "PYTHONPATH": str(ROOT)}
        began, used = time.monotonic(), resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run(list(map(str, words)), cwd=folder, capture_output=True, text=True, env=path)
        row["seconds"] = time.monotonic() - began
        now = resource.getrusage(resource.RUSAGE_CHILDREN)
        row["cpu"] = now.ru_utime + now.ru_stime - used.ru_utime - used.ru_stime
        if done.returncode:
            return {**row, "told": done.stderr.strip().splitlines()[-1].removeprefix("error: ")}
        told, array = json.loads(done.stdout), np.load(out)
    depth = told["error"]["depth"]
    deep, cutoff = DEEP if kind else (depth + 8, 2.0**-18)
    side = SMALL_SIDE if kind in hard_scenes.SMALL else SIDE
    right = subject.truth("numba-parallel", depth and deep, cutoff if depth else 0.0, side)
    got, most = judge.errors(array, *right, None), 1 / int(limit[2:])
    row |= {"method": told["method"], "expected": told["expected"]["rmse"], "rmse": got["rmse"] / most,
            "doubt": got["rmse_standard_error"] / most, "pictures": len(told["pictures"])}  # fmt: skip
    if kept_only:
        return row
    names = told["job"].keys()
    mine = replace(subject.job, **{key: told["job"][key] for key in names - {"region", "threads", "frames", "kernel"}})
    best = hindsight(subject, told["renderer"], mine, most, right, depth, told["job"]["cutoff"] or 2.0**-12)
    ratio = slower(subject, told["renderer"], mine, best)
    named = Method(known[told["renderer"]], best, 0, 0, 0).name
    return {**row, "ratio": ratio, "best": named}


def table(rows: list[dict]) -> str:
    """The rows and their sum, as Markdown."""
    lines = [
        "| scene | limit | pixels | method | error ÷ limit | time ÷ best | s in all | of the processor |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        head, took = f"| {row['scene']} | {row['limit']} | {row['size']} ", f"{row['seconds']:.0f} | {row['cpu']:.0f}"
        if "told" in row:
            lines.append(f"{head}| {row['told']} | | | {took} |")
        else:
            share = f"{row['rmse']:.2f} ± {row['doubt']:.2f}"
            ratio = f"{max(row['ratio'], 1):.2f}" if "ratio" in row else ""
            lines.append(f"{head}| {row['method']} | {share} | {ratio} | {took} |")
    made = [row for row in rows if "told" not in row]
    kept = sum(row["rmse"] <= 1 for row in made)
    ratios = [max(row["ratio"], 1.0) for row in made if "ratio" in row]  # noise apart, none is quicker than the best
    middle, worst = (np.median(ratios), max(ratios)) if ratios else (np.nan, np.nan)
    again = sum(row["pictures"] > 1 for row in made)
    lines += [
        "",
        f"{len(rows)} scenes: {len(made)} promises, {kept} kept ({100 * kept / max(1, len(made)):.0f} %),"
        f" {len(rows) - len(made)} times it told that it cannot. {again} took a second picture.",
        f"Time of the method over that of the best in hindsight, of {len(ratios)} scenes: median {middle:.2f}, largest"
        f" {worst:.2f}.",
    ]
    return "\n".join(lines)


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--scenes", type=int, default=40)
    asked.add_argument("--first", type=int, default=0)
    asked.add_argument("--seed", default="promise")
    asked.add_argument("--limit", help="of each; without it, of LIMITS in turn")
    asked.add_argument("--files", nargs="*", type=Path, help="these scenes in place of random ones")
    asked.add_argument("--hard", action="store_true", help="scenes in which a truth can be wrong")
    asked.add_argument("--kept", action="store_true", help="only whether the promise is kept")
    asked.add_argument("--seconds", type=float, default=240.0, help="that a picture may take")
    asked.add_argument("--read", nargs="*", type=Path, help="print the table of what earlier calls wrote to stderr")
    told, rows = asked.parse_args(), []
    if told.read:
        lines = [line for file in told.read for line in file.read_text().splitlines() if line.startswith("{")]
        print(table([json.loads(line) for line in lines]))
        return
    known = registry.entries(())
    numbers = range(len(told.files)) if told.files else range(told.first, told.first + told.scenes)
    for number in numbers:
        limit = told.limit or LIMITS[number % len(LIMITS)]
        with Sessions() as sessions, tempfile.TemporaryDirectory() as folder:
            if told.files:
                file = told.files[number]
                subject = Subject(load(file), {"shadows": True}, _size(number), known, sessions.run)
            else:
                drawn = hard_subject if told.hard else random_subject
                file, subject = drawn(number, told.seed, Path(folder), known, sessions.run)
            kind = hard_scenes.kind(number) if told.hard else ""
            name = file.name if told.files else f"{number} {kind}".strip()
            rows.append({"scene": name, **examine(file, subject, limit, told.seconds, told.kept or told.hard, kind)})
        print(json.dumps(rows[-1]), file=sys.stderr, flush=True)
    print(table(rows))


if __name__ == "__main__":
    main()
