"""A run that was cut off goes on: nothing twice, nothing lost, and nothing mixed with what has changed."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from harness.store import store

PROGRAM = Path(sys.executable).with_name("rayrace")
MORE = 'timeout = "30 s"\n[sweep]\ndepth = [0, 1]\n'


def finished(folder):
    return [(record["cell"], record["repetition"]) for record in store.read(folder)[1] if record["pass"] == "timed"]


@pytest.mark.slow
@pytest.mark.parametrize("rows_before", [0, 1, 5])
def test_killed_at_any_time_and_resumed(rayrace, experiment, environment, tmp_path, rows_before):
    file, folder = experiment(["python"], MORE, processes=40), tmp_path / "run"
    started = subprocess.Popen([PROGRAM, "run", file, "--out", folder], env=environment, stderr=subprocess.DEVNULL)
    rows = folder / "repetitions.jsonl"
    for _ in range(12000):
        if rows.exists() and (folder / "run.json").exists() and rows.read_bytes().count(b"\n") >= rows_before:
            break
        time.sleep(0.01)
    os.kill(started.pid, signal.SIGKILL)
    assert started.wait() == -signal.SIGKILL, "it ended before it was killed"
    before = rows.read_bytes()
    rows.write_bytes(before + b'{"cell": "torn')
    processes = 4 + before.count(b"\n") // 3  # more than it has had, of two points and the A/A pair
    words = "--set", f"processes={processes}", "--resume", folder
    rayrace("run", file, *words, code=0)
    assert rows.read_bytes().startswith(before)
    done = finished(folder)
    assert len(done) == len(set(done)) == 2 * processes
    again = json.loads((folder / "run.json").read_text())["resumed"]
    assert len(again) == 1 and again[0]["command"][-1] == str(folder)
    rayrace("run", file, "--report", *words, code=0)
    assert finished(folder) == done


@pytest.mark.nightly("test_killed_at_any_instant (tests/hostile) has 15 kills by day")
def test_killed_at_twenty_random_instants(rayrace, experiment, environment, tmp_path):
    """Each kill meets what the one before it left: what is there is whole and stays, nothing is there twice."""
    seed = 50
    rng = random.Random(seed)
    print("seed", seed)
    file, folder = experiment(["python"], MORE, processes=40), tmp_path / "run"
    rows, before, late = folder / "repetitions.jsonl", b"", 0
    for number in range(20):
        words = ["--resume" if folder.exists() else "--out", folder]
        with subprocess.Popen(
            [PROGRAM, "run", file, *words], env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        ) as started:
            if number % 2:  # in its start, else while it measures
                time.sleep(rng.uniform(0, 1.5))
            else:
                wanted = before.count(b"\n") + rng.randrange(1, 4)
                for _ in range(1000):
                    if rows.exists() and rows.read_bytes().count(b"\n") >= wanted:
                        break
                    time.sleep(0.01)
                time.sleep(rng.uniform(0, 0.3))
            os.kill(started.pid, signal.SIGKILL)
        now = rows.read_bytes() if rows.exists() else b""
        whole = before[: before.rfind(b"\n") + 1]
        assert now.startswith(whole), f"kill {number}"
        for line in now[: now.rfind(b"\n") + 1].splitlines():
            json.loads(line)
        late += now.count(b"\n") == 80
        before = now
    assert not late, "it ended before it was killed: make the run longer"
    rayrace("run", file, "--resume", folder, "--report", code=0)
    done = finished(folder)
    assert len(done) == len(set(done)) and {cell: sum(c == cell for c, _ in done) for cell, _ in done} == dict.fromkeys(
        {cell for cell, _ in done}, 40
    )
    for record in store.read(folder)[1]:
        assert record["status"] == "ok" and (folder / record["series"]).read_text().endswith("\n")


def test_cut_off_before_it_was_a_run(rayrace, experiment, tmp_path):
    """The folder is there, and does not say yet of what: the run begins. A folder of anything else is none."""
    file = experiment(["python"])
    for files in ([], ["repetitions.jsonl"], ["repetitions.jsonl", "run.json.part"]):
        folder = tmp_path / f"run{len(files)}"
        (folder / "logs").mkdir(parents=True)
        for name in files:
            (folder / name).write_text("{" if name.endswith(".part") else "")
        assert "1 of 1 processes" in rayrace("run", file, "--resume", folder, "--dry-run", code=0).stdout
        rayrace("run", file, "--resume", folder, code=0)
        assert len(finished(folder)) == 1 and not list(folder.glob("*.part"))
    for name in ("notes.txt", "repetitions.jsonl"):
        other = tmp_path / name.partition(".")[0]
        other.mkdir()
        (other / name).write_text("something")
        assert "not a run" in rayrace("run", file, "--resume", other, code=2).stderr


def test_more_processes_and_another_point_are_what_is_missing(rayrace, experiment, tmp_path):
    file, folder = experiment(["python"], MORE), tmp_path / "run"
    rayrace("run", file, "--out", folder, code=0)
    assert len(finished(folder)) == 2
    words = "--set", "processes=2", "--set", "sweep={depth=[0, 1, 2]}"
    rayrace("run", file, "--resume", folder, *words, code=0)
    done = finished(folder)
    assert len(done) == len(set(done)) == 6 and len(json.loads((folder / "run.json").read_text())["cells"]) == 3


def test_a_picture_that_was_cut_off_is_made_again(rayrace, experiment, tmp_path):
    file, folder = experiment(["python"]), tmp_path / "run"
    rayrace("run", file, "--out", folder, code=0)
    (record,) = store.read(folder)[1]
    picture = folder / record["picture"]["file"]
    whole = picture.read_bytes()
    (folder / "repetitions.jsonl").write_bytes(b"")
    picture.with_name(picture.name + ".part").write_bytes(whole[:90])
    picture.unlink()
    rayrace("run", file, "--resume", folder, code=0)
    assert picture.read_bytes() == whole and not list(folder.rglob("*.part"))


def refused(rayrace, file, folder, *words):
    rows = (folder / "repetitions.jsonl").read_bytes()
    done = rayrace("run", file, "--resume", folder, *words, code=2)
    assert (folder / "repetitions.jsonl").read_bytes() == rows and "start a new run" in done.stderr
    return done.stderr


def test_nothing_changed_is_mixed_in(rayrace, experiment, write, tmp_path, bad_folder):
    renderer = bad_folder("bad-chatter")
    file, folder = experiment(["bad-chatter"]), tmp_path / "run"
    rayrace("run", file, "--out", folder, "--renderer", renderer)
    assert len(finished(folder)) == 1
    words = "--set", "processes=2", "--renderer", renderer

    assert "bad-chatter, scene: parameters.depth was 1, is 3" in refused(
        rayrace, file, folder, *words, "--set", "image.depth=3"
    )

    with open(renderer / "main.py", "a", encoding="utf-8") as source:
        source.write("# edited\n")
    assert "bad-chatter, scene: renderer_version was " in refused(rayrace, file, folder, *words)

    scene = tmp_path / "scene.txt"
    scene.write_text(scene.read_text().replace("0.7)", "0.8)"))
    said = refused(rayrace, file, folder, *words)
    assert "bad-chatter, scene: scene_version was " in said and "renderer_version was " in said

    facts = json.loads((folder / "run.json").read_text())
    facts["environment"]["cpu"] = "another"
    facts["environment"]["packages"]["numpy"] = "0.1"
    facts["environment"]["compilers"]["c++"] = "unavailable: [Errno 5] Input/output error: '/usr/bin/c++'"
    (folder / "run.json").write_text(json.dumps(facts))
    said = refused(rayrace, file, folder, *words)
    assert 'this machine: cpu was "another", is ' in said and 'this machine: packages.numpy was "0.1", is ' in said
    assert "compilers" not in said, "an error as it was read is no change"


@pytest.mark.alone
def test_a_budget_makes_a_thinner_study_that_can_be_gone_on_with(rayrace, experiment, tmp_path):
    file, folder = experiment(["python"], MORE, processes=30), tmp_path / "run"
    said = rayrace("run", file, "--out", folder, "--max-minutes", 0.1, code=0).stdout
    done = finished(folder)
    turns = {cell: max(n for other, n in done if other == cell) for cell, _ in done}
    assert 2 <= len(done) < 60 and len(turns) == 2 and max(turns.values()) - min(turns.values()) <= 1
    left = 90 - len(store.read(folder)[1])  # the A/A pair is one cell more
    assert f"{left} repetitions are left; go on with: rayrace run {file} --resume {folder}\n" in said
    said = rayrace("run", file, "--resume", folder, "--set", "processes=2", code=0).stdout
    assert "are left" not in said
    rayrace("run", file, "--out", tmp_path / "none", "--max-minutes", 0, code=0)
    assert finished(tmp_path / "none") == []


def test_wrong_use(rayrace, experiment, tmp_path):
    file = experiment(["python"])
    assert "leave --out out" in rayrace("run", file, "--resume", tmp_path, "--out", tmp_path / "x", code=2).stderr
    assert "not a run" in rayrace("run", file, "--resume", tmp_path / "none", code=2).stderr
