"""A picture within an error: from a run in results/, or by measuring; what was promised, against another's truth."""

import json
import re
import tempfile
from dataclasses import replace

import numpy as np
import pytest
import seeds
from compilers import compiler, needs_compiler
from wild_scenes import draw

from harness.choice import trial
from harness.judge import judge, truth
from harness.process.session import Sessions
from harness.renderer.parameters import Parameters
from harness.scene import load
from harness.scene.flatten import flatten
from harness.scene.needs import needs
from harness.scene.text import read
from harness.single import single
from harness.single.single import general
from rayrace import choice

CAMERA = "CAMERA (0,0,0) (1,0,0) (0,0.9,0) (0.03,0.07,4)\n"
SCENE = f"""{CAMERA}AMBIENT (0.2,0.2,0.2)
BACKGROUND (0.3,0.4,0.5)
LIGHT (4,5,6) (0.9,0.9,0.8) 0
SPHERE (-0.4,0.1,0) 0.4 (0.7,0.5,0.3) 0 20 (0,0,0) 1e6 1
SPHERE (0.5,-0.1,-0.3) 0.43 (0.3,0.5,0.7) 0 20 (0,0,0) 1e6 1
"""
GLOSSY = SCENE.replace(" 0 20 (0,0,0)", " 0.8 20 (0,0,0)")
HALL = f"""{CAMERA}AMBIENT (0.2,0.2,0.2)
LIGHT (0.3,0.4,0.5) (0.2,0.2,0.2) 0
BOX (-1.03,-1.1,-1.2) (2,0,0) (0,2.1,0) (0,0,8.2) (0.05,0.05,0.05) 1 2000 (0,0,0) 1e12 1
"""
# Between two perfect mirrors, so long that no ray of any depth here sees the light at their ends: the picture is black.
CORRIDOR = f"""{CAMERA}BACKGROUND (0.9,0.8,0.7)
BOX (-9e4,-1.3,-9e4) (18e4,0,0) (0,-1,0) (0,0,18e4) (0,0,0) 1 1 (0,0,0) 1e30 1
BOX (-9e4,1.2,-9e4) (18e4,0,0) (0,1,0) (0,0,18e4) (0,0,0) 1 1 (0,0,0) 1e30 1
"""
PLAIN = "-r", "cpp-threads", "--precision", "float64", "--vector", "off"  # one program, which other tests build too
EMPTY = f"{CAMERA}BACKGROUND (0.2,0.5,0.7)\n"
RUN = """title = "t"
scenes = ["scene.txt"]
renderers = ["numpy"]
processes = 1
frames = 3
[image]
width = 24
height = 22
shadows = true
sampler = "jittered"
depth = 0
[sweep]
samples = [1, 3, 6]
[reference]
spots = 0
"""


@pytest.fixture
def ask(rayrace, tmp_path):
    """Ask for a picture of a scene within an error: its JSON and what it said, if it ended with `code`."""

    def ask(scene, error, *more, code=0, size=(24, 22), plain=True):
        if plain:
            compiler("c++")
            more += PLAIN
        (tmp_path / "scene.txt").write_text(scene)
        words = "--width", size[0], "--height", size[1], "-o", "p.npy", "--json", *more
        done = rayrace("render", "scene.txt", "--max-error", error, *words, cwd=tmp_path, code=code)
        return json.loads(done.stdout) if done.stdout else None, done.stderr

    return ask


def by_another(known, scene, arrays, job, side, maker="numba-parallel", pictures=2):
    """A truth of a scene with side x side samples in each of its pictures, by another renderer than the promise's."""
    entry = known[maker]
    job = replace(
        job,
        sampler="jittered",
        samples=side,
        feelers=1,
        glossy_rays=1,
        depth=24,
        cutoff=2.0**-18,
        threads=entry.threads(),
    )
    made = general(entry, job)
    with Sessions() as sessions:
        results = [
            sessions.run(entry, arrays, replace(made, seed=77 + k), needs(scene, made), cache=single.kernels(entry))
            for k in range(pictures)
        ]
        return truth.mean(result.array for result in results)


def test_it_tells_what_it_measured_and_keeps_it(ask, known, tmp_path):
    """The truth that the test has is another renderer's, with 24 x 24 samples a pixel."""
    found, _ = ask(SCENE, "1/64")
    job = Parameters(width=24, height=22, shadows=True)
    scene = read(SCENE, tmp_path / "scene.txt")
    right = by_another(known, scene, flatten(scene), job, 24, "numpy")
    got = judge.errors(np.load(tmp_path / "p.npy"), *right, None)
    assert got["rmse"] <= 1 / 64
    assert abs(got["rmse"] - found["error"]["rmse"]) <= 0.1 / 64
    uncertainty, doubt = found["error"]["uncertainty"], found["error"]["rmse_standard_error"]
    is_clear = abs(found["error"]["rmse"] - 1 / 64) > trial.CLEAR * doubt
    assert found["error"]["against"] == "scene" and uncertainty <= (1 / 128 if is_clear else 1 / 256)
    assert found["expected"]["rmse"] + 2 * found["expected"]["standard_error"] <= 1 / 64
    assert len(found["tried"]) > 3
    assert {"method", "rmse", "rmse_standard_error", "rough_seconds"} == found["tried"][0].keys()
    time = found["time"]
    assert time["processes"] in (1, 5) and (time["low"] is None) == (time["processes"] == 1) and time["seconds"] > 0
    assert found["pictures"][-1]["time"] == time and isinstance(time["doubts"], list)
    assert re.fullmatch(r"measured \d+ methods on the whole picture in .* s \(\d+ jobs\)", found["said"][0])
    assert found["seconds"] > 0


@pytest.mark.nightly("the parts are tested by day, with one program")
def test_of_all_programs_the_quickest_that_holds_is_taken(ask):
    found, _ = ask(GLOSSY, "1/32", "--against", "centres", plain=False, size=(200, 180))
    tried = [one["method"] for one in found["tried"]]
    assert any("in lanes" in name for name in tried) and any("float32" in name for name in tried)
    good = [one for one in found["tried"] if one["rmse"] + 2 * one["rmse_standard_error"] <= 1 / 32]
    quickest = min(good, key=lambda one: one["rough_seconds"])
    assert found["method"] == quickest["method"] and found["error"]["rmse"] <= 1 / 32


def test_the_centres_of_pixels_have_a_truth_without_samples(ask):
    found, _ = ask(GLOSSY, "1e-9", "--against", "centres")
    assert (
        found["error"]["rmse"] <= 1e-9 and found["error"]["against"] == "centres" and found["job"]["sampler"] == "one"
    )


@pytest.mark.parametrize(
    ("scene", "error", "more", "code", "told"),
    [
        (SCENE, "0", (), 2, "expected more than 0"),
        (SCENE, "much", (), 2, "--max-error much: expected a number"),
        (SCENE, "0.1", ("--against", "pixels"), 2, "--against pixels: expected scene or centres"),
        (SCENE, "0.1", ("--against", "centres", "--sampler", "uniform"), 2, "centres, which have one sample"),
        (SCENE, "1e-9", (), 1, "cannot tell whether an RMSE of 1e-09 is kept: no truth from samples can tell"),
        (SCENE, "1/255", ("--sampler", "one"), 1, "in the way: --sampler"),
        (GLOSSY, "1/32", ("--depth", "0"), 1, "in the way: --depth"),
        (HALL, "1/255", (), 1, "cannot tell whether"),
        (CORRIDOR, "1/255", (), 1, "cannot tell whether an RMSE of 0.00392 is kept: rays deeper than 64"),
        (CORRIDOR, "1/255", ("--depth", "100"), 1, "kept: rays deeper than 200"),
        (SCENE, "1/255", ("--max-seconds", "0.01"), 1, "the time is up before a picture was made"),
    ],
)
def test_why_not(ask, scene, error, more, code, told):
    _, said = ask(scene, error, *more, code=code)
    assert told in said


def test_a_renderer_that_is_not_there(ask):
    _, said = ask(SCENE, "0.1", "-r", "nobody", code=2, plain=False)
    assert "nobody" in said


def test_what_the_user_fixed_stays(ask):
    found, _ = ask(
        SCENE, "1/16", "--precision", "float32", "--sampler", "uniform", "--samples", 2, "-r", "numpy", plain=False
    )
    job = found["job"]
    assert (job["precision"], job["sampler"], job["samples"], found["renderer"]) == ("float32", "uniform", 2, "numpy")


@pytest.mark.parametrize(
    ("scene", "more", "size"),
    [(EMPTY, (), (24, 22)), (SCENE, ("--region", "3,4,9,7"), (24, 22)), (SCENE, (), (1, 1)), (SCENE, (), (2, 3))],
    ids=["empty", "region", "1 x 1", "2 x 3"],
)
def test_little_pictures(ask, tmp_path, scene, more, size):
    found, _ = ask(scene, "1/64", *more, size=size)
    assert found["error"]["rmse"] <= (1e-15 if scene is EMPTY else 1 / 64)
    assert np.load(tmp_path / "p.npy").shape == (found["height"], found["width"], 3)


def test_a_scene_that_the_lanes_refuse(ask):
    """With other lanes than any program has, it says which option is in the way."""
    _, said = ask(SCENE, "1/64", "--vector", "on", "-r", "numpy", code=2, plain=False)
    assert "no renderer can do this job: numpy: has no vector on" in said


def test_a_run_that_measured_this_very_picture_is_taken(rayrace, ask, tmp_path):
    (tmp_path / "e.toml").write_text(RUN)
    (tmp_path / "scene.txt").write_text(SCENE)
    rayrace("run", "e.toml", cwd=tmp_path, code=0)
    found, _ = ask(SCENE, "1/32", plain=False)
    assert found["tried"] == [] and "has measured 3 methods of this picture" in found["said"][0]
    assert found["renderer"] == "numpy" and found["error"]["rmse"] <= 1 / 32
    other, _ = ask(SCENE, "1/32", size=(26, 22))
    assert other["tried"] and "measured" in other["said"][0]


@needs_compiler("c++")
def test_a_measurement_that_lies_is_found(rayrace, tmp_path, monkeypatch, capsys):
    """It says a quarter of each error; the picture misses, and the next method is chosen by what it missed.

    Times are those of the rays: measured ones, of microseconds, could make a much better method look the quickest.
    """
    right, shoot = trial.Trial.error, trial.Trial.shoot

    def timed_by_rays(self, *told, **more):
        shot = shoot(self, *told, **more)
        return shot and (shot[0], 1e-8 * (shot[2] or 1), shot[2])

    def error(self, *told):
        found = right(self, *told)
        return {**found, "rmse": found["rmse"] / 4} if len(told) == 4 else found

    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))  # with the lock of measuring
    monkeypatch.setattr(trial.Trial, "error", error)
    monkeypatch.setattr(trial.Trial, "shoot", timed_by_rays)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.txt").write_text(SCENE)
    image = single.image("", width=24, height=22, depth=10, shadows=True)
    told = "1/128", "scene", 0.0, frozenset({"precision", "vector"}), 0, 600.0, (), True
    choice.render(load(tmp_path / "scene.txt"), "cpp-threads", tmp_path / "p.npy", image, *told)
    found = json.loads(capsys.readouterr().out)
    first, *others = (picture["error"]["rmse"] for picture in found["pictures"])
    assert first > 1 / 128 and others and others[-1] <= 1 / 128 and found["error"]["rmse"] == others[-1]


@pytest.mark.nightly("the parts are tested by day")
@pytest.mark.parametrize("number", range(6))
def test_random_scenes(ask, known, tmp_path, number):
    seed = seeds.numbers("max-error", number)
    print(seed)
    wild = draw(seed)
    wild.keep(tmp_path / "scene.txt")
    error = 1 / (32, 64, 128)[number % 3]
    found, said = ask(
        wild.source, error, *([] if wild.job["shadows"] else ["--no-shadows"]), code=None, size=(64, 48), plain=False
    )
    if found is None or "unavailable" in found["error"]:
        assert "cannot tell" in said
        return
    job = Parameters(width=64, height=48, shadows=wild.job["shadows"])
    right = by_another(known, wild.scene, flatten(wild.scene), job, 24)
    got = judge.errors(np.load(tmp_path / "p.npy"), *right, None)
    assert got["rmse"] - 2 * got["rmse_standard_error"] <= error
