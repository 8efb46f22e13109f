"""What is valid in a scene and seldom meant is said, with its place: a slanting view, glass that does not close, what
makes a picture dark."""

import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.renderer.parameters import Parameters
from harness.scene import check, doubts, load, text, warnings
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
        "plan": ("run", "e.toml", "--dry-run", "--json"),
        "run": ("run", "e.toml", "--out", "run"),
    }.items():
        done = rayrace(*words, cwd=tmp_path, code=0)
        assert done.stderr.count("degrees") == 1 and f"warning: {SAID}\n" in done.stderr
        told[name] = done.stdout
    for name in ("render", "plan"):
        assert json.loads(told[name])["warnings"] == [SAID]
    assert store.read(tmp_path / "run")[0]["warnings"] == [SAID]
    several.make([tmp_path / "run"], tmp_path / "report")
    assert f"- {SAID}\n" in (tmp_path / "report" / "report.md").read_text()


def test_rays_need_no_camera(rayrace, write, tmp_path):
    write("scene.txt", OBLIQUE)
    write("rays.csv", "ox,oy,oz,dx,dy,dz\n0,0,0,0,0,1\n")
    assert rayrace("trace", "scene.txt", "rays.csv", "-r", "python", cwd=tmp_path, code=0).stderr == ""


# Clear meshes that do not close

GLASS, OPAQUE = "(0,0,0) 1 9 (0.9,1,1) 2.25 1\n", "(1,1,1) 0 1 (0,0,0) 1e6 1\n"
VIEW = "CAMERA (0,0,3) (1,0,0) (0,1,0) 3\nLIGHT (5,6,9) (1,1,1) 0\nAMBIENT (0.1,0.1,0.1)\n"
CORNERS = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
SIDES = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
MESHES = {
    "whole": (CORNERS + SIDES, None),
    "a side is missing": (CORNERS + SIDES[8:], "3 edges have one triangle; it is flat.*close its holes"),
    "a corner is there twice": (
        CORNERS + SIDES[:-8] + "f 3 5 4\nv 1e-7 0 0\n",
        "4 edges have one triangle, and 2 vertices all but coincide.*merge vertices by distance",
    ),
    "every face is doubled": (
        CORNERS + SIDES + "f 1 2 3\nf 1 4 2\nf 2 4 3\nf 3 4 1\n",
        "6 edges have more than two triangles.*remove doubled and inner faces",
    ),
    "a sheet, back to back": (CORNERS + "f 1 2 3\nf 3 2 1\n", "one side only, or two that coincide"),
}


@pytest.mark.parametrize("name", MESHES)
def test_clear_meshes_that_do_not_close(name, write, tmp_path):
    content, match = MESHES[name]
    write("m.obj", content)
    for material, wrong in ((GLASS, match), (OPAQUE, None), (GLASS.replace(" 1 9", " 0 9", 1), None)):
        shape = f"MESH m.obj (-0.2,-0.2,0) (0,0,0) 1 {material}"
        found = warnings(load(write("scene.txt", f"{VIEW}{shape}{shape}")))
        if wrong:
            (said,) = found
            assert re.search(f'scene.txt:4: the clear mesh "m.obj" does not close: .*{wrong}.*or make it opaque', said)
        else:
            assert found == []


# What makes a picture dark, or of one colour


BALL = f"SPHERE (0,0,0) 1 {OPAQUE}"
DARK = {
    "nothing is wrong": (VIEW + BALL, None),
    "behind the eye": (VIEW + BALL.replace("(0,0,0)", "(0,0,9)", 1), "scene.txt:1: all objects are behind the eye"),
    "turned away": (
        VIEW.replace("(0,1,0) 3", "(0,1,0) (0,0,-3)").replace("(0,0,3)", "(0,0,6)") + BALL,
        "txt:1: all objects are behind",
    ),
    "beside the view": (VIEW + BALL.replace("(0,0,0)", "(9,0,0)", 1), "txt:1: all objects are outside of the view"),
    "above and below the view": (
        VIEW + BALL.replace("(0,0,0)", "(0,9,0)", 1) + BALL.replace("(0,0,0)", "(0,-9,0)", 1),
        "txt:1: all objects are outside of the view",
    ),
    "one of two is seen": (VIEW + BALL.replace("(0,0,0)", "(0,0,9)", 1) + BALL, None),
    "a floor below the eye": (VIEW + f"POLYGON 4 (-99,-1,-99) (99,-1,-99) (99,-1,99) (-99,-1,99) {OPAQUE}", None),
    "all but something": (
        VIEW.replace("(5,6,9)", "(0,0,99)") + f"NOT SPHERE (0,0,99) 1 END {OPAQUE}",
        "txt:1: the eye is inside the opaque csg of line 4",
    ),
    "the eye in a box": (
        VIEW + f"BOX (-9,-9,-9) (18,0,0) (0,18,0) (0,0,18) {OPAQUE}",
        "txt:1: the eye is inside the opaque box of line 4",
    ),
    "the eye in glass": (VIEW + f"BOX (-9,-9,-9) (18,0,0) (0,18,0) (0,0,19) {GLASS}" + BALL, None),
    "a light in a ball": (
        VIEW.replace("(5,6,9)", "(0,0.5,0)") + BALL,
        "txt:2: the light is inside the opaque sphere of line 4",
    ),
    "a light in an ellipsoid": (
        VIEW.replace("(5,6,9)", "(0,0.5,0)") + f"ELLIPSOID (0,0,0) (1,0,0) (0,1,0) (0,0,1) {OPAQUE}",
        "txt:2: the light is inside the opaque ellipsoid of line 4",
    ),
    "a light in a glass ball": (VIEW.replace("(5,6,9)", "(0,0.5,0)") + BALL.replace(OPAQUE, GLASS), None),
    "no light": (VIEW[:33] + BALL, "scene.txt: the scene has no light"),
    "no light before a coloured sky": (VIEW[:33] + "BACKGROUND (0,0,1)\n" + BALL, None),
    "nothing at all": (VIEW, None),
    "too large for float64": (
        VIEW + f"SPHERE (0,0,-1e30) 1e30 {OPAQUE}",
        "txt:4: the sphere has coordinates up to 2e+30",
    ),
    "large, but held": (VIEW + f"SPHERE (0,0,-1e11) 1e11 {OPAQUE}", None),
}


@pytest.mark.parametrize("name", DARK)
def test_what_makes_a_picture_dark(name, write):
    content, said = DARK[name]
    found = warnings(load(write("scene.txt", content)))
    assert (found == []) if said is None else (len(found) == 1 and said in found[0] and ";" in found[0])


@pytest.mark.parametrize("seed", range(30))
def test_what_is_in_view_is_never_said_to_be_out_of_it(seed):
    """Eye rays that meet a small ball, from any eye, straight or not."""
    rng = np.random.default_rng(seed)
    print("seed", seed)
    size = 10.0 ** rng.uniform(-9, 9)
    centre, u, w = rng.normal(size=(3, 3)) * size
    v = np.cross(w, u) / np.linalg.norm(w)
    e = np.cross(u, v) / np.linalg.norm(u) * rng.choice([-1, 1]) + 0.3 * u + 0.2 * v
    x, y = rng.uniform(-1, 1, 2)
    d = x * u + y * v - e
    for along, seen in ((rng.uniform(0.1, 9), True), (-rng.uniform(0.1, 9), False)):
        place = centre + e + along * d
        vectors = ["(" + ",".join(map(repr, map(float, each))) + ")" for each in (centre, u, v, e, place)]
        scene = text.read(
            f"CAMERA {' '.join(vectors[:4])}\nAMBIENT (1,1,1)\nSPHERE {vectors[4]} {1e-9 * size!r} {OPAQUE}"
        )
        assert (doubts.dark(scene) == []) == seen


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (VIEW + BALL, None),
        (VIEW, "the scene has no objects"),
        (VIEW[:33] + "BACKGROUND (0,0,0)\nAIR 1 1 (1,1,1)\n", "the scene has no objects"),
        (
            VIEW + f"POLYGON 4 (-99,-99,0) (99,-99,0) (99,99,0) (-99,99,0) {OPAQUE}".replace("(1,1,1)", "(0,0,0)"),
            "one surface fills",
        ),
        (VIEW + BALL.replace("(0,0,0)", "(0,0,9)", 1), None),
    ],
)
def test_pictures_of_one_colour(content, said, rayrace, write, tmp_path):
    write("scene.txt", content)
    small = ("render", "scene.txt", "-r", "python", "--width", 8, "--height", 8, "--json")
    done = rayrace(*small, cwd=tmp_path, code=0)
    told = json.loads(done.stdout)["warnings"]
    assert [text for text in told if "every pixel of the picture is (0, 0, 0): " in text] == [
        text for text in told if said and said in text
    ]
    assert len(told) == bool(said or "(0,0,9)" in content) and done.stderr.count("warning: ") == len(told)
    done = rayrace(*small, "--region", "0,0,2,2", cwd=tmp_path, code=0)
    assert "every pixel" not in done.stdout + done.stderr


def test_a_run_of_a_picture_of_one_colour(rayrace, write, tmp_path):
    """Its first repetition says so, and so does the report; not of other pictures, nor of the first pixels of one."""
    write(
        "black.txt",
        VIEW + f"POLYGON 4 (-99,-99,0) (99,-99,0) (99,99,0) (-99,99,0) {OPAQUE}".replace("(1,1,1)", "(0,0,0)"),
    )
    write("ball.txt", VIEW + BALL)
    head = 'title = "t"\nscenes = ["black.txt", "ball.txt"]\nrenderers = ["python"]\nprocesses = 2\nframes = 0\n'
    write("e.toml", head + '[image]\nwidth = 8\nheight = 8\n[sweep]\nregion = ["all", [0, 0, 2, 2]]\n')
    rayrace("run", "e.toml", "--out", "run", cwd=tmp_path, code=0)
    said = "every pixel of the picture is (0, 0, 0)"
    found = [record for record in store.read(tmp_path / "run")[1] if said in record["warnings"]]
    assert [(record["scene"], record["repetition"], record["parameters"]["region"]) for record in found] == [
        ("black.txt", 0, "0,0,8,8")
    ]
    several.make([tmp_path / "run"], tmp_path / "report")
    assert f"- python: {said} (" in (tmp_path / "report" / "report.md").read_text()


PLAIN = """CAMERA (0,0,0) (1,0,0) (0,1,0) 4
LIGHT (1,2,3) (1,1,1) 0
SPHERE (0,0,0) 1 (1,1,1) 0.5 20 (0,0,0) 9 1
"""
SOFT, ROUGH = PLAIN.replace("(1,1,1) 0\n", "(1,1,1) 0.5\n"), PLAIN.replace("9 1\n", "9 1 0.25\n")
MATT = ROUGH.replace("0.5 20", "0 20")  # a roughness, and nothing that it could be of
JOB = Parameters(depth=3, shadows=True)


@pytest.mark.parametrize(
    ("source", "values", "expected"),
    [
        (PLAIN, {}, None),
        (PLAIN, {"glossy_rays": 2}, "glossy_rays does nothing"),
        (MATT, {"glossy_rays": 2}, "glossy_rays does nothing"),
        (MATT, {}, None),
        (ROUGH, {"glossy_rays": 2}, None),
        (ROUGH, {}, "rendered as perfect mirrors"),
        (ROUGH, {"depth": 0}, None),
        (PLAIN, {"feelers": 2}, "feelers does nothing"),
        (SOFT, {"feelers": 2}, None),
        (SOFT, {}, "rendered as points"),
        (SOFT, {"shadows": False}, None),
    ],
)
def test_what_does_nothing_and_what_is_left_out(source, values, expected):
    found = doubts.of_methods(text.read(source, "scene.txt"), [replace(JOB, **values)])
    assert len(found) == bool(expected) and all(expected in what for what, _ in found)


def test_what_one_of_the_pictures_has_is_not_left_out():
    scene = text.read(ROUGH, "scene.txt")
    assert not doubts.of_methods(scene, [JOB, replace(JOB, glossy_rays=1)])
    assert not doubts.of_methods(scene, [JOB], free={"glossy_rays"}) and not doubts.of_methods(scene, [])


def test_a_warning_names_the_file_and_the_remedy():
    (warning,) = warnings(text.read(PLAIN, "scene.txt"), [replace(JOB, glossy_rays=1)])
    assert warning.startswith("scene.txt: glossy_rays does nothing") and "roughness above 0" in warning
