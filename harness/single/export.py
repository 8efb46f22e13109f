"""Exports a scene to another program's format, by the renderer whose manifest has an [export] for its suffix."""

import shutil
import sys
from pathlib import Path

import numpy as np

from harness.errors import UserError
from harness.picture import picture
from harness.process import process
from harness.process.scratch import scratch
from harness.renderer import events, job
from harness.renderer.builder import fill
from harness.renderer.parameters import Parameters
from harness.renderer.registry import Entry, Renderer
from harness.system import output


def find(suffix: str, entries: dict[str, Entry]) -> Renderer | None:
    """The first renderer that exports to files with this suffix; None if there is none. entries: variants by name."""
    for entry in entries.values():
        export = entry.renderer.manifest.export
        if export and export.suffix == suffix:
            return entry.renderer
    return None


def write(
    out: Path,
    renderer: Renderer,
    arrays: dict[str, np.ndarray],
    parameters: Parameters,
    needs: tuple[str, ...],
    timeout: float = 600.0,
) -> None:
    """Exports a job to the file `out` with `renderer`. timeout: s. UserError, with its reason, if it fails."""
    picture.check_folder(out)
    with scratch() as here:
        job.write(here / "job", arrays, parameters, needs)
        for name in ("out", "neutral"):
            (here / name).mkdir()
        places = {"folder": str(renderer.folder), "python": sys.executable}
        command = [fill(word, places) for word in renderer.manifest.export.command]
        command += job.flags(here / "job", here / "out", "", None, parameters, needs)
        stdout, stderr = here / "stdout", here / "stderr"
        outcome = process.run(command, here / "neutral", stdout, stderr, timeout, home=renderer.home)
        if outcome.failed:
            raise UserError(f"{out}: {outcome.failed}")
        said = events.read(stdout)
        if outcome.code != 0:
            raise UserError(f"{out}: {renderer.manifest.name} cannot write it: {_why(outcome, said, stderr)}")
        file = here / "out" / Path(said.output or "").name
        if not file.is_file():
            raise UserError(f"{out}: {renderer.manifest.name} wrote no file")
        with open(file, "rb") as made:
            output.write(out, lambda target: shutil.copyfileobj(made, target), own=False)


def _why(outcome: process.Outcome, said: events.Said, stderr: Path) -> str:
    if outcome.timed_out:
        return f"it took more than {outcome.wall_s:.3g} s"
    lines = stderr.read_text(encoding="utf-8", errors="replace").split("\n")
    last = next((line for line in reversed(lines) if line.strip()), "it did not say why")
    return said.error or events.words(last)
