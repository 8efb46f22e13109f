"""The result folder of a run, which only grows.

    run.json            the experiment, the plan's cells, the environment, when and by what command; `order` of its
                        repetitions; `pair`: the cell that was run twice in each round (A/A), or why none; `left_out`:
                        cells by constraint; `warnings` of its scenes; `resumed`: each time that it was taken up again;
                        `ended`: when the harness had done what it could, and the state of the machine then
    repetitions.jsonl   one line per repetition, appended and synced when it ends: nothing finished is lost
    pictures/KEY.npy    the picture of each cell, linear float; KEY.flip.npy and KEY.error.flip.npy, its FLIP maps
                        beside its reference and the truth; KEY.dropped.npy, weights that were cut off (CUT-2);
                        KEY.reference.npy, KEY.mask.npy and KEY.span.npy of each reference, KEY.truth.npy and
                        KEY.standard_error.npy of each truth
    series/KEY-N.csv    what the measurer saw (columns in measurer.py); KEY-pair-N and the like of other passes
    logs/KEY-N.stdout, .stderr; likewise
    .lock               held by the process that is at work on the run (alone.py)

A run can be a stranger's: it is read as far as it lies in its folder (confined.py).

A run on a cluster (campaign.py) has more, and its own repetitions.jsonl is empty:

    parts/NAME/         a run of its own, as above, that one job made on one host; end.json in it says how the job ended
    jobs.jsonl          what was submitted, and how each job ended

It is read as one: rows of all parts, their files by where they lie. Where two are of the same repetition, the one that
ran stands. What a job should have run and has not is a row too, with the reason, until another has. Rows of several
hosts are read together only if that is asked for.

A record has these keys; what is not known is null, with the reason in `status` and `reason`. A line of
repetitions.jsonl leaves out what run.json says of the record's cell.

    host        of the row: what fingerprint.py calls it. run.json has under `hosts` what it is, when read
    cell, repetition, variant, renderer, renderer_version, technology, scene, scene_version, point, parameters, needs
    lines       of the sources of the renderer
    shapes      {sphere, box, polygon, ellipsoid, triangle, csg}: how many a ray is tried against
    lights      how many
    pass        timed; pair: the second process of the A/A pair, which only the noise floor is made of; load: a
                repetition that repeats the frame for the GPU's counters; cold: one with an empty cache of compiled
                code, for what starting costs. Only timed ones are in times
    unranked    null, or why the row takes no part in any comparison: "exhibit: ..", it ran in a simulator, or
                "its marks contradict ..": contradiction.py
    status      ok | wrong picture | unsupported | unavailable | failed | timeout | killed
    reason      text; "" if ok
    started     ISO time
    lost        true of a row that no job has run; in others it is not there
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
    accuracy    the judge's verdict with `reference`, `reference_file`, `mask_file`, `span_file` (what perturbed
                references have inside the mask: judge.py), and psnr_db, ssim, flip (each a number or
                {unavailable: reason}: perception.py) with `flip_file`; or {unavailable: reason}. Of first hits
                max_outside and max_inside are of distances (hits.py), and what is of pictures is null
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

import errno
import io
import os
import secrets
from collections.abc import Callable, Collection
from pathlib import Path
from typing import BinaryIO

import numpy as np
import orjson

from harness.errors import UserError
from harness.machine import fingerprint
from harness.store import alone, confined, jobs, lines, merge, schema

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
        lines.cut_torn(rows)
        self._file = open(rows, "a", encoding="utf-8")  # noqa: SIM115
        self._cells: dict[str, dict] = {}
        self.host: str | None = None

    def describe(self, **facts) -> None:
        """Write run.json."""
        self._cells = _by_key(facts)
        if "environment" in facts:
            self.host = fingerprint.of(facts["environment"])
        text = lines.as_json({"format": FORMAT, **facts}, indent=1)
        write_whole(self.folder / "run.json", text + "\n")

    def append(self, record: dict) -> None:
        """Write one repetition, on the disk when this returns."""
        known = self._cells.get(record.get("cell"), {})
        own = {name: value for name, value in record.items() if name == "cell" or known.get(name, self) != value}
        if os.fstat(self._file.fileno()).st_nlink == 0:  # what is written to it now is nowhere
            raise FileNotFoundError(errno.ENOENT, "it was deleted during the run", self._file.name)
        self._file.write(lines.as_json(own) + "\n")
        self._file.flush()
        os.fsync(self._file.fileno())

    def close(self) -> None:
        self._file.close()


def is_blank(folder: Path) -> bool:
    """Was a run begun here and cut off before it could say what it is? Nothing is in the folder then but its own."""
    own = {"pictures", "series", "logs", "repetitions.jsonl", "run.json.part", alone.NAME}
    if not folder.is_dir() or any(path.name not in own for path in folder.iterdir()):
        return False
    return all(path.is_dir() or path.stat().st_size == 0 or path.suffix == ".part" for path in folder.iterdir())


def write_part(path: Path, write: Callable[[BinaryIO], None], own: bool = True) -> None:
    """Let `write` fill the file at `path`, so that it is there whole or not at all.

    own: the folder is rayrace's, where PATH.part can only be of a process that was killed. In a folder of the user's
    the part has a name that no file has.
    """
    name = f"{path.name}.part" if own else f"{path.name}.{secrets.token_hex(8)}.part"
    part, mode = path.with_name(name), "wb" if own else "xb"
    try:
        try:
            with open(part, mode) as file:
                write(file)
                file.flush()
                os.fsync(file.fileno())
            os.replace(part, path)
        except FileExistsError:
            raise
        except BaseException:
            part.unlink(missing_ok=True)  # a disk that is full needs the room
            raise
    except OSError as error:
        error.strerror = error.strerror or str(error)  # which are one where a library raised it
        error.filename = error.filename or str(path)
        raise


def write_whole(path: Path, text: str) -> None:
    """Write a text file so that it is there whole or not at all."""
    write_part(path, lambda file: file.write(text.encode("utf-8")))


def save_whole(path: Path, array: np.ndarray) -> None:
    """Save an array as .npy so that it is there whole or not at all."""
    npy = io.BytesIO()  # into a file, numpy would not say why it could not write
    np.save(npy, array)
    write_part(path, lambda file: file.write(npy.getbuffer()))


def read(folder: Path, hosts: Collection[str] | None = None) -> tuple[dict, list[dict]]:
    """run.json and the repetitions of a run; a last line that was cut off is not believed.

    hosts: of a run of several, those whose rows are wanted, taken as one machine. UserError if it is no run, or one of
    several hosts and they are not named.
    """
    folder = Path(folder)
    facts, records = _read(folder)
    parts = sorted(path.parent for path in folder.glob("parts/*/run.json"))
    if parts or facts.get("executor"):
        schema.front(facts, folder / "run.json")
        read = [_read(part, f"parts/{part.name}/") for part in parts]
        for part, (its, mine) in zip(parts, read, strict=True):
            schema.part(its, mine, part)
        told = lines.read(folder / jobs.NAME)
        for number, line in enumerate(told, 1):
            schema.job(line, folder / jobs.NAME, number)
        return merge.merged(folder, facts, read, told, hosts)
    return facts, records


def read_complete(folder: Path, hosts: Collection[str] | None = None) -> tuple[dict, list[dict]]:
    """`read` of a run with all that a report is made of; UserError for one without."""
    facts, records = read(folder, hosts)
    schema.complete(facts, records, folder)
    return facts, records


def executor(folder: Path) -> str | None:
    """Returns the executor that a run was submitted through; None if it ran here or has not begun."""
    path = Path(folder) / "run.json"
    return facts_of(Path(folder)).get("executor", {}).get("name") if path.exists() else None


def read_front(folder: Path) -> tuple[dict, list[dict]]:
    """Reads the front end's files of a run on a cluster; UserError if it is none."""
    facts, records = _read(Path(folder))
    if "executor" not in facts:
        raise UserError(f"{folder}: a run of this machine alone, without jobs")
    return facts, records


def hosts(folder: Path) -> dict[str, dict]:
    """The hosts of a run and their environments, as run.json has it, in the order in which they began."""
    folder = Path(folder)
    parts = sorted(folder.glob("parts/*/run.json"))
    return merge.hosts([facts_of(path.parent) for path in parts] or [facts_of(folder)])


def named(folder: Path, host: str) -> list[str] | None:
    """The hosts of a run that are called `host`, by its name or as rows have it; None if none is asked for, or if the
    run is of one host alone. UserError if there is none."""
    known = hosts(folder)
    if not host or len(known) < 2:
        return None
    found = [name for name, told in known.items() if host in (name, told["host"])]
    if not found:
        raise UserError(f"--host {host}: {folder} has rows of {', '.join(known)}")
    return found


def _read(folder: Path, prefix: str = "") -> tuple[dict, list[dict]]:
    """Reads one folder. prefix: of the names of its files."""
    confined.check(folder)
    facts = facts_of(folder)
    try:
        text = (folder / "repetitions.jsonl").read_bytes()
    except OSError as error:
        raise _no_run(folder, error) from None
    whole, _, _ = text.rpartition(b"\n")
    host = {"host": next(iter(facts["hosts"]))} if "hosts" in facts else {}
    cells = _by_key(facts)
    records, alike = [], {}
    for number, line in enumerate(whole.splitlines(), 1):
        try:
            row = orjson.loads(line)
            if not isinstance(row, dict):
                raise ValueError
        except ValueError:
            raise UserError("a damaged line", file=folder / "repetitions.jsonl", line=number) from None
        schema.row(row, folder / "repetitions.jsonl", number)
        record = {**host, **cells.get(row.get("cell"), {}), **row}
        if (outside := confined.stray(record)) is not None:
            raise UserError(f"no file of a run: {outside!r}", file=folder / "repetitions.jsonl", line=number)
        if prefix:
            merge.move(record, prefix)
        for name in REPEATED & record.keys():  # one object for all that are equal: runs can have 100,000 rows
            before = alike.setdefault((record.get("cell"), name), record[name])
            if record[name] == before:
                record[name] = before
        records.append(record)
    return facts, records


def facts_of(folder: Path) -> dict:
    """run.json of a folder, with its own host. UserError if it is no run."""
    try:
        facts = orjson.loads((folder / "run.json").read_bytes())
    except OSError as error:
        raise _no_run(folder, error) from None
    except ValueError as error:
        raise _no_run(folder / "run.json", error) from None
    if not isinstance(facts, dict) or facts.get("format") != FORMAT:
        raise UserError(f"{folder / 'run.json'}: expected format {FORMAT}")
    schema.facts(facts, folder / "run.json")
    if told := facts.get("environment"):
        facts["hosts"] = {fingerprint.of(told): told}
    return facts


def _no_run(place: Path, error: Exception) -> UserError:
    return UserError(f"{place}: not a run: {error}", remedy="a run is a folder that `rayrace run` wrote")


def _by_key(facts: dict) -> dict[str, dict]:
    return {cell["cell"]: cell for cell in facts.get("cells", [])}
