"""Experiments through a real Slurm: the commands that a user types, and what can happen to jobs.

The two hosts of that Slurm are this machine (slurm_cluster.py), so jobs of two run side by side unless the lock of the
host holds them.
"""

import csv
import itertools
import json
import os
import re
import subprocess
import sys
import time
from collections import Counter
from datetime import datetime
from pathlib import Path

import pytest

from harness.store import lines, store
from harness.store.record import key

pytestmark = pytest.mark.slow
FAKE = " has it by day on a fake cluster (test_campaign.py); Slurm takes 20 s to 2 min"
PROGRAM = Path(sys.executable).with_name("rayrace")
EXPERIMENT = """title = "twenty cells"
renderers = ["numpy", "cpp"]
processes = 2
frames = 1
[generate]
scene = "comparison"
objects = 5
[image]
depth = 2
[sweep]
side = [4, 6, 8, 10, 12, 14, 16, 18, 20, 22]
[slurm]
cells = 6
time = "5 min"
"""


class Shell:
    """Commands in a folder, with the scheduler's environment."""

    def __init__(self, folder, cluster):
        self.folder, self.cluster = folder, cluster
        self.environment = {**os.environ, **cluster.environment}

    def rayrace(self, *words, code=0):
        done = subprocess.run(
            [PROGRAM, *map(str, words)],
            cwd=self.folder,
            env=self.environment,
            capture_output=True,
            text=True,
            timeout=300,
        )
        assert done.returncode == code, f"{words}: exit {done.returncode}\n{done.stdout}\n{done.stderr}"
        return done.stdout + done.stderr

    def slurm(self, *words):
        return self.cluster.ask(*words)

    def status(self, run):
        return json.loads(self.rayrace("status", run, "--json"))

    def rows(self, run):
        folder = self.folder / run
        return store.read(folder, store.hosts(folder))[1]

    def until(self, what, seconds=60):
        end = time.monotonic() + seconds
        while not (found := what()):
            assert time.monotonic() < end, "it did not happen"
            time.sleep(0.2)
        return found


@pytest.fixture
def shell(real_cluster, tmp_path):
    (tmp_path / "e.toml").write_text(EXPERIMENT)
    shell = Shell(tmp_path, real_cluster)
    yield shell
    shell.slurm("scancel", f"--user={os.getuid()}")
    shell.until(lambda: not shell.slurm("squeue", "--noheader"))


@pytest.mark.nightly("test_a_run_of_jobs_is_the_same_run" + FAKE)
def test_twenty_cells_as_on_one_machine(shell):
    """No two repetitions overlap on the host, and the report is that of a local run in all but times."""
    told = shell.rayrace("run", "e.toml", "--executor", "slurm", "--dry-run")
    assert "4 jobs of at most 6 cells, each with a host of its own for at most 0.0833 h" in told
    shell.rayrace("run", "e.toml", "--executor", "slurm", "--out", "far")
    shell.rayrace("run", "e.toml", "--out", "near")
    far, near = shell.rows("far"), shell.rows("near")
    assert {key(row) for row in far} == {key(row) for row in near} and len(far) == 40
    assert {row["status"] for row in far} == {"ok"}

    parts = {path.parent.name for path in (shell.folder / "far").glob("parts/*/run.json")}
    assert len(parts) == 4
    stamps = sorted((datetime.fromisoformat(row["started"]).timestamp(), row["took_s"]) for row in far)
    for (start, took), (next_start, _) in itertools.pairwise(stamps):
        assert start + took <= next_start + 1e-3  # the clock may be slewed meanwhile

    for run in ("far", "near"):
        shell.rayrace("report", run, "-o", f"report-{run}")
    assert files(shell.folder / "report-far") == files(shell.folder / "report-near")
    for name in ("accuracy-0-comparison-objects-5.csv", "machine.csv"):
        assert (shell.folder / "report-far" / name).read_text() == (shell.folder / "report-near" / name).read_text()
    assert sections(shell.folder / "report-far") == sections(shell.folder / "report-near")
    columns = "variant", "point", "status", "reason", "repetition", "pass", "agrees", "error_rmse", "error_max", "rays"
    assert table(shell.folder / "report-far", columns) == table(shell.folder / "report-near", columns)


def files(report):
    return sorted(path.name for path in report.iterdir())


def sections(report):
    """The headings of a report, and the heads of its tables."""
    text = (report / "report.md").read_text().splitlines()
    heads = [line for line, after in itertools.pairwise(text) if after.startswith("| ---")]
    return [line for line in text if line.startswith("#")], heads


def table(report, columns):
    with open(report / "repetitions.csv", newline="") as file:
        return sorted([row[name] for name in columns] for row in csv.DictReader(file))


@pytest.mark.nightly("test_a_job_that_is_cancelled_leaves_what_it_had" + FAKE)
def test_jobs_that_are_cancelled_are_gone_on_with(shell):
    """scancel in mid-run: what had finished is kept, the rest is rows with reasons, and --resume runs these alone."""
    more = ("--set", "processes=12", "--set", "sweep.side=[4,6,8]", "--set", "slurm.cells=2")
    shell.rayrace("run", "e.toml", *more, "--executor", "slurm", "--out", "run", "--detach")
    shell.until(lambda: shell.status("run")["done"] >= 3)
    running = shell.until(lambda: shell.slurm("squeue", "--noheader", "--states=R", "--array", "--format=%i").split())
    shell.slurm("scancel", *running)
    shell.until(lambda: not set(running) & set(shell.slurm("squeue", "-h", "--array", "--format=%i").split()))
    before = {key(row): row["started"] for row in shell.rows("run") if not row.get("lost")}
    told = shell.rayrace("run", "e.toml", *more, "--resume", "run")
    assert re.search(r"of its jobs are still waiting or running|jobs submitted", told)
    killed = [line for line in lines.read(shell.folder / "run" / "jobs.jsonl") if line.get("status") == "killed"]
    assert len(killed) == len(running) and all("scancel" in line["reason"] for line in killed)
    rows = {key(row): row for row in shell.rows("run")}
    assert len(rows) == 3 * (2 * 12 + 12) and {row["status"] for row in rows.values()} == {"ok"}
    assert before.items() <= {name: row["started"] for name, row in rows.items()}.items() and before


@pytest.mark.nightly("test_a_host_that_dies" + FAKE)
def test_a_job_that_is_killed(shell):
    """kill -9: no word of its own, but Slurm's; its renderer is not left running."""
    shell.rayrace(
        "run",
        "e.toml",
        "--set",
        "sweep.side=[4]",
        "--set",
        "processes=40",
        "--executor",
        "slurm",
        "--out",
        "run",
        "--detach",
    )
    shell.until(lambda: shell.status("run")["done"] >= 2)
    mine = [pid for pid in shell.cluster.processes() if "submitit" in command(pid)]
    for pid in mine:
        os.kill(pid, 9)
    shell.until(lambda: not shell.slurm("squeue", "--noheader"))
    told = shell.rayrace("run", "e.toml", "--set", "sweep.side=[4]", "--set", "processes=40", "--resume", "run")
    assert "120 ok" in told  # of two variants, and the pair
    (line,) = [line for line in lines.read(shell.folder / "run" / "jobs.jsonl") if line.get("status")]
    assert line["status"] == "failed" and "before it could say why" in line["reason"]
    assert [pid for pid in shell.cluster.processes() if "renderers" in command(pid)] == []


def command(pid):
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode()
    except OSError:
        return ""


@pytest.mark.nightly("test_what_was_unavailable_is_tried_again" + FAKE)
def test_a_host_without_a_compiler(shell):
    """Rows that say so, of that renderer alone; another time, another host."""
    none = ("--set", 'slurm.setup=["export CXX=/nonexistent/c++"]')
    side = ("--set", "sweep.side=[4, 6]")
    told = shell.rayrace("run", "e.toml", *side, *none, "--executor", "slurm", "--out", "run")
    assert "4 ok, 4 unavailable" in told and "no C++ compiler" in told and "4 repetitions are left" in told
    assert "8 ok" in shell.rayrace("run", "e.toml", *side, "--resume", "run")


@pytest.mark.nightly("tests/hostile/test_faults_disk.py fills disks by day")
def test_a_full_disk(shell):
    """It ends as rows with the reason; with room, the run is gone on with."""
    place = shell.folder / "small"
    place.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=900k", "none", place], capture_output=True).returncode:
        pytest.skip("no file system can be mounted here")
    try:
        side = ("--set", "sweep.side=[80, 120, 160]")
        told = shell.rayrace("run", "e.toml", *side, "--executor", "slurm", "--out", "small/run", code=1)
        assert (
            "no space is left on the disk" in told
            and "are left; go on with: rayrace run " in told
            and "--resume small/run\n" in told
        )
        rows = shell.rows("small/run")
        assert len(rows) == 12 and {row["status"] for row in rows} <= {"ok", "failed"}
        assert any(row["status"] == "failed" for row in rows)
        kept = {key(row): row["started"] for row in rows if row["status"] == "ok"}
        subprocess.run(["mount", "-o", "remount,size=50m", place], check=True)
        assert "12 ok" in shell.rayrace("run", "e.toml", *side, "--resume", "small/run")
        after = {key(row): row["started"] for row in shell.rows("small/run")}
        assert kept.items() <= after.items()
    finally:
        subprocess.run(["umount", "--lazy", place], check=True)


def test_a_job_whose_time_is_up(shell):
    """It begins nothing more that would not end in time, says so, and goes on in a job with more of it."""
    slow = "--set", "sweep.side=[150]", "--set", 'renderers=["python"]', "--set", "slurm.cells=1"
    shell.rayrace("run", "e.toml", *slow, "--set", "processes=1", "--out", "first")  # makes the truth, which is kept
    job = "--set", "processes=160", "--set", 'slurm.time="40 s"', "--executor", "slurm"
    told = shell.rayrace("run", "e.toml", *slow, *job, "--out", "run", code=1)
    assert "its time was up" in told and "timeout" in told
    rows = shell.rows("run")
    done = [row for row in rows if row["status"] == "ok"]
    assert done and {row["status"] for row in rows} == {"ok", "timeout"}
    took = sum(row["took_s"] for row in done)
    assert took < 40


def test_an_experiment_that_was_changed(shell):
    """It is not mixed with what it was."""
    shell.rayrace("run", "e.toml", "--set", "sweep.side=[4]", "--executor", "slurm", "--out", "run")
    told = shell.rayrace("run", "e.toml", "--set", "sweep.side=[6]", "--resume", "run", code=2)
    assert "it cannot be resumed after these changes" in told and "is new" in told and "is gone" in told
    told = shell.rayrace("run", "e.toml", "--resume", "run", "--executor", "local", code=2)
    assert "was submitted through slurm" in told


def test_a_thousand_cells(shell):
    """They are submitted as arrays, none longer than the scheduler takes, and cancelled as one run."""
    many = ("--set", 'renderers=["cpp"]', "--set", f"sweep.seed={list(range(100))}", "--set", "slurm.cells=1")
    held = ("--set", "slurm.options={hold=true}", "--executor", "slurm")
    told = shell.rayrace("run", "e.toml", *many, *held, "--dry-run")
    assert "1000 jobs of at most 1 cells" in told and "at most 83.3 host hours" in told
    shell.rayrace("run", "e.toml", *many, *held, "--out", "run", "--detach")
    jobs = shell.slurm("squeue", "--noheader", "--array", "--format=%i").split()
    arrays = Counter(job.partition("_")[0] for job in jobs)
    assert len(jobs) == 1000 and max(arrays.values()) <= shell.cluster.array and len(arrays) == 3
    status = shell.status("run")
    assert status["done"] == 0 and len(status["jobs"]) == 1000
    assert {told["state"] for told in status["jobs"]} == {"waiting (JobHeldUser)"}
    shell.rayrace("status", "run", "--cancel")
    shell.until(lambda: not shell.slurm("squeue", "--noheader"))
