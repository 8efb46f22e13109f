"""A picture within an error: advice from the runs in results/, or what to run."""

import json

import numpy as np
import pytest

SCENE = """CAMERA (0,0,0) (1,0,0) (0,0.9,0) (0.3,0.2,4)
AMBIENT (0.2,0.2,0.2)
BACKGROUND (0.3,0.4,0.5)
LIGHT (4,5,6) (0.9,0.9,0.8) 0
SPHERE (-0.4,0.1,0) 0.4 (0.7,0.5,0.3) 0.6 20 (0,0,0) 1e6 1
SPHERE (0.5,-0.1,-0.3) 0.4 (0.3,0.5,0.7) 0.8 20 (0,0,0) 1e6 1
"""
LIKE_IT = SCENE.replace("(0.5,-0.1,-0.3) 0.4", "(0.4,-0.3,-0.2) 0.6")
GLASS = SCENE.replace("(0,0,0) 1e6 1\n", "(1,1,1) 2.25 1\n")
MORE = """[image]
shadows = true
[[points]]
cutoff = [0, 0.5]
[[points]]
sampler = "jittered"
samples = [1, 4]
[reference]
spots = 0
"""


@pytest.fixture(scope="module")
def measured(rayrace, tmp_path_factory):
    """A folder with a run in results/ that numpy took part in."""
    folder = tmp_path_factory.mktemp("measured")
    (folder / "scene.txt").write_text(SCENE)
    (folder / "like.txt").write_text(LIKE_IT)
    (folder / "glass.txt").write_text(GLASS)
    head = 'title = "t"\nscenes = ["scene.txt"]\nrenderers = ["numpy"]\nprocesses = 1\nframes = 3\n'
    image = MORE.replace("[image]\n", "[image]\nwidth = 24\nheight = 22\ndepth = 3\n")
    (folder / "e.toml").write_text(head + image)
    rayrace("run", "e.toml", cwd=folder, code=0)
    return folder


def ask(rayrace, folder, scene, error, *more, code=0):
    size = "--width", 30, "--height", 28
    return rayrace("render", scene, "--max-error", error, *size, "-o", "p.npy", "--json", *more, cwd=folder, code=code)


def test_an_error_that_the_truth_cannot_tell(rayrace, measured):
    assert "the truth of scene in" in ask(rayrace, measured, "scene.txt", 1e-9, code=2).stderr


@pytest.mark.nightly
def test_a_picture_and_its_error(rayrace, measured):
    found = json.loads(ask(rayrace, measured, "scene.txt", 0.2).stdout)
    assert found["renderer"] == "numpy" and 0 < found["error"]["rmse"] < 0.2 and found["error"]["against"] == "scene"
    assert np.load(measured / "p.npy").shape == (28, 30, 3)


@pytest.mark.nightly
def test_the_error_of_areas_is_that_of_samples(rayrace, measured, rows):
    """With more allowed, fewer samples; what it got is of the size that it expected."""
    (run,) = (measured / "results").iterdir()
    sampled = [row for row in rows(run)["numpy"] if row["parameters"]["sampler"] == "jittered"]
    known = {row["parameters"]["samples"]: row["error"]["rmse"] for row in sampled}
    one, sixteen = (
        json.loads(ask(rayrace, measured, "scene.txt", 1.01 * known[n], "--sampler", "jittered").stdout) for n in (1, 4)
    )
    assert (one["rays"]["primary"], sixteen["rays"]["primary"]) == (30 * 28, 16 * 30 * 28)
    for found in (one, sixteen):
        assert 0.5 < found["error"]["rmse"] / found["expected"]["rmse"] < 2
        assert found["error"]["uncertainty"] > 0


def test_a_scene_with_the_same_needs(rayrace, measured):
    done = rayrace(
        "render", "like.txt", "--max-error", 0.2, "--width", 20, "--height", 20, "-o", "p.png", cwd=measured, code=0
    )
    lines = done.stdout.splitlines()
    assert "to be expected, as with scene" in lines[0] and "p.png" in lines[1] and lines[-1].startswith("RMSE")


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("scene", "error", "more", "told"),
    [
        ("glass.txt", "1/255", (), "rayrace run experiments/accuracy.toml"),
        ("scene.txt", "1/255", ("--no-shadows",), "rayrace run experiments/accuracy.toml"),
        ("scene.txt", "1e-4", ("--sampler", "jittered"), "cannot tell"),
        ("scene.txt", "0.01", ("--sampler", "one"), "the most accurate has an RMSE of"),
        ("scene.txt", "0.1", ("-r", "cpp"), "none of them is a method that you gave"),
        ("scene.txt", "0", (), "expected more than 0"),
        ("scene.txt", "much", (), "--max-error much: expected a number"),
    ],
)
def test_why_not(rayrace, measured, scene, error, more, told):
    done = ask(rayrace, measured, scene, error, *more, code=2)
    assert told in done.stderr


def test_in_an_empty_place_it_says_what_to_run(rayrace, tmp_path):
    (tmp_path / "scene.txt").write_text(SCENE)
    assert "rayrace run experiments/accuracy.toml" in ask(rayrace, tmp_path, "scene.txt", 0.1, code=2).stderr
