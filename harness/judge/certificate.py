"""Certifies a truth: recomputes single pixels in 60 digits and compares."""

import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from harness.process import process, repetition
from harness.process.scratch import scratch
from harness.renderer import events, job
from harness.renderer.builder import fill
from harness.renderer.parameters import Parameters
from harness.renderer.registry import Entry, usable_cores

DIGITS = 60
TOLERANCE = 1e-10  # between float64 and 60 digits, in a pixel outside the mask
# Of samples at random places there is no mask, and none is of rays deep enough for chaos: some may differ by more than
# LOOSE.
LOOSE, STRAY = 1e-9, 0.05
GRACE = 600.0  # s: a single pixel may take long


def certify(
    picture: np.ndarray,
    mask: np.ndarray | None,
    entries: dict[str, Entry],
    arrays: dict[str, np.ndarray],
    parameters: Parameters,
    needs: tuple[str, ...],
    count: int,
    seconds: float,
    seed: int = 60,
    stray: bool = False,
) -> dict:
    """Compare seeded pixels of `picture` (height, width, 3) outside `mask` (height, width) with 60 digits.

    mask: None for a picture of samples at random places. count: how many; none is begun after `seconds`. stray: the
    picture has ill-conditioned pixels outside the mask. Returns {"spots", "asked", "largest", "median", "digits",
    "wrong"}: the largest and the median difference of a channel, and how many spots are off by more than TOLERANCE, of
    a stray picture by more than LOOSE, where they are more than a share STRAY; or {"unavailable": reason}.
    """
    wanted = replace(parameters, precision=f"mp{DIGITS}")
    entry = next((e for e in entries.values() if e.renderer.manifest.spots and not e.unavailable), None)
    if entry is None:
        return {"unavailable": "no renderer here works out spots ([spots] of its manifest)"}
    reason = repetition.unsupported(entry, replace(wanted, precision="float64"), needs)
    if reason:
        return {"unavailable": f"{entry.name} {reason}"}
    places = np.argwhere(np.ones(picture.shape[:2], bool) if mask is None else ~mask)
    chosen = np.random.default_rng(seed).permutation(len(places))[:count]
    if not len(chosen):
        return {"unavailable": "every pixel is in the mask"}
    rows = places[chosen]
    x0, y0, _, _ = parameters.bounds()
    spots = np.column_stack([x0 + rows[:, 1], y0 + rows[:, 0]]).astype(np.int32)
    shares = [range(first, len(spots), usable_cores()) for first in range(min(usable_cores(), len(spots)))]
    with ThreadPoolExecutor(len(shares)) as pool:
        answers = list(pool.map(lambda share: work_out(entry, arrays, wanted, needs, spots[share], seconds), shares))
    off = []
    for share, answer in zip(shares, answers, strict=True):
        if isinstance(answer, str):
            return {"unavailable": f"{entry.name}: {answer}"}
        done = rows[share][: len(answer)]
        off.append(np.abs(picture[done[:, 0], done[:, 1]] - answer).max(axis=-1))
    off = np.concatenate(off)
    if not len(off):
        return {"unavailable": f"no spot was done in {seconds:g} s"}
    wrong = int(np.count_nonzero(~(off <= (LOOSE if stray else TOLERANCE))))
    if stray and wrong <= STRAY * len(off):
        wrong = 0
    facts = {"largest": float(off.max()), "median": float(np.median(off)), "digits": DIGITS, "wrong": wrong}
    return {"spots": len(off), "asked": count, **facts}


def work_out(entry: Entry, arrays, parameters: Parameters, needs, spots: np.ndarray, seconds: float):
    """Linear RGB (m, 3) of the first m of `spots` (n, 2), columns and rows; or text, why there are none."""
    with scratch() as here:
        job.write(here / "job", {**arrays, "spots": spots}, parameters, needs)
        for name in ("out", "neutral", "cache"):
            (here / name).mkdir()
        places = {"folder": str(entry.renderer.folder), "python": sys.executable}
        command = [fill(word, places) for word in entry.renderer.manifest.spots.command]
        command += job.flags(here / "job", here / "out", entry.variant.name, here / "cache", parameters, needs)
        stdout, stderr = here / "stdout", here / "stderr"
        command.append(f"--seconds={seconds}")
        outcome = process.run(command, here / "neutral", stdout, stderr, seconds + GRACE, home=entry.renderer.home)
        if outcome.failed or outcome.timed_out or outcome.code != 0:
            said = stderr.read_text(errors="replace").strip().splitlines() if stderr.exists() else []
            return outcome.failed or events.words(said[-1] if said else f"exit {outcome.code}")
        answer, fault = repetition.read_array(here / "out", events.read(stdout).output)
        if fault is None and (answer.dtype != np.float64 or answer.shape != (min(len(answer), len(spots)), 3)):
            fault = f"it answered {answer.dtype} {answer.shape} to {len(spots)} spots"
        return np.array(answer) if fault is None else fault
