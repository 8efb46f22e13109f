"""A wall clock that jumps by hours in mid-run, to and fro: durations are of another clock."""

import datetime
import itertools
import json
import subprocess

import faulty
import pytest

from harness.store import store

HOURS = 3600


@pytest.mark.slow
def test_a_clock_that_jumps(rayrace, environment, tmp_path, injected):
    """Rows are in the order in which they ran, with times that are theirs; `started` is what the clock said."""
    file, words = faulty.tiny(tmp_path / "tiny", processes=20)
    clock, folder = faulty.wrong_clock(tmp_path), tmp_path / "run"
    rows = folder / "repetitions.jsonl"
    command = [faulty.PROGRAM, "run", file, "--out", folder, *words]
    started = subprocess.Popen(command, env={**environment, **clock}, stderr=subprocess.PIPE, text=True)
    jumps = [5 * HOURS, -30 * HOURS, 24 * 365 * HOURS, 0]
    there = -1
    for jump in jumps:
        # Of two more at least one began by the clock before.
        faulty.wait_until(lambda there=there: rows.exists() and rows.read_bytes().count(b"\n") >= there + 2)
        (tmp_path / "next").write_text(f"{jump}\n")
        (tmp_path / "next").rename(tmp_path / "wrong")  # at once: an empty file is a clock that is right
        there = rows.read_bytes().count(b"\n")
    _, said = started.communicate(timeout=400)
    assert started.returncode == 0, said
    facts, records = store.read(folder)
    assert len(records) == 60  # the A/A pair with them
    for name in {(record["cell"], record["pass"]) for record in records}:
        mine = [record["repetition"] for record in records if (record["cell"], record["pass"]) == name]
        assert mine == list(range(20))
    for record in records:
        assert record["status"] == "ok" and 0 < record["wall_s"] <= record["took_s"] < 60
        assert all(0 <= start <= end <= record["wall_s"] for _, start, end in record["phases"])
        assert all(0 <= frame < 1 for frame in record["frames_s"])
        assert record["measurer"]["saw_end"] and not any("CPU time" in text for text in record["warnings"])
    stamps = [
        datetime.datetime.fromisoformat(told) for told in (*(r["started"] for r in records), facts["ended"]["at"])
    ]
    off = {round((b - a).total_seconds() / HOURS) for a, b in itertools.pairwise(stamps)}
    assert {5, -35, 24 * 365 + 30, -24 * 365} <= off, off
    left = [line.split(" left")[0].split(", ")[-1] for line in said.splitlines() if " left]" in line]
    assert left and not any("h" in text for text in left), "a time that is left follows the wrong clock"
    (tmp_path / "wrong").write_text(f"{-24 * 365 * HOURS}\n")
    rayrace("run", file, "--resume", folder, *words, "--set", "processes=21", env=clock, code=0)
    assert store.read(folder)[1][:60] == records and len(store.read(folder)[1]) == 63
    rayrace("report", folder, "-o", tmp_path / "report", env=clock, code=0)
    injected("clock that jumps", len(jumps) + 1)


def test_the_clock_of_these_tests_is_wrong(environment, tmp_path):
    program = "import time, datetime, json; print(json.dumps([time.time(), datetime.datetime.now().timestamp()]))"
    clock = faulty.wrong_clock(tmp_path, 7 * HOURS)
    told = subprocess.run(["python3", "-c", program], env={**environment, **clock}, capture_output=True, check=True)
    now = datetime.datetime.now().timestamp()
    assert all(6.9 * HOURS < value - now < 7.1 * HOURS for value in json.loads(told.stdout))
