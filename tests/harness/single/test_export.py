"""`rayrace render SCENE -o scene.pov`: a scene in another program's format."""

import json
import re
import shutil
import subprocess

import numpy as np
import pytest

from renderers.povray import exr, main

STAGE = """CAMERA (0,0,0) (1,0,0) (0,1,0) (0.1,0.2,3)
BACKGROUND (0.2,0.5,0.7)
AMBIENT (0.3,0.3,0.3)
LIGHT (4,5,6) (1,1,1) 0
"""
SCENE = (
    STAGE + "SPHERE (0,0,0) 0.5 (1,0.5,0) 0.6 20 (0,0,0) 9 1\nSPHERE (0.5,0.3,0.6) 0.3 (0,0,0) 1 20 (1,1,1) 2.25 1\n"
)
SIZE = ("--width", 12, "--height", 8, "--depth", 3)


@pytest.fixture
def scene(write):
    return write("scene.txt", SCENE)


def test_a_scene_for_povray(rayrace, scene, tmp_path):
    """The whole file, short as it is, says what to do with it."""
    out = tmp_path / "other name.pov"
    done = rayrace("render", scene, *SIZE, "-o", out, code=0)
    assert done.stdout == f"{out}: scene for povray\n"
    lines = out.read_text().splitlines()
    assert lines[0].startswith("// ") and lines[1].startswith("//   povray ") and " +W12 +H8 -A +FE " in lines[1]
    assert "#version 3.7;" in lines and sum(line.startswith("sphere") for line in lines) == 1
    assert "max_trace_level 4" in out.read_text()


def test_it_says_json(rayrace, scene, tmp_path):
    done = rayrace("render", scene, *SIZE, "-o", tmp_path / "a.pov", "--json", code=0)
    told = json.loads(done.stdout)
    oblique, stretched = told.pop("warnings")
    assert told == {"scene": str(tmp_path / "a.pov"), "exporter": "povray"}
    assert "the perspective is oblique" in oblique and "stretches its screen" in stretched


def test_it_needs_no_povray(rayrace, scene, tmp_path):
    rayrace("render", scene, *SIZE, "-o", tmp_path / "a.pov", env={"PATH": ""}, code=0)
    assert (tmp_path / "a.pov").is_file()


def test_the_command_in_the_file_makes_the_picture(rayrace, scene, tmp_path):
    if shutil.which("povray") is None:
        pytest.skip("no program povray on the PATH")
    jobs = (*SIZE, "--region", "2,1,11,7", "--samples", 2)
    rayrace("render", scene, *jobs, "-o", tmp_path / "a.pov", code=0)
    rayrace("render", scene, *jobs, "-r", "povray", "-o", tmp_path / "a.npy", code=0)
    text = (tmp_path / "a.pov").read_text()
    words = re.search(r"//   povray (.*\+FE) ", text)[1].replace("THIS_FILE", "a").split()
    for _ in range(main.STARTS):
        done = subprocess.run(["povray", *words, "-D", "-GA", "+Oa.exr"], cwd=tmp_path, capture_output=True, text=True)
        if main.TOO_SLOW not in done.stderr:
            break
    assert done.returncode == 0, done.stderr
    assert "mean of each 2 x 2 pixels" in text
    found = exr.read(tmp_path / "a.exr")[2:14, 4:22].reshape(6, 2, 9, 2, 3).mean(axis=(1, 3), dtype=np.float64)
    assert np.array_equal(found, np.load(tmp_path / "a.npy"))


@pytest.mark.parametrize(
    ("more", "words", "reason"),
    [
        ("SPHERE (1,1,1) 0.5 (1,0.5,0) 0.6 20 (0,0,0) 9 1.5", (), "permeability"),
        ("", ("--no-shadows",), "without shadows"),
        ("", ("--lens-radius", 0.1, "--focal-distance", 3), "does not support lens"),
    ],
)
def test_what_povray_does_otherwise_is_refused(rayrace, write, tmp_path, more, words, reason):
    scene = write("scene.txt", SCENE + more)
    done = rayrace("render", scene, *SIZE, *words, "-o", tmp_path / "a.pov", code=2)
    assert done.stderr.startswith(f"error: {tmp_path}/a.pov: povray cannot write it: ") and reason in done.stderr
    assert not (tmp_path / "a.pov").exists()


def test_a_folder_that_is_not_there(rayrace, scene, tmp_path):
    done = rayrace("render", scene, "-o", tmp_path / "no" / "a.pov", code=2)
    assert done.stderr == f"error: {tmp_path}/no: no such folder\n"


def test_nobody_renders_it(rayrace, scene, tmp_path):
    done = rayrace("render", scene, "-r", "cpp", "-o", tmp_path / "a.pov", code=2)
    assert done.stderr == "error: -r cpp: a.pov is a scene, so nothing is rendered; leave -r out\n"


def test_a_suffix_that_nobody_writes(rayrace, scene, tmp_path):
    done = rayrace("render", scene, "-o", tmp_path / "a.blend", code=2)
    assert 'unknown kind of picture ".blend"' in done.stderr


def test_an_exporter_of_another_folder(rayrace, scene, tmp_path):
    """Any renderer may bring one; one that fails is told of with its reason."""
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "renderer.toml").write_text(
        'contract = 1\nname = "mine"\ntechnology = "C"\ndescription = "d"\nfeatures = ["sphere"]\n'
        '[export]\nsuffix = ".rib"\ncommand = ["{python}", "{folder}/export.py"]\n'
        '[[variant]]\nname = "mine"\ncommand = ["nothing"]\n'
    )
    program = folder / "export.py"
    program.write_text(
        "import json, pathlib, sys\n"
        "flags = dict(word[2:].split('=', 1) for word in sys.argv[1:])\n"
        "(pathlib.Path(flags['out']) / 'scene.rib').write_text(flags['width'])\n"
        "print(json.dumps({'event': 'output', 'file': 'scene.rib'}))\n"
    )
    words = ("render", scene, *SIZE, "-o", tmp_path / "a.rib", "--renderer", folder)
    rayrace(*words, code=0)
    assert (tmp_path / "a.rib").read_text() == "12"
    program.write_text("")
    assert rayrace(*words, code=2).stderr == f"error: {tmp_path}/a.rib: mine wrote no file\n"
    program.write_text("raise SystemExit('no ink')")
    assert rayrace(*words, code=2).stderr == f"error: {tmp_path}/a.rib: mine cannot write it: no ink\n"
