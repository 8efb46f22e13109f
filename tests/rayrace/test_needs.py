"""`rayrace needs`: what a picture can do without, on the command line."""

import json
import shlex

import numpy as np
import pytest

SCENE = """CAMERA (0,0,0) (1,0,0) (0,0.8,0) 4
LIGHT (4,5,6) (0.9,0.9,0.8) 0
SPHERE (-0.2,0.1,-1) 0.6 (0.7,0.5,0.3) 0 20 (0,0,0) 1e6 1
"""
WORDS = "-r", "numpy", "--width", 12, "--height", 10, "--processes", 1


def test_what_each_leave_out_is_worth(rayrace, tmp_path):
    """A lone sphere that reflects nothing has no need of depth, which is proved, nor of shadows: none falls on it."""
    (tmp_path / "scene.txt").write_text(SCENE)
    done = rayrace(
        "needs", "scene.txt", *WORDS, "--json", "-o", "worth.png", "--sheet", "sheet.png", cwd=tmp_path, code=0
    )
    told = json.loads(done.stdout)
    rows = {one["left_out"]: one for one in told["without"]}
    assert set(rows) == {
        *("shadows", "light 1", "the sphere of line 3", "depth 10 to 0"),
        *("float64 to float32", "one ray at a time, to lanes"),
    }
    assert rows["depth 10 to 0"]["proof"] and rows["depth 10 to 0"]["pixels"] == 0
    assert rows["shadows"]["verdict"] == "changes no pixel (measured)" and rows["shadows"]["proof"] is None
    assert rows["light 1"]["error"]["rmse"] > told["full"]["error"]["rmse"]
    assert told["noise_floor"] is None and rows["light 1"]["time"]["low"] is None
    assert "noise floor" not in done.stderr
    assert (tmp_path / "worth.png").stat().st_size > 10_000
    assert (tmp_path / "sheet.png").stat().st_size > 10_000
    worst = told["without"][0]["left_out"]
    assert worst in ("light 1", "the sphere of line 3")


def test_the_smallest_model_within_an_error(rayrace, tmp_path):
    """Its scene and its command make its picture."""
    (tmp_path / "scene.txt").write_text(SCENE)
    words = *WORDS, "--samples", 2, "--within", "1/50", "--exhaustive"
    done = rayrace("needs", "scene.txt", *words, "--json", cwd=tmp_path, code=0)
    told = json.loads(done.stdout)
    found = told["smallest"]
    assert {"shadows", "depth 10 to 0"} <= set(found["left_out"])
    assert not {"light 1", "the sphere of line 3"} & set(found["left_out"])
    assert found["limit"] == 1 / 50 and found["error"]["rmse"] <= 1 / 50 and found["files"] == ["reduced.txt"]
    assert found["exhaustive"]["within"] <= found["exhaustive"]["models"]
    rayrace(*shlex.split(found["command"])[1:], cwd=tmp_path, code=0)
    assert np.load(tmp_path / "reduced.npy").shape == (10, 12, 3)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("scene.txt", "-o", "worth.gif"), "error: -o worth.gif: expected a chart, .png, .svg, .pdf"),
        (("scene.txt", "--sheet", "a.npy"), "error: --sheet a.npy: expected a chart, .png, .svg, .pdf"),
        (("scene.txt", "--exhaustive"), "error: --exhaustive: only with --within"),
        (("scene.txt", "--within", "1/0"), "error: --within 1/0: expected a number"),
        (("scene.txt", "--within", "1/255", "--reduced", "a.nff"), "error: --reduced a.nff: expected a scene, .txt"),
        (("scene.txt", "-r", "nump"), 'error: no renderer "nump"; did you mean'),
        (("scene.txt", "--lens-radius", 0.1), "error: lens_radius: also needs focal_distance"),
        (("scene.txt", "-r", "numpy", "--vector", "on"), "error: numpy cannot render this scene: has no vector on"),
    ],
)
def test_wrong_use(rayrace, tmp_path, words, message):
    (tmp_path / "scene.txt").write_text(SCENE)
    assert message in rayrace("needs", *words, cwd=tmp_path, code=2).stderr


def test_a_full_model_that_errs_more_is_refused_before_all_is_measured(rayrace, tmp_path):
    (tmp_path / "scene.txt").write_text(SCENE)
    done = rayrace("needs", "scene.txt", *WORDS, "--within", "1e-6", cwd=tmp_path, code=2)
    assert "error: the full model has an RMSE of up to" in done.stderr and not done.stdout


def test_the_smallest_scene_takes_the_place_of_no_file(rayrace, tmp_path):
    (tmp_path / "scene.txt").write_text(SCENE)
    (tmp_path / "reduced.txt").write_text("mine")
    words = *WORDS, "--samples", 2, "--within", "1/50"
    done = rayrace("needs", "scene.txt", *words, "--json", cwd=tmp_path, code=0)
    told = json.loads(done.stdout)["smallest"]
    assert told["files"] == ["reduced-2.txt"] and " reduced-2.txt " in told["command"]
    assert (tmp_path / "reduced.txt").read_text() == "mine"
    assert "note: reduced.txt exists and was kept, so this is reduced-2.txt; --reduced names a file\n" in done.stderr
