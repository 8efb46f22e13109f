"""A renderer in a folder of its own, in C, races like the shipped ones."""

import json
import shutil
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[1] / "c_renderer"
SCENE = """CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,4)
AMBIENT (0.2,0.2,0.2)
BACKGROUND (0.1,0.1,0.3)
LIGHT (4,5,6) (0.9,0.8,0.7) 0
SPHERE (0.1,0,-1) 0.8 (0.7,0.5,0.3) 0 1 (0,0,0) 1e6 1
SPHERE (-0.6,0.4,-0.5) 0.3 (0.2,0.5,0.6) 0 1 (0,0,0) 1e6 1
"""

pytestmark = pytest.mark.skipif(not shutil.which("cc"), reason="no C compiler (apt install gcc)")


@pytest.fixture
def folder(tmp_path):
    return shutil.copytree(SOURCE, tmp_path / "elsewhere" / "flat")


@pytest.fixture(params=["--renderer", "--renderer above", "RAYRACE_RENDERERS", "RAYRACE_RENDERERS above"])
def way(request, folder):
    """Words and environment by which rayrace hears of the folder."""
    place = folder.parent if request.param.endswith("above") else folder
    if request.param.startswith("--"):
        return ["--renderer", place], {}
    return [], {"RAYRACE_RENDERERS": str(place)}


@pytest.mark.slow
def test_run(way, rayrace, experiment, rows, folder, tmp_path):
    words, env = way
    file = experiment(["flat", "python"], scene=SCENE, processes=2, size=16)
    rayrace("run", file, "--out", tmp_path / "run", *words, env=env, code=0)
    found = rows(tmp_path / "run")
    for row in found["flat"]:
        assert row["status"] == "ok" and row["technology"] == "C99" and row["build"]["command"][0] == "{compiler}"
        assert row["agreement"]["max_outside"] < 1e-9 and row["agreement"]["reference"] != "flat"
        assert len(row["frames_s"]) == 2
    assert len(found["flat"]) == len(found["python"]) == 2


def test_list(way, rayrace, folder):
    words, env = way
    told = {row["variant"]: row for row in json.loads(rayrace("list", "--json", *words, env=env, code=0).stdout)}
    assert told["flat"]["folder"] == str(folder) and told["flat"]["available"]
    assert "python" in told


def test_render(way, rayrace, write, tmp_path):
    words, env = way
    scene = write("scene.txt", SCENE)
    picture = ("--width", 20, "--height", 10, "--no-shadows", "-r", "flat")
    rayrace("render", scene, *picture, "-o", tmp_path / "flat.npy", *words, env=env, code=0)
    assert (tmp_path / "flat.npy").is_file()


def test_check(rayrace, folder):
    assert rayrace("check", folder, code=0).stdout.endswith("all checks passed\n")


def test_what_it_cannot_do_is_a_row_and_no_failure(rayrace, experiment, rows, folder, tmp_path):
    file = experiment(["flat"], scene=SCENE + "POLYGON 3 (0,0,-2) (1,0,-2) (0,1,-2) (1,1,1) 0 1 (0,0,0) 1e6 1\n")
    rayrace("run", file, "--out", tmp_path / "run", "--renderer", folder, code=0)
    (row,) = rows(tmp_path / "run")["flat"]
    assert (row["status"], row["reason"]) == ("unsupported", "does not support polygon")
