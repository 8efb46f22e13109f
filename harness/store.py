"""A run: a folder of results that only grows.

    run.json            the experiment, the plan's cells, the environment, when and by what command; `resumed`: each
                        time that it was taken up again
    repetitions.jsonl   one line per repetition, appended and synced when it ends: nothing finished is lost
    pictures/KEY.npy    the picture of each cell, linear float; KEY.reference.npy and KEY.mask.npy of each reference
    series/KEY-N.csv    what the measurer saw (columns in measurer.py); KEY-load-N.csv of the load pass
    logs/KEY-N.stdout, .stderr; KEY-load-N of the load pass

A line of repetitions.jsonl has these keys; what is not known is null, with the reason in `status` and `reason`:

    cell, repetition, variant, renderer, renderer_version, technology, scene, scene_version, point, parameters, needs
    shapes      {sphere, box, polygon, ellipsoid, triangle, csg}: how many a ray is tried against
    pass        timed, or load: a repetition that repeats the frame for the GPU's counters, and is in no times
    unranked    null, or why the row takes no part in any comparison: "exhibit: ..", or it ran in a simulator
    status      ok | wrong picture | unsupported | unavailable | failed | timeout | killed
    reason      text; "" if ok
    started     ISO time
    wall_s      from start to end of the process
    phases      [[name, start_s, end_s], ..] since the start of the process, `start` and `exit` added by the harness
    frames_s    durations of the frames, the first one first
    frame_parts [{kernel, download} or null, ..]: seconds of the parts of each frame
    cpu         {user_s, system_s, series_s}: from wait4, and what the measurer last saw
    memory      {peak_bytes, render_peak_bytes, peak_virtual_bytes, method, floor_bytes, wait4_peak_bytes}
    rays        {primary, reflected, transmitted, shadow, non_finite}
    used, versions, device   what the renderer said
    gpu         null, or {utilisation_percent, power_w, energy_j, energy_s, joules_per_mray, process_memory_bytes,
                temperature_c, throttled}, each a number (throttled: [reason, ..]) or {unavailable: reason}: gpu_use.py
    disturbed   {steal_s, other_cpu_s, waited_s, swapped_pages, throttled}: what the system counted meanwhile, each a
                number or {unavailable: reason}: trouble.py
    build       {seconds, compiler, command}: of the build it ran, when that was made
    picture     {file, sha256}
    accuracy    the judge's verdict with `reference`, `reference_file`, `mask_file`, or {unavailable: reason}
    measurer    its audit of itself
    series      file of what the measurer saw
    warnings    [text, ..]: what makes the row doubtful
"""

import json
import mmap
import os
from pathlib import Path

import numpy as np

from harness.errors import UserError

FORMAT = 1


class Run:
    """A run that is being written."""

    def __init__(self, folder: Path):
        self.folder = Path(folder)
        for name in ("pictures", "series", "logs"):
            (self.folder / name).mkdir(parents=True, exist_ok=True)
        rows = self.folder / "repetitions.jsonl"
        _cut_torn_line(rows)
        self._file = open(rows, "a", encoding="utf-8")  # noqa: SIM115

    def describe(self, **facts) -> None:
        text = json.dumps({"format": FORMAT, **facts}, indent=1, allow_nan=False)
        write_whole(self.folder / "run.json", text + "\n")

    def append(self, record: dict) -> None:
        """Write one repetition, on the disk when this returns."""
        self._file.write(json.dumps(record, allow_nan=False) + "\n")
        self._file.flush()
        os.fsync(self._file.fileno())

    def close(self) -> None:
        self._file.close()


def _cut_torn_line(rows: Path) -> None:
    """Take away a last line that was cut off, which nobody believes: the next would be written behind it."""
    if not rows.exists() or rows.stat().st_size == 0:
        return
    with open(rows, "r+b") as file:
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as text:
            whole = text.rfind(b"\n") + 1
        file.truncate(whole)


def write_whole(path: Path, text: str) -> None:
    """Write a file so that it is there whole or not at all."""
    part = path.with_name(path.name + ".part")
    with open(part, "w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    os.replace(part, path)


def save_whole(path: Path, array: np.ndarray) -> None:
    """Save an array as .npy so that it is there whole or not at all."""
    part = path.with_name(path.name + ".part")
    with open(part, "wb") as file:
        np.save(file, array)
    os.replace(part, path)


def read(folder: Path) -> tuple[dict, list[dict]]:
    """run.json and the repetitions of a run; a last line that was cut off is not believed. UserError if no run."""
    folder = Path(folder)
    try:
        facts = json.loads((folder / "run.json").read_text(encoding="utf-8"))
        text = (folder / "repetitions.jsonl").read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        raise UserError(f"{folder}: not a run: {error}", remedy="a run is a folder that `rayrace run` wrote") from None
    if not isinstance(facts, dict) or facts.get("format") != FORMAT:
        raise UserError(f"{folder / 'run.json'}: expected format {FORMAT}")
    records = []
    whole, _, _ = text.rpartition("\n")
    for number, line in enumerate(whole.splitlines(), 1):
        try:
            records.append(dict(json.loads(line)))
        except (ValueError, TypeError):
            raise UserError("a damaged line", file=folder / "repetitions.jsonl", line=number) from None
    return facts, records
