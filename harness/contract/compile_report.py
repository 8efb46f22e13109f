"""Reports registers, memory and occupancy of GPU kernels by compiling them, without a GPU: `rayrace doctor --cuda`.

Every renderer whose manifest has an [inspect] command compiles the kernels of some jobs for some compute capabilities
and says what came of each (renderers/README.md, event `kernel`). Registers, spills and occupancy bound how fast a
kernel can be; how fast it is, only a GPU tells.
"""

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from harness.errors import UserError
from harness.process import process, repetition
from harness.process.scratch import scratch
from harness.renderer import events, job
from harness.renderer.builder import fill
from harness.renderer.parameters import Parameters
from harness.renderer.registry import Entry
from harness.scene import load, text
from harness.scene.flatten import flatten
from harness.scene.generate.comparison import comparison
from harness.scene.needs import needs

TARGETS = ("sm_75", "sm_80", "sm_90", "sm_100")
TIMEOUT = 300.0  # s
SIDE = 512  # pixels

# One shape of each kind, of a clear and of a tinted material, and a light with a radius.
EVERYTHING = """CAMERA (0,0,0) (2,0,0) (0,2,0) (0,0,6)
AIR 1 1 (1,1,1)
AMBIENT (0.2,0.2,0.2)
LIGHT (3,4,5) (0.9,0.9,0.9) 0.5
SPHERE (-1,0,0) 0.6 (0.1,0.1,0.1) 0.9 40 (1,1,1) 2.25 1
BOX (0,0,0) (0.8,0,0.1) (0,0.7,0) (-0.1,0,0.9) (0.2,0.3,0.4) 0.7 30 (0,0,0) 400 1 0.25
POLYGON 3 (-2,-1,-2) (2,-1,-2) (0,2,-2) (0.7,0.5,0.3) 0.3 20 (0,0,0) 9 1
ELLIPSOID (1,1,0) (0.3,0,0) (0,0.5,0) (0,0,0.4) (0.1,0.1,0.1) 0.9 40 (0.8,0.6,0.9) 1.9 1
AND SPHERE (0,-1,0) 0.5 NOT SPHERE (0.3,-1,0.2) 0.4 END END (0.1,0.1,0.1) 0.9 40 (1,1,1) 2.25 1
"""


@dataclass(frozen=True)
class Case:
    """One job to compile for."""

    name: str
    scene: object
    parameters: Parameters


def cases(scenes: tuple[Path, ...] = ()) -> list[Case]:
    """The comparison scene's mirrors in all memories, with shadows, then every kind of shape and light; or `scenes`."""
    size = {"width": SIDE, "height": SIDE}
    precisions = "float32", "float64"
    if scenes:
        loaded = [(path.name, load(path)) for path in scenes]
        return [Case(name, scene, Parameters(**size, precision=p)) for name, scene in loaded for p in precisions]
    mirrors, everything = text.read(comparison(), "comparison"), text.read(EVERYTHING, "everything")
    listed = []
    for p in precisions:
        for memory in ("constant", "global", "shared"):
            listed.append(Case("mirrors", mirrors, Parameters(**size, precision=p, scene_memory=memory)))
        listed.append(Case("mirrors, shadows", mirrors, Parameters(**size, precision=p, shadows=True)))
        for walk in ("stack", "table"):
            listed.append(Case("every shape", everything, Parameters(**size, precision=p, depth=6, walk=walk)))
        full = {"shadows": True, "feelers": 4, "glossy_rays": 2, "depth": 3, "lens_radius": 0.1, "focal_distance": 6.0}
        listed.append(
            Case("everything", everything, Parameters(**size, precision=p, sampler="jittered", samples=2, **full))
        )
    return listed


def find(entries: dict[str, Entry]) -> list[Entry]:
    """The variants that can be inspected. UserError if there is none."""
    variants = [
        entry
        for entry in entries.values()
        if entry.renderer.manifest.inspect and entry.variant.device == "cuda" and not entry.variant.exhibit
    ]
    if not variants:
        raise UserError("no renderer for a GPU that tells what its kernels take ([inspect] in its renderer.toml)")
    return variants


def examine(entries: list[Entry], wanted: list[Case], targets: tuple[str, ...]) -> Iterator[dict]:
    """A row for each kernel and target: `status` "ok", or "unavailable" or "failed" with the reason.

    Of a renderer that cannot do the first job, the rest is not tried.
    """
    for entry in entries:
        for number, case in enumerate(wanted):
            parameters, needed = case.parameters, needs(case.scene, case.parameters)
            row = {
                "variant": entry.name,
                "case": case.name,
                "precision": parameters.precision,
                "scene_memory": parameters.scene_memory,
                "walk": parameters.walk,
                "block": f"{parameters.block_width}x{parameters.block_height}",
            }
            missing = entry.missing or repetition.unsupported(entry, parameters, needed)
            none = [], "unavailable", missing
            kernels, status, reason = none if missing else _inspect(entry, case, needed, targets)
            for kernel in kernels:
                yield {**row, **kernel, "status": "ok", "reason": None}
            if status != "ok":
                yield {**row, "status": status, "reason": reason}
            if number == 0 and not kernels:
                break


def _inspect(entry: Entry, case: Case, needed: tuple[str, ...], targets: tuple[str, ...]):
    """The kernels of a job; "ok", or what went wrong and why."""
    with scratch() as here:
        given = entry.renderer.given(case.parameters, needed)
        job.write(here / "job", flatten(case.scene), case.parameters, given)
        for name in ("out", "neutral"):
            (here / name).mkdir()
        places = {"folder": str(entry.renderer.folder), "python": sys.executable}
        command = [fill(word, places) for word in entry.renderer.manifest.inspect.command]
        command += job.flags(here / "job", here / "out", entry.variant.name, None, case.parameters, given)
        command.append("--targets=" + ",".join(targets))
        stdout, stderr = here / "stdout", here / "stderr"
        outcome = process.run(command, here / "neutral", stdout, stderr, TIMEOUT, home=entry.renderer.home)
        if outcome.failed:
            return [], "failed", outcome.failed
        said = events.read(stdout)
        if outcome.timed_out:
            return said.kernels, "failed", f"killed after {outcome.wall_s:.3g} s"
        if outcome.code != 0 or said.faults:
            last = stderr.read_text(encoding="utf-8", errors="replace").strip().splitlines()[-1:]
            reason = said.error or events.words((last or said.faults or ["it did not say why"])[0])
            return said.kernels, "unavailable" if outcome.code == repetition.UNSUPPORTED else "failed", reason
    return said.kernels, "ok", None
