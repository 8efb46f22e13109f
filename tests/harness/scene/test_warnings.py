"""What is valid in a scene and seldom meant is said, with its place: a camera whose eye is off the screen's normal."""

import json
import math
from pathlib import Path

import pytest

from harness.scene import check, load, warnings
from harness.store import store
from reports.page import several

ROOT = Path(__file__).parents[3]
OBLIQUE = "# a scene\nCAMERA (0,0,0) (1,0,0) (0,1,0)\n  (3,0,3) # the eye\nBACKGROUND (0.2,0.5,0.7)\n"
OBLIQUE += "SPHERE (-1,0,-3) 1 (1,1,1) 0 1 (0,0,0) 1e6 1\n"
SAID = "scene.txt:3: the eye is 45 degrees off the normal of the screen, so the perspective is oblique; to have it "
SAID += "straight, write the distance of the eye in place of e"


@pytest.mark.parametrize("degrees", [1e-4, 0.1, 12.5, 45, 80])
@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("size", [1e-9, 1, 1e9])
def test_the_angle_of_a_slant(degrees, side, size):
    angle = math.radians(degrees)
    e = (size * math.sin(angle) * 0.6, size * math.sin(angle) * 0.8, side * size * math.cos(angle))
    assert check.slant((2, 0, 0), (0, 0.5, 0), e) == pytest.approx(degrees, rel=1e-9)


def test_a_camera_that_is_straight_but_for_rounding():
    turned = [(math.cos(a), math.sin(a), 0.3 * a) for a in range(1, 30)]
    for u in turned:
        for other in turned:
            if len({u, other}) == 2:
                u_, w = check.unit(u), check.unit(check.cross(u, other))
                v = check.cross(w, u_)
                for digits in (17, 7):
                    rounded = [tuple(round(7.3 * x, digits) for x in vector) for vector in (u_, v, w)]
                    assert check.slant(*rounded) == 0


def test_scenes_with_a_distance_have_no_warning(write):
    text = OBLIQUE.replace("(3,0,3)", "4.2").replace("(1,0,0) (0,1,0)", "(1,2,3) (3,0,-1)")
    assert warnings(load(write("scene.txt", text))) == []


def test_scenes_of_the_repository():
    files = [*ROOT.glob("experiments/scenes/**/*.txt"), *ROOT.glob("experiments/scenes/**/*.nff")]
    assert [file.name for file in files if warnings(load(file))] == []


def test_a_command_says_it_once(rayrace, write, tmp_path):
    write("scene.txt", OBLIQUE)
    head = 'title = "t"\nscenes = ["scene.txt"]\nrenderers = ["python", "numpy"]\nprocesses = 1\nframes = 0\n'
    write("e.toml", head + "[image]\nwidth = 8\nheight = 8\n[sweep]\ndepth = [1, 2]\n")
    small = ("-r", "python", "--width", 8, "--height", 8)
    told = {}
    for name, words in {
        "render": ("render", "scene.txt", *small, "--json"),
        "tiles": ("render", "scene.txt", *small, "--tiles", 5, "-o", "a.npy", "--json"),
        "plan": ("run", "e.toml", "--dry-run", "--json"),
        "run": ("run", "e.toml", "--out", "run"),
    }.items():
        done = rayrace(*words, cwd=tmp_path, code=0)
        assert done.stderr.count("degrees") == 1 and f"warning: {SAID}\n" in done.stderr
        told[name] = done.stdout
    for name in ("render", "tiles", "plan"):
        assert json.loads(told[name])["warnings"] == [SAID]
    assert store.read(tmp_path / "run")[0]["warnings"] == [SAID]
    several.make([tmp_path / "run"], tmp_path / "report")
    assert f"- {SAID}\n" in (tmp_path / "report" / "report.md").read_text()


def test_rays_need_no_camera(rayrace, write, tmp_path):
    write("scene.txt", OBLIQUE)
    write("rays.csv", "ox,oy,oz,dx,dy,dz\n0,0,0,0,0,1\n")
    assert rayrace("trace", "scene.txt", "rays.csv", "-r", "python", cwd=tmp_path, code=0).stderr == ""
