"""A run touches nothing of the user's: neither its own checkout nor folders with names like those of rayrace."""

import hashlib
import json
import os
import random
import secrets
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from left_behind import left_behind

from harness.system import ownership

ROOT = Path(__file__).parents[2]
PACKAGES = "rayrace", "harness", "reports", "renderers", "experiments"


def state(place):
    """All that is below a folder: kind, mode, content, and when it was changed. Python's caches of bytecode apart."""
    found = {}
    for path in sorted([place, *place.rglob("*")]):
        told = path.lstat()
        if "__pycache__" in path.parts:
            continue
        content = os.readlink(path) if path.is_symlink() else ""
        if path.is_file() and not path.is_symlink():
            content = hashlib.sha256(path.read_bytes()).hexdigest()
        changed = None if (path / "__pycache__").exists() or "renderers" in path.parts else told.st_mtime_ns
        found[str(path)] = told.st_mode, told.st_ino, changed, content
    return found


@pytest.fixture
def tmp(tmp_path):
    """A folder for temporary files in which a user keeps folders of theirs."""
    seed = int.from_bytes(os.urandom(4))
    print(f"seed {seed}")
    draw = random.Random(seed)
    tmp = tmp_path / "tmp"
    tmp.mkdir()

    def mine(name, marked=""):
        folder = tmp / name
        folder.mkdir(parents=True)
        for number in range(draw.randrange(1, 4)):
            (folder / f"mine-{number}").write_bytes(draw.randbytes(draw.randrange(5000)))
        if marked:
            (folder / ownership.MARKER).write_text(marked)
        return folder

    def token():
        return f"rayrace-{draw.randbytes(16).hex()}"

    for name in ("rayrace-results", "rayrace-results/20260101-smoke", f"rayrace-{draw.randrange(10**6)}", token()):
        mine(name)
    (tmp / "rayrace-empty").mkdir()
    (tmp / token()).mkdir()
    (tmp / f"rayrace-{secrets.token_hex(8)}").mkdir()  # as version 0.1 called them
    for name in ("rayrace-locked", token()):
        (mine(name) / ".lock").touch()
    (tmp / token()).symlink_to(tmp / "rayrace-results")
    (tmp / "rayrace-link").symlink_to(tmp / "rayrace-locked")
    (tmp / "rayrace-nowhere").symlink_to(tmp / "nowhere")
    (tmp / token()).write_bytes(b"a file")
    real = left_behind(tmp_path / token())
    mark = (real / ownership.MARKER).read_text()
    mine(token(), mark)
    mine("rayrace-main-2", mark)
    mine(real.name, mark)
    mine(token(), json.dumps({"pid": 1, "boot": "", "time": "", "name": "x", "folder": [0, 0]}))
    shutil.rmtree(real)
    return tmp


@pytest.mark.slow
def test_a_run_from_a_checkout_among_temporary_files(tmp, environment):
    """The smoke experiment, from an unpacked archive in the folder for temporary files."""
    checkout = tmp / "rayrace-main"
    for name in PACKAGES:
        shutil.copytree(ROOT / name, checkout / name, ignore=shutil.ignore_patterns("__pycache__"))
    killed = left_behind(tmp / f"rayrace-{secrets.token_hex(16)}")
    before = {path: told for path, told in state(tmp).items() if not path.startswith(str(killed))}
    del before[str(tmp)]
    known = {**environment, "TMPDIR": str(tmp), "PYTHONPATH": str(checkout)}
    known["PYTHONPYCACHEPREFIX"] = str(tmp.parent / "bytecode")  # kept for dozens of processes, outside of the checkout
    known["RAYRACE_CACHE"] = str(tmp.parent / "cache")
    words = [sys.executable, "-P", "-m", "rayrace", "run", "experiments/smoke.toml", "--out", tmp.parent / "run"]
    done = subprocess.run(words, cwd=checkout, env=known, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "12 ok" in done.stdout
    after = state(tmp)
    assert {path: after.get(path) for path in before} == before
    assert not killed.exists()
    more = set(after) - set(before) - {str(tmp)}
    assert not more


@pytest.mark.slow
def test_the_doctor_names_what_stays(tmp, rayrace):
    before = state(tmp)
    del before[str(tmp)]  # whose time of change tells of any temporary file
    told = json.loads(rayrace("doctor", "--json", env={"TMPDIR": str(tmp)}, code=0).stdout)
    (found,) = [one for one in told if one["what"] == "temporary folders"]
    assert found["verdict"] == "doubtful" and before.items() <= state(tmp).items()
    assert "rayrace-results" not in found["found"] and found["found"].count(str(tmp)) >= 6


def test_parts_of_pictures_overwrite_nothing(rayrace, tmp_path):
    for name in ("a.npy.part", "a.tif.part", "run.tar.xz.part"):
        (tmp_path / name).write_text("mine")
    (tmp_path / "s.txt").write_text("CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\n")
    for name in ("a.npy", "a.tif"):
        rayrace("render", "s.txt", "-r", "python", "--width", 3, "--height", 2, "-o", name, cwd=tmp_path, code=0)
    assert {path.name for path in tmp_path.iterdir()} >= {"a.npy", "a.tif"}
    assert all(path.read_text() == "mine" for path in tmp_path.glob("*.part"))


def test_a_report_overwrites_reports_alone(rayrace, tmp_path):
    run = ROOT / "results" / "reference" / "xeon-2x" / "startup.tar.xz"
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "machine.csv").write_text("mine")
    done = rayrace("report", run, "-o", tmp_path / "mine", code=2)
    assert "holds files that do not belong to a report; give -o an empty folder or a new one" in done.stderr
    assert [path.name for path in (tmp_path / "mine").iterdir()] == ["machine.csv"]
    for _ in range(2):  # the second time over the first
        rayrace("report", run, "-o", tmp_path / "new", code=0)
