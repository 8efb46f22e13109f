"""Writes and reads the result folder of a run, which only grows.

    run.json            the experiment, the plan's cells, the environment, when and by what command; `order` of its
                        repetitions; `pair`: the cell that was run twice in each round (A/A), or why none; `left_out`:
                        cells by constraint; `warnings` of its scenes; `resumed`: the times at which it was resumed;
                        `ended`: when the harness had done all it could, and the state of the machine then
    repetitions.jsonl   one line per repetition, appended and synced when it ends, so nothing finished is lost; of one
                        that others killed and that was run again (--resume), the later line is read
    pictures/KEY.npy    the picture of each cell, linear float; KEY.flip.npy, its FLIP map beside the truth;
                        KEY.dropped.npy, weights that were cut off (CUT-2);
                        KEY.reference.npy, KEY.mask.npy and KEY.span.npy of each reference, KEY.truth.npy and
                        KEY.standard_error.npy of each truth
    series/KEY-N.csv    the measurer's samples (columns in measurer.py); of other passes KEY-pair-N and so on
    logs/KEY-N.stdout, .stderr; likewise
    .lock               held by the process that writes or follows the run (alone.py)

A run can be a stranger's, so only files in its own folder are read (confined.py), within limits (lines.py, arrays.py,
packed.py), and texts pass one gate (clean.py).

A run on a cluster (campaign.py) has more, and its own repetitions.jsonl is empty:

    parts/NAME/         a run of its own, as above, that one job made on one host; end.json in it says how the job ended
    jobs.jsonl          when each job was submitted, and how it ended

It is read as one run: the rows of all parts, with file names relative to the run. Of two rows of one repetition, the
one that ran is valid. A repetition that a job should have run and no job has is a row too, with the reason. Rows of
several hosts are read together only on request.

A record has these keys; an unknown value is null, with the reason in `status` and `reason`. A line of
repetitions.jsonl leaves out the values that run.json has for the record's cell.

    host        that ran it, as fingerprint.py names it; `hosts` of run.json, once read, has its environment
    cell, repetition, variant, renderer, renderer_version, technology, scene, scene_version, point, parameters, needs
    lines       of source code of the renderer
    without     {kind, proof}: of what is left out of its scene or job, which `point` names; proof: why no picture can
                change by it, or "". Cells of whole scenes lack it
    scene_bytes of the scene's numbers, in float64
    shapes      {sphere, box, polygon, ellipsoid, triangle, csg}: number of shapes that a ray is tested against
    lights      number of lights
    pass        timed; pair: the second process of the A/A pair, which only the noise floor uses; load: it repeats the
                frame for the GPU's counters; cold: its cache of compiled code is empty, to measure the cost of
                starting; count: its instructions were counted, and it has no times. Times are from timed passes alone
    unranked    null, or why the row takes no part in any comparison: "exhibit: .." (of a fault), "exhibit of a
                cost: ..", it ran in a simulator, or "its marks contradict ..": contradiction.py
    checked     null, or of the later frame that was named and made again {frame, render, sample}: its number, that of
                the render in it, and the place of its sample (frames.py); or {unavailable: reason}
    status      ok | wrong picture | unsupported | unavailable | failed | timeout | killed
    reason      text; "" if ok
    started     ISO time
    lost        true for a repetition that no job has run; other rows lack the key
    wall_s      from start to end of the process
    took_s      duration of the whole repetition: job, process, judging; the first of a picture includes its reference
    truth_s     part of took_s in which the truth, which cells share, was made and certified; null if it was there
    phases      [[name, start_s, end_s], ..] since the start of the process, `start` and `exit` added by the harness
    frames_s    durations of the frames in order; divided by its renders, where a frame is a batch
    frame_renders  [number of renders in each frame, ..]
    frame_parts [{kernel, download, search, trace} or null, ..]: seconds of the parts of one render of each frame
    cpu         {user_s, system_s, series_s, frame_s, orphans, orphans_s}: from wait4, of the process and its
                descendants; of the measurer's series, the sum, and of one render of the steady frames (null if they are
                too short for two of its looks); number of descendants that lost their parent, and their seconds
    memory      {peak_bytes, render_peak_bytes, peak_virtual_bytes, method, at_least_bytes, floor_bytes,
                wait4_peak_bytes}: row.py explains method
    rays        {primary, reflected, transmitted, shadow, non_finite}; for first hits only primary
    used, versions, device   as the renderer reports them
    counts      null, or of a steady frame {instructions, cycles, branches, branch_misses, cache_misses, rays, spread,
                tool, version, width, height, smaller, options, environment}: counting.py; only rows of the pass count
                have the key, and Valgrind has instructions alone
    operations  null, or of a frame {sums, products, divisions, roots, functions}, floating-point operations of the
                source, one ray after another; or {unavailable: reason}: operations.py; only in rows of the pass count
    gpu         null, or {utilisation_percent, power_w, energy_j, energy_s, joules_per_mray, process_memory_bytes,
                temperature_c, throttled}, each a number (throttled: [reason, ..]) or {unavailable: reason}: gpu_use.py
    energy      null, or of the processor {power_w, energy_j, energy_s, joules_per_frame, joules_per_mray}, each a
                number or {unavailable: reason}; or that alone: energy_use.py
    disturbed   {steal_s, other_cpu_s, waited_s, swapped_pages, held_back_s, throttled, measurer_s}: the system's
                counters during the repetition, each a number or {unavailable: reason}: trouble.py
    peaks       null, or the machine's peak rates just before: {one, all}, of one thread and of the variant's number of
                threads, or {unavailable: reason}: calibration.py
    build       {seconds, compiler, command} of the renderer's build
    picture     {file, sha256}; null for first hits, which are not stored
    agreement   the judge's verdict (ERR-2) with `reference`, `reference_file`, `mask_file`, `span_file` (values of
                perturbed references inside the mask: judge.py); or {unavailable: reason}. For first hits max_outside
                and max_inside are of distances, bad_pixels is the share that hits something else (hits.py), and keys
                of pictures are null
    error       the distance from the truth (ERR-1, truth.py): {truth (its maker), against, depth, truth_file,
                standard_error_file, samples (of a pixel), change, unseen, uncertainty (of the truth, RMS), certificate,
                rmse, rmse_standard_error, below (null, or what the rmse lies below where the truth cannot tell it from
                0), max, bad_pixels, relative_mse, mask_fraction, psnr_db, ssim, flip, flip_file}; of first hits {truth,
                against, max, bad_pixels, mask_fraction}; or {unavailable: reason}
    bound       null, or with a cut-off {radiance, max, mean, dropped_file}: bounds of its error in a channel of a
                pixel, the largest and the mean over all pixels (bound.py)
    stability   null, or for a cell of [[stress]] {row, level, count, failures, error_median, error_p99, error_max,
                expected, limit}: numbers of judged and of wrong answers; errors in the unit of the row; the error and
                the level of failure that theory predicts; each null where there is none. `stability` of run.json
                describes the row
    measurer    its audit of itself: {ticks, missed, interval_s, interval_p50_s, interval_p99_s, cpu_s (its own),
                saw_end, resolution_s (of integral_s), integral_s, wait4_s, processes (most at once), mark_bytes
                (largest VmHWM seen), pss_peak_bytes, vms_peak_bytes, files_peak_bytes, package_energy (null, or why
                there is none), gpu, gpu_sources}
    series      file of the measurer's samples
    warnings    [text, ..]: reasons to doubt the row
"""

import errno
import io
import os
from collections.abc import Collection
from pathlib import Path

import numpy as np

from harness.errors import UserError
from harness.machine import fingerprint
from harness.store import alone, clean, confined, jobs, lines, merge, schema
from harness.store.record import valid
from harness.system import output

FORMAT = 1
LARGEST, HEAVIEST = 1 << 27, 600 << 20  # bytes of run.json, and of memory for its values (clean.py)
# Keys whose values are mostly equal in all rows of a cell.
REPEATED = {"used", "versions", "build", "device", "shapes", "scene_bytes", "agreement", "error", "bound", "stability"}


class Run:
    """A run that is being written."""

    def __init__(self, folder: Path):
        self.folder = Path(folder).resolve() if Path(folder).is_symlink() else Path(folder)
        for name in ("pictures", "series", "logs"):
            output.make_folder(self.folder / name)
        rows = self.folder / "repetitions.jsonl"
        lines.cut_torn(rows)
        self._file = open(output.opened_in_place(rows, lines.APPENDING), "a", encoding="utf-8")  # noqa: SIM115
        self._rows = rows
        self._cells: dict[str, dict] = {}
        self.host: str | None = None

    def describe(self, **facts) -> None:
        """Writes run.json."""
        self._cells = _by_key(facts)
        if "environment" in facts:
            self.host = fingerprint.of(facts["environment"])
        text = lines.as_json({"format": FORMAT, **facts}, indent=1)
        write_whole(self.folder / "run.json", text + "\n")

    def append(self, record: dict) -> None:
        """Writes one repetition; it is on the disk when this returns."""
        cell = self._cells.get(record.get("cell"), {})
        own = {name: value for name, value in record.items() if name == "cell" or cell.get(name, self) != value}
        if os.fstat(self._file.fileno()).st_nlink == 0:  # a write to it would be lost
            raise FileNotFoundError(errno.ENOENT, "it was deleted during the run", str(self._rows))
        self._file.write(lines.as_json(own) + "\n")
        self._file.flush()
        os.fsync(self._file.fileno())

    def close(self) -> None:
        self._file.close()


def is_blank(folder: Path) -> bool:
    """Whether a run was begun here and cut off before run.json was written: the folder has nothing else in it."""
    own = {"pictures", "series", "logs", "repetitions.jsonl", "run.json.part", alone.NAME}
    if not folder.is_dir() or any(path.name not in own for path in folder.iterdir()):
        return False
    return all(path.is_dir() or path.stat().st_size == 0 or path.suffix == ".part" for path in folder.iterdir())


def write_whole(path: Path, text: str) -> None:
    """Writes a text file of a run, which then exists whole or not at all, and is on the disk when this returns."""
    output.text(path, text, sync=True)


def save_whole(path: Path, array: np.ndarray) -> None:
    """Saves an array as .npy, which then exists whole or not at all."""
    npy = io.BytesIO()  # numpy does not report why it could not write a file
    np.save(npy, array)
    output.data(path, npy.getbuffer(), sync=True)


def read(folder: Path, hosts: Collection[str] | None = None) -> tuple[dict, list[dict]]:
    """run.json and the repetitions of a run, without a torn last line.

    hosts: of a run of several hosts, those to pool as one machine. UserError if `folder` is no run, or the run is of
    several hosts and `hosts` is None.
    """
    folder = Path(folder)
    facts, records = _read(folder)
    parts = sorted(path.parent for path in folder.glob("parts/*/run.json"))
    if parts or facts.get("executor"):
        schema.front(facts, folder / "run.json")
        read = [_read(part, f"parts/{part.name}/") for part in parts]
        for part, (its, rows) in zip(parts, read, strict=True):
            schema.part(its, rows, part)
        job_lines = lines.read(folder / jobs.NAME)
        for number, line in enumerate(job_lines, 1):
            schema.job(line, folder / jobs.NAME, number)
        return merge.merged(folder, facts, read, job_lines, hosts)
    return facts, records


def read_complete(folder: Path, hosts: Collection[str] | None = None) -> tuple[dict, list[dict]]:
    """`read` for a report; UserError if a key that the report needs is missing."""
    facts, records = read(folder, hosts)
    schema.complete(facts, records, folder)
    return facts, records


def executor(folder: Path) -> str | None:
    """The name of the executor that a run was submitted to; None if it ran here or has not begun."""
    path = Path(folder) / "run.json"
    return facts_of(Path(folder)).get("executor", {}).get("name") if path.exists() else None


def read_front(folder: Path) -> tuple[dict, list[dict]]:
    """run.json and rows of the front end of a run on a cluster; UserError if it is none."""
    facts, records = _read(Path(folder))
    if "executor" not in facts:
        raise UserError(f"{folder}: not a run on a cluster; it has no jobs")
    return facts, records


def hosts(folder: Path) -> dict[str, dict]:
    """The hosts of a run and their environments, in the order in which they began."""
    folder = Path(folder)
    parts = sorted(folder.glob("parts/*/run.json"))
    return merge.hosts([facts_of(path.parent) for path in parts] or [facts_of(folder)])


def named(folder: Path, host: str) -> list[str] | None:
    """The hosts of a run whose name, or name in rows, is `host`; None if `host` is "" or the run has one host alone.
    UserError if there is none."""
    environments = hosts(folder)
    if not host or len(environments) < 2:
        return None
    names = [name for name, environment in environments.items() if host in (name, environment["host"])]
    if not names:
        raise UserError(f"--host {host}: {folder} has rows of {', '.join(environments)}")
    return names


def _read(folder: Path, prefix: str = "") -> tuple[dict, list[dict]]:
    """run.json and rows of one folder. prefix: put before the names of its files."""
    confined.check(folder)
    facts, file = facts_of(folder), folder / "repetitions.jsonl"
    try:
        confined.opened(file).close()
    except OSError as error:
        raise _no_run(folder, error) from None
    host = {"host": next(iter(facts["hosts"]))} if "hosts" in facts else {}
    cells = _by_key(facts)
    records, alike = [], {}
    for number, row in enumerate(lines.parsed(file), 1):
        if isinstance(row, dict) and "accuracy" in row:  # its name before version 0.2
            row["agreement"] = row.pop("accuracy")
        schema.row(row, file, number)
        record = {**host, **cells.get(row.get("cell"), {}), **row}
        if (outside := confined.stray(record)) is not None:
            raise UserError(f"no file of a run: {outside!r}", file=file, line=number)
        if prefix:
            merge.move(record, prefix)
        for name in REPEATED & record.keys():  # equal values share an object: runs can have 100,000 rows
            before = alike.setdefault((record.get("cell"), name), record[name])
            if record[name] == before:
                record[name] = before
        records.append(record)
    return facts, valid(records)


def facts_of(folder: Path) -> dict:
    """run.json of a folder, with `hosts` for its own host. UserError if it is no run."""
    try:
        text = confined.content(folder / "run.json", LARGEST)
        clean.refuse_heavy(text, HEAVIEST, folder / "run.json")
        facts = clean.parsed(text)
    except OSError as error:
        raise _no_run(folder, error) from None
    except ValueError as error:
        raise _no_run(folder / "run.json", error) from None
    if not isinstance(facts, dict) or facts.get("format") != FORMAT:
        raise UserError(f"{folder / 'run.json'}: expected format {FORMAT}")
    schema.facts(facts, folder / "run.json")
    if environment := facts.get("environment"):
        facts["hosts"] = {fingerprint.of(environment): environment}
    return facts


def _no_run(place: Path, error: Exception) -> UserError:
    return UserError(f"{place}: not a run: {error}", remedy="a run is a folder that `rayrace run` wrote")


def _by_key(facts: dict) -> dict[str, dict]:
    return {cell["cell"]: cell for cell in facts.get("cells", [])}
