"""A run: a folder of results that only grows.

    run.json            the experiment, the plan's cells, the environment, when and by what command; `order` of its
                        repetitions; `pair`: the cell that was run twice in each round (A/A), or why none; `left_out`:
                        cells by constraint; `resumed`: each time that it was taken up again; `ended`: when the harness
                        had done what it could, and the state of the machine then
    repetitions.jsonl   one line per repetition, appended and synced when it ends: nothing finished is lost
    pictures/KEY.npy    the picture of each cell, linear float; KEY.flip.npy and KEY.error.flip.npy, its FLIP maps
                        beside its reference and the truth; KEY.dropped.npy, weights that were cut off (CUT-2);
                        KEY.reference.npy and KEY.mask.npy of each reference, KEY.truth.npy and KEY.standard_error.npy
                        of each truth
    series/KEY-N.csv    what the measurer saw (columns in measurer.py); KEY-pair-N and the like of other passes
    logs/KEY-N.stdout, .stderr; likewise

A record has these keys; what is not known is null, with the reason in `status` and `reason`. A line of
repetitions.jsonl leaves out what run.json says of the record's cell.

    cell, repetition, variant, renderer, renderer_version, technology, scene, scene_version, point, parameters, needs
    lines       of the sources of the renderer
    shapes      {sphere, box, polygon, ellipsoid, triangle, csg}: how many a ray is tried against
    lights      how many
    pass        timed; pair: the second process of the A/A pair, which only the noise floor is made of; load: a
                repetition that repeats the frame for the GPU's counters; cold: one with an empty cache of compiled
                code, for what starting costs. Only timed ones are in times
    unranked    null, or why the row takes no part in any comparison: "exhibit: ..", or it ran in a simulator
    status      ok | wrong picture | unsupported | unavailable | failed | timeout | killed
    reason      text; "" if ok
    started     ISO time
    wall_s      from start to end of the process
    took_s      of the whole repetition: job, process, judging; the first of a picture makes its reference too
    phases      [[name, start_s, end_s], ..] since the start of the process, `start` and `exit` added by the harness
    frames_s    durations of the frames, the first one first; of one render, where a frame is a batch
    frame_renders  [renders, ..] of which each frame consists
    frame_parts [{kernel, download} or null, ..]: seconds of the parts of one render of each frame
    cpu         {user_s, system_s, series_s, orphans, orphans_s}: from wait4, of the process and all that it started;
                what the measurer's series comes to; how many of them lost their parent, and their part of the seconds
    memory      {peak_bytes, render_peak_bytes, peak_virtual_bytes, method, at_least_bytes, floor_bytes,
                wait4_peak_bytes}: row.py says how method finds the peak
    rays        {primary, reflected, transmitted, shadow, non_finite}; where first hits are asked for, primary alone
    used, versions, device   what the renderer said
    gpu         null, or {utilisation_percent, power_w, energy_j, energy_s, joules_per_mray, process_memory_bytes,
                temperature_c, throttled}, each a number (throttled: [reason, ..]) or {unavailable: reason}: gpu_use.py
    disturbed   {steal_s, other_cpu_s, waited_s, swapped_pages, held_back_s, throttled}: what the system counted
                meanwhile, each a number or {unavailable: reason}: trouble.py
    peaks       null, or what the machine could do at most just before: {one, all}, rates of one thread and of as many
                as the variant has, or {unavailable: reason}: calibration.py
    build       {seconds, compiler, command}: of the build it ran, when that was made
    picture     {file, sha256}; null of first hits, which are not stored
    accuracy    the judge's verdict with `reference`, `reference_file`, `mask_file`, and psnr_db, ssim, flip (each a
                number or {unavailable: reason}: perception.py) with `flip_file`; or {unavailable: reason}. Of first
                hits max_outside and max_inside are of distances (hits.py), and what is of pictures is null
    error       how far it is from the truth (truth.py): {truth, truth_file, pictures, standard_error,
                standard_error_file, certificate, rmse, max, bad_pixels, relative_mse, rmse_outside, max_outside,
                max_inside, mask_fraction, psnr_db, ssim, flip, flip_file}; or {unavailable: reason}; null without a
                picture
    bound       null, or of a cut-off {radiance, max, mean, dropped_file}: the largest error that it can have made in a
                channel of a pixel, over all pixels, and its mean (bound.py)
    stability   null, or of a cell of [[stress]] {row, level, count, failures, error_median, error_p99, error_max,
                expected, limit}: answers judged and those that are wrong; errors in the unit of the row, and the error
                and the level where the method breaks that theory predicts; each null where there is none. What the row
                is says run.json, under `stability`
    measurer    its audit of itself: {ticks, missed, interval_s, interval_p50_s, interval_p99_s, cpu_s (its own),
                saw_end, resolution_s (of integral_s), integral_s, wait4_s, processes (most at once), mark_bytes
                (largest VmHWM seen), pss_peak_bytes, gpu, gpu_sources}
    series      file of what the measurer saw
    warnings    [text, ..]: what makes the row doubtful
"""

import json
import mmap
import os
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

import numpy as np
import orjson

from harness.errors import UserError

FORMAT = 1
# Mostly the same in all rows of a cell.
REPEATED = {"used", "versions", "build", "device", "shapes", "accuracy", "error", "bound", "stability"}


class Run:
    """A run that is being written."""

    def __init__(self, folder: Path):
        self.folder = Path(folder)
        for name in ("pictures", "series", "logs"):
            (self.folder / name).mkdir(parents=True, exist_ok=True)
        rows = self.folder / "repetitions.jsonl"
        _cut_torn_line(rows)
        self._file = open(rows, "a", encoding="utf-8")  # noqa: SIM115
        self._cells: dict[str, dict] = {}

    def describe(self, **facts) -> None:
        self._cells = _by_key(facts)
        text = json.dumps({"format": FORMAT, **facts}, indent=1, allow_nan=False)
        write_whole(self.folder / "run.json", text + "\n")

    def append(self, record: dict) -> None:
        """Write one repetition, on the disk when this returns."""
        known = self._cells.get(record.get("cell"), {})
        own = {name: value for name, value in record.items() if name == "cell" or known.get(name, self) != value}
        self._file.write(json.dumps(own, allow_nan=False) + "\n")
        self._file.flush()
        os.fsync(self._file.fileno())

    def close(self) -> None:
        self._file.close()


def is_blank(folder: Path) -> bool:
    """Was a run begun here and cut off before it could say what it is? Nothing is in the folder then but its own."""
    own = {"pictures", "series", "logs", "repetitions.jsonl", "run.json.part"}
    if not folder.is_dir() or any(path.name not in own for path in folder.iterdir()):
        return False
    return all(path.is_dir() or path.stat().st_size == 0 or path.suffix == ".part" for path in folder.iterdir())


def _cut_torn_line(rows: Path) -> None:
    """Take away a last line that was cut off, which nobody believes: the next would be written behind it."""
    if not rows.exists() or rows.stat().st_size == 0:
        return
    with open(rows, "r+b") as file:
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as text:
            whole = text.rfind(b"\n") + 1
        file.truncate(whole)


def write_part(path: Path, write: Callable[[BinaryIO], None]) -> None:
    """Let `write` fill the file at `path`, so that it is there whole or not at all."""
    part = path.with_name(path.name + ".part")
    with open(part, "wb") as file:
        write(file)
        file.flush()
        os.fsync(file.fileno())
    os.replace(part, path)


def write_whole(path: Path, text: str) -> None:
    """Write a text file so that it is there whole or not at all."""
    write_part(path, lambda file: file.write(text.encode("utf-8")))


def save_whole(path: Path, array: np.ndarray) -> None:
    """Save an array as .npy so that it is there whole or not at all."""
    write_part(path, lambda file: np.save(file, array))


def read(folder: Path) -> tuple[dict, list[dict]]:
    """run.json and the repetitions of a run; a last line that was cut off is not believed. UserError if no run."""
    folder = Path(folder)
    try:
        facts = json.loads((folder / "run.json").read_text(encoding="utf-8"))
        text = (folder / "repetitions.jsonl").read_bytes()
    except (OSError, ValueError) as error:
        raise UserError(f"{folder}: not a run: {error}", remedy="a run is a folder that `rayrace run` wrote") from None
    if not isinstance(facts, dict) or facts.get("format") != FORMAT:
        raise UserError(f"{folder / 'run.json'}: expected format {FORMAT}")
    whole, _, _ = text.rpartition(b"\n")
    cells = _by_key(facts)
    records, alike = [], {}
    for number, line in enumerate(whole.splitlines(), 1):
        try:
            row = orjson.loads(line)
            record = {**cells.get(row.get("cell"), {}), **row}
        except (ValueError, TypeError, AttributeError):
            raise UserError("a damaged line", file=folder / "repetitions.jsonl", line=number) from None
        for name in REPEATED & record.keys():  # one object for all that are equal: runs can have 100,000 rows
            before = alike.setdefault((record.get("cell"), name), record[name])
            if record[name] == before:
                record[name] = before
        records.append(record)
    return facts, records


def _by_key(facts: dict) -> dict[str, dict]:
    return {cell["cell"]: cell for cell in facts.get("cells", [])}
