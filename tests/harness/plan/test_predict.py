import json
import math
import os
import random
from dataclasses import replace
from types import SimpleNamespace

import pytest

from harness.machine import environment
from harness.plan import plan, predict
from harness.plan.forecast import Forecast
from harness.plan.predict import Predictor

SPEEDS = {"slow": (0.2, 3e-6), "fast": (0.05, 1e-8)}  # a and b of T = a + b w


def cell(work=1000, variant="slow", key=None, frames=1):
    """What a Predictor reads of a Cell: `work` is of a frame."""
    parameters = SimpleNamespace(frames=frames)
    return SimpleNamespace(key=key or f"{variant}-{work}", work=work, parameters=parameters, entry=Named(variant))


class Named:
    def __init__(self, name):
        self.name = name


def row(pixels, took, variant="slow", repetition=1, depth=1, objects=4, lights=1, frames=1, **more):
    work = pixels * (depth + 1) * (objects + lights)
    return {
        "cell": f"{variant}-{work}",
        "variant": variant,
        "repetition": repetition,
        "pass": "timed",
        "status": "ok",
        "parameters": {"region": f"0,0,{pixels},1", "depth": depth, "frames": frames},
        "shapes": {"sphere": objects, "box": 0},
        "lights": lights,
        "wall_s": took,
        "took_s": took,
        **more,
    }


def test_the_fit_finds_the_line():
    predictor = Predictor()
    rng = random.Random(5)
    for variant, (a, b) in SPEEDS.items():
        for _ in range(20):
            pixels, frames = rng.randint(1, 10**5), rng.randint(0, 3)
            predictor.add(row(pixels, a + b * pixels * 10 * (frames + 1), variant, frames=frames))
    for variant, (a, b) in SPEEDS.items():
        for work in (10, 10**5, 10**8):
            found = predictor.seconds(cell(work, variant, key="new", frames=2))
            assert found.seconds == pytest.approx(a + 3 * b * work, rel=1e-6)
            assert found.source == f"20 finished repetitions of {variant}"


def test_the_fit_of_noisy_times():
    a, b = SPEEDS["slow"]
    worst = 0.0
    for seed in range(20):
        rng = random.Random(seed)
        sizes = [10**k for k in (1, 2, 3, 4, 5) for _ in range(6)]
        rows = [row(pixels, (a + b * pixels * 20) * rng.uniform(0.95, 1.05)) for pixels in sizes]
        predictor = Predictor(rows)
        for work in (100, 10**5, 10**6):
            found = predictor.seconds(cell(work, key="new"))
            worst = max(worst, abs(found.seconds / (a + 2 * b * work) - 1))
    assert worst < 0.05


def test_neither_a_nor_b_is_negative():
    falling = Predictor([row(10, 2.0), row(1000, 1.0)])
    assert 1 < falling.seconds(cell(10**9, key="new")).seconds < 2
    steep = Predictor([row(10, 0.001), row(1000, 1.0)])
    assert steep.seconds(cell(1, key="new")).seconds > 0


def test_a_cell_tells_of_itself():
    predictor = Predictor([row(10, took) for took in (1.0, 5.0, 2.0)] + [row(1000, 9.0)])
    found = predictor.seconds(cell(100))
    assert found == (2.0, "3 finished repetitions of the cell itself")
    predictor.add(row(10, 8.0, status="timeout"))
    assert predictor.seconds(cell(100)).seconds == 3.5


def test_the_first_repetition_is_apart():
    predictor = Predictor([row(10, 9.0, repetition=0, wall_s=1.0)])
    assert predictor.seconds(cell(100)) == (1.0, "1 finished repetition of the cell itself")
    assert predictor.seconds(cell(100), first=True).seconds == 9.0
    predictor.add(row(10, 2.0, repetition=1))
    predictor.add(row(10, 4.0, repetition=0, **{"pass": "pair"}))
    assert predictor.seconds(cell(100)).seconds == 3.0
    assert predictor.seconds(cell(100), first=True).seconds == 9.0


def test_a_truth_is_apart():
    """One cell of many makes what all share; were it in the time of its repetition, the fit would be of that."""
    rows = [row(10, 2.0, repetition=0), row(1000, 304.0, repetition=0, wall_s=4.0, truth_s=300.0)]
    predictor = Predictor(rows)
    assert predictor.truth == 300.0
    assert predictor.seconds(cell(10_000), first=True).seconds == 4.0
    assert predictor.seconds(cell(10**5, key="new"), first=True).seconds < 40
    predictor.add(row(10, 102.0, wall_s=1.5, truth_s=100.0))
    assert (predictor.truth, predictor.seconds(cell(100)).seconds) == (200.0, 2.0)
    assert Predictor(rows[:1]).truth == 0.0


def test_what_says_nothing():
    predictor = Predictor()
    assert predictor.seconds(cell()) is None
    predictor.add(row(10, 60.0, **{"pass": "load"}))
    predictor.add(row(10, None))
    assert predictor.seconds(cell(100)) is None
    predictor.add(row(10, 1.0))
    assert predictor.seconds(cell(100, key="of the same work")).seconds == 1.0
    assert predictor.seconds(cell(200)) is None, "one size alone says nothing of another"
    assert predictor.seconds(cell(100, "fast")) is None
    predictor.add(row(50, 0.1, status="failed"))
    assert predictor.seconds(cell(200)) is None


def test_older_rows():
    old = row(10, 1.5)
    for name in ("took_s", "lights", "pass"):
        del old[name]
    predictor = Predictor([old])
    assert predictor.seconds(cell(100)).seconds == 1.5
    assert predictor.seconds(cell(100, key="new")) is None


@pytest.fixture
def stored(tmp_path):
    """Write a run with these rows: stored("name", rows, host=..)."""
    here = environment.capture()
    count = iter(range(1, 100))

    def write(name, rows, end="", **machine):
        folder = tmp_path / "results" / name
        folder.mkdir(parents=True)
        known = {"cell": "known", "variant": "cpp", "parameters": row(1, 1.0)["parameters"]}
        facts = {"format": 1, "environment": {**here, **machine}, "cells": [known]}
        (folder / "run.json").write_text(json.dumps(facts))
        lines = folder / "repetitions.jsonl"
        lines.write_text("".join(json.dumps(line) + "\n" for line in rows) + end)
        os.utime(lines, (next(count),) * 2)
        return folder

    return write


def test_history(stored, tmp_path):
    assert predict.history(tmp_path / "results") == []
    stored("a", [row(1, 1.0), row(2, 2.0)], end='{"cell": "torn"')
    stored("of another", [row(3, 3.0)], host="elsewhere")
    stored("before the new processor", [row(4, 4.0)], cpu="older")
    stored("b", [row(5, 5.0), row(6, 6.0, status="unavailable"), row(7, 7.0, status="unsupported")])
    mine = stored(
        "c", [{"cell": name, "repetition": 1, "status": "ok", "took_s": 8.0} for name in ("known", "unknown")]
    )
    (tmp_path / "results" / "none").mkdir()
    (tmp_path / "results" / "none" / "repetitions.jsonl").write_text("x\n")

    def took(**more):
        return [found["took_s"] for found in predict.history(tmp_path / "results", **more)]

    assert took() == [8.0, 5.0, 1.0, 2.0]
    assert predict.history(tmp_path / "results")[0]["variant"] == "cpp", "what run.json says of a cell"
    assert took(but=mine) == [5.0, 1.0, 2.0]
    sizes = [(tmp_path / "results" / name / "run.json").stat().st_size for name in "cb"]
    lines = [len((tmp_path / "results" / name / "repetitions.jsonl").read_bytes()) for name in "cb"]
    assert took(most=sizes[0] + lines[0]) == [8.0]
    assert took(most=2 * sum(sizes) + lines[0]) != [8.0], "the rest of it is of the next run"


def test_history_reads_the_end_of_a_large_run(stored, tmp_path):
    folder = stored("a", [row(pixels, float(pixels)) for pixels in range(1, 2000)])
    most = (folder / "run.json").stat().st_size + 10_000
    found = [row["took_s"] for row in predict.history(tmp_path / "results", most=most)]
    assert found == [float(pixels) for pixels in range(2000 - len(found), 2000)] and 10 < len(found) < 100


def planned(*processes, order="interleaved", pair=None, unavailable=None):
    def one(number, count):
        entry = SimpleNamespace(name=f"v{number}", unavailable=unavailable if number == 0 else None)
        return plan.Cell(
            *(f"c{number}", entry, "scene.txt", "", SimpleNamespace(frames=1), (), count, 60.0, {}, 1, 1),
        )

    cells = tuple(one(*each) for each in enumerate(processes))
    return plan.Plan(cells, {}, None if pair is None else cells[pair]), SimpleNamespace(seed=1, order=order)


class Said:
    """A predictor that is told: seconds by cell key, of the first repetition and of others."""

    def __init__(self, truth=0.0, **seconds):
        self.told, self.truth = seconds, truth

    def seconds(self, cell, first=False):
        found = self.told.get(cell.key)
        return found and predict.Prediction(found[0 if first else 1], "hearsay")


@pytest.fixture(autouse=True)
def _all_is_supported(monkeypatch):
    monkeypatch.setattr(plan, "unsupported", lambda *_: None)


def test_forecast():
    told = Said(c0=(10.0, 2.0), c1=(1.0, 1.0))
    found = Forecast(*planned(3, 2), told)
    assert [line.seconds for line in found.lines] == [14.0, 2.0]
    assert (found.seconds, found.unknown, found.sources) == (16.0, {}, {"hearsay": 2})
    paired = Forecast(*planned(3, 2, pair=0), told)
    assert [line.left for line in paired.lines] == [6, 2] and paired.seconds == 22.0
    resumed = Forecast(*planned(3, 2), told, {("c0", 0, "timed"), ("c0", 1, "timed"), ("c1", 0, "timed")})
    assert [line.seconds for line in resumed.lines] == [2.0, 1.0]
    absent = Forecast(*planned(3, 2, unavailable="no compiler"), told)
    assert [(line.skipped, line.seconds) for line in absent.lines] == [("no compiler", 0.0), (None, 2.0)]
    half = Forecast(*planned(3, 2), Said(c0=(10.0, 2.0)))
    assert (half.seconds, half.unknown, half.cut(60.0)) == (14.0, {"v1": 1}, None)
    assert half.record()["seconds"] is None


class Shared:
    """Truths by cell key."""

    def __init__(self, **names):
        self.names = names

    def name(self, cell):
        return self.names.get(cell.key)


def test_forecast_of_truths():
    """Each truth once, whoever asks for it first; none that is there, or that nothing will ask for."""
    made, experiment = planned(2, 2, 2)
    made = replace(made, truths=Shared(c0="one", c1="one", c2="two"))
    told = Said(truth=100.0, c0=(1.0, 1.0), c1=(1.0, 1.0), c2=(1.0, 1.0))
    whole = Forecast(made, experiment, told)
    assert whole.seconds == 6.0 + 200.0
    assert [whole.cut(budget) for budget in (0.5, 150.0, 206.5)] == [(1, 0), (2, 0), (6, 2)]
    assert Forecast(made, experiment, told, {("c1", 0, "timed")}).seconds == 5.0 + 100.0
    every = {(key, number, "timed") for key in ("c0", "c1", "c2") for number in (0, 1)}
    assert Forecast(made, experiment, told, every).seconds == 0.0
    refused, experiment = planned(2, 2, unavailable="no compiler")
    refused = replace(refused, truths=Shared(c0="one", c1="two"))
    assert Forecast(refused, experiment, told).seconds == 2.0 + 100.0


def test_forecast_of_a_budget():
    some = *planned(4, 4, 4), Said(c0=(1.0, 1.0), c1=(1.0, 1.0), c2=(1.0, 1.0))
    whole = Forecast(*some)
    assert [whole.cut(budget) for budget in (0.0, 0.5, 3.5, 6.5, 8.9, 12.5, math.inf)] == [
        (0, 0), (1, 0), (3, 1), (6, 2), (8, 2), (12, 4), (12, 4),
    ]  # fmt: skip
    sequential = Forecast(*planned(4, 4, 4, order="sequential"), some[2])
    assert sequential.cut(7.5) == (7, 0)
    assert Forecast(*planned(2), Said(c0=(100.0, 1.0))).cut(50.0) == (1, 1), "what has begun may end"


def test_dry_run(rayrace, experiment, tmp_path, environment):
    file = experiment(["python", "numpy"], "[sweep]\ndepth = [0, 1]\n")
    words = "run", file, "--set", "processes=2"
    first = rayrace(*words, "--dry-run", cwd=tmp_path, code=0).stdout
    assert "4 cells" in first and "8 of 8 processes are due; no time estimate yet" in first
    assert "unknown for 2 cells: too few finished repetitions of python on this machine" in first
    assert "no A/A pair: its noise floor needs 5 processes" in first
    folder = tmp_path / "results" / "run"
    rayrace(*words, "--max-minutes", "1", "--out", folder, cwd=tmp_path, code=0)
    lines = (folder / "repetitions.jsonl").read_text().splitlines(keepends=True)
    told = json.loads(rayrace(*words, "--dry-run", "--json", "--max-minutes", "5", cwd=tmp_path, code=0).stdout)
    rows = [json.loads(line) for line in lines]
    for cell in told["cells"]:
        (took,) = [row["took_s"] for row in rows if row["cell"] == cell["cell"] and row["repetition"] == 1]
        assert cell["seconds"] == took and cell["source"] == "1 finished repetition of the cell itself"
    assert told["seconds"] == pytest.approx(sum(row["took_s"] for row in rows))
    (made,) = [row for row in rows if row["truth_s"] is not None]  # of both depths and renderers
    assert made["repetition"] == 0 and 0 < made["truth_s"] < made["took_s"]
    assert (told["repetitions"], told["unknown"], told["fitting"]) == (8, {}, {"repetitions": 8, "rounds": 2})
    (folder / "repetitions.jsonl").write_text("".join(lines[:5]))
    left = json.loads(rayrace(*words, "--dry-run", "--json", "--resume", folder, cwd=tmp_path, code=0).stdout)
    assert left["repetitions"] == 3 and sum(cell["left"] for cell in left["cells"]) == 3
    done = rayrace(*words, "--json", cwd=tmp_path)
    assert done.returncode == 2 and "--json: only with --dry-run" in done.stderr


def test_dry_run_of_many_cells(rayrace, experiment, tmp_path):
    file = experiment(["python", "numpy"], f"[sweep]\ndepth = {list(range(202))}\n")
    words = "--set", 'where=["depth < 200"]', "--max-minutes", "5"
    text = rayrace("run", file, "--dry-run", *words, cwd=tmp_path, code=0).stdout
    assert "400 cells" in text and "depth (200)" in text and len(text.splitlines()) < 20
    assert 'left out by where "depth < 200": 4 cells' in text and "in 5 min fit: unknown" in text
