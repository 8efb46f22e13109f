"""`rayrace render` and `rayrace trace` through the command line."""

import csv
import json
from itertools import pairwise

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from harness.picture import colour
from harness.scene import text
from harness.single import single

SCENE = """CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)
BACKGROUND (0.2,0.5,0.7)
AMBIENT (1,1,1)
SPHERE (0,0,0) 0.5 (1,0.5,0) 0 1 (0,0,0) 1e6 1
"""
SIDES = "--width", "--height"
PICTURE = ("-r", "python", "--width", 12, "--height", 8)


@pytest.fixture
def scene(write):
    return write("scene.txt", SCENE)


def test_render_to_each_kind_of_file(rayrace, scene, tmp_path):
    for suffix in (".npy", ".png", ".exr"):
        done = rayrace("render", scene, *PICTURE, "-o", tmp_path / f"a{suffix}", code=0)
        assert done.stdout.startswith(f"{tmp_path}/a{suffix}: 12 x 8, python, float64: ") and "96 rays" in done.stdout
    linear = np.load(tmp_path / "a.npy")
    assert linear.shape == (8, 12, 3) and linear.dtype == np.float64
    png = np.asarray(Image.open(tmp_path / "a.png"))
    assert np.abs(png[0, 0] - np.array([51, 127.5, 178.5])).max() <= 0.5
    assert np.abs(png[4, 6] - np.array([255, 127.5, 0])).max() <= 0.5
    with OpenEXR.File(str(tmp_path / "a.exr")) as file:
        assert np.array_equal(file.channels()["RGB"].pixels, linear.astype(np.float32))


@pytest.mark.parametrize(
    ("sides", "size"),
    [((), (40, 20)), (("--width", 12), (12, 6)), (("--height", 9), (18, 9)), (("--width", 1), (1, 1))],
)
def test_a_picture_has_the_shape_of_its_screen(rayrace, write, tmp_path, monkeypatch, sides, size):
    """By the screen's axes, which need not be parallel to those of the scene."""
    wide = SCENE.replace("(1,0,0) (0,1,0)", "(1.2,0,1.6) (0,1,0)")
    monkeypatch.setattr(single.size, "__defaults__", (40,))
    found = single.size(
        text.read(wide), *(None if not sides else sides[1] if name in sides else None for name in SIDES)
    )
    assert (found["width"], found["height"]) == size
    if sides:
        done = rayrace("render", write("scene.txt", wide), "-r", "python", *sides, "-o", tmp_path / "a.npy", code=0)
        assert np.load(tmp_path / "a.npy").shape == (size[1], size[0], 3) and "stretches" not in done.stderr


@pytest.mark.parametrize(("size", "words"), [((8, 8), "take 8 x 4 or 16 x 8"), ((9, 4), ""), ((8, 3), "")])
def test_a_picture_that_stretches_its_screen_is_warned_of(rayrace, write, tmp_path, size, words):
    """To a pixel, that rounding takes, it has the shape."""
    scene = write("scene.txt", SCENE.replace("(1,0,0)", "(2,0,0)"))
    sides = "--width", size[0], "--height", size[1]
    done = rayrace("render", scene, "-r", "python", *sides, "-o", tmp_path / "a.npy", code=0)
    assert (
        (words in done.stderr and "scene.txt:1: a picture of 8 x 8 stretches" in done.stderr)
        if words
        else not (done.stderr)
    )


def test_render_says_json(rayrace, scene, tmp_path):
    done = rayrace("render", scene, *PICTURE, "--frames", 2, "--json", "-o", tmp_path / "a.npy", code=0)
    told = json.loads(done.stdout)
    assert (told["renderer"], told["width"], told["height"], len(told["frames_s"])) == ("python", 12, 8, 3)
    assert told["rays"]["primary"] == 96


UNKNOWN_ERROR = "accuracy not measured (add --max-error)"


def test_render_tells_its_error_once_a_run_has_made_a_reference(rayrace, experiment, tmp_path):
    file = experiment(["python"], scene=SCENE)
    words = ("render", file.parent / "scene.txt", "-r", "python", "--width", 8, "--height", 7, "--depth", 1)
    words += ("--no-shadows", "-o", tmp_path / "a.npy")
    mine = {"RAYRACE_CACHE": str(tmp_path / "cache")}
    before = rayrace(*words, env=mine, code=0).stdout
    unknown = "not measured; `rayrace run` measures it, "
    assert UNKNOWN_ERROR in before and f"agreement unavailable: {unknown}" in before
    before = json.loads(rayrace(*words, "--json", env=mine, code=0).stdout)
    assert all(before[name]["unavailable"].startswith(unknown) for name in ("error", "agreement"))
    rayrace("run", file, "--out", tmp_path / "run", env=mine, code=0)
    told = json.loads(rayrace(*words, "--json", env=mine, code=0).stdout)
    agreement, error = told["agreement"], told["error"]
    (reference,), (truth,), (noise,) = (
        [np.load(path) for path in (tmp_path / "run" / "pictures").glob(f"*.{name}.npy")]
        for name in ("reference", "truth", "standard_error")
    )
    made = np.load(tmp_path / "a.npy")
    assert agreement["reference"] != "python" and agreement["wrong"] is None
    assert agreement["max_outside"] <= np.abs(made - reference).max()
    assert error["rmse"] == pytest.approx(np.sqrt(((made - truth) ** 2).mean() - (noise**2).mean()))
    assert error["max"] == pytest.approx(np.abs(made - truth).max()) and error["against"] == "scene"
    said = rayrace(*words, env=mine, code=0).stdout
    assert f"RMSE {error['rmse']:.2g}, largest error {error['max']:.3g}" in said and "agreement ✓" in said
    other = [2 if before == "--depth" else word for before, word in pairwise(("", *words))]
    again = rayrace(*other, env=mine, code=0).stdout  # the truth is that of the scene, whatever the depth
    assert "RMSE" in again and f"agreement unavailable: {unknown}" in again
    other = [9 if before == "--height" else word for before, word in pairwise(("", *words))]
    assert UNKNOWN_ERROR in rayrace(*other, env=mine, code=0).stdout


def test_render_a_region(rayrace, scene, tmp_path):
    rayrace("render", scene, *PICTURE, "-o", tmp_path / "all.npy", code=0)
    rayrace("render", scene, *PICTURE, "--region", "3,2,9,7", "-o", tmp_path / "part.npy", code=0)
    assert np.array_equal(np.load(tmp_path / "part.npy"), np.load(tmp_path / "all.npy")[2:7, 3:9])


@pytest.mark.parametrize(
    ("variant", "suffix", "code", "message"),
    [
        ("bad-nan", ".png", 1, "error: bad-nan made pixels that are not finite; save it as .npy to look into it"),
        ("bad-nan", ".npy", 0, ""),
        ("bad-hang", ".npy", 1, "error: bad-hang: timeout: killed after "),
        ("bad-segv", ".npy", 1, "error: bad-segv: failed: ended by SIGSEGV"),
        ("bad-refuse", ".npy", 2, "error: bad-refuse is unsupported: no scene today"),
        ("bad-no-command", ".npy", 1, "error: bad-no-command: failed: could not start no-such-program-at-all"),
    ],
)
def test_render_by_a_bad_one(variant, suffix, code, message, rayrace, write, bad_folder, tmp_path):
    scene = write("empty.txt", SCENE.partition("AMBIENT")[0])
    out = tmp_path / f"a{suffix}"
    words = (
        "-r",
        variant,
        "--renderer",
        bad_folder(variant, name="single"),
        "--timeout",
        2 if variant == "bad-hang" else 60,
        "--width",
        8,
        "--height",
        8,
    )
    done = rayrace("render", scene, *words, "-o", out, code=code)
    assert done.stderr.startswith(message)
    assert out.exists() == (code == 0)


def test_trace(rayrace, scene, write, tmp_path):
    rays = write("rays.csv", "ox,oy,oz,dx,dy,dz\n0,0,2,0,0,-4\n9,9,9,1,0,0\n0,2,0,0,-1e-200,0\n")
    done = rayrace("trace", scene, rays, "-r", "python", code=0)
    rayrace("trace", scene, rays, "-r", "python", "-o", tmp_path / "hits.csv", code=0)
    assert (tmp_path / "hits.csv").read_text() == done.stdout
    first, second, third = csv.DictReader(done.stdout.splitlines())
    assert [float(value) for value in first.values()] == pytest.approx([1, 1.5, 0, 0, 0.5, 0, 0, 1, 0], abs=1e-12)
    assert second["hit"] == "0" and set(second.values()) == {"0", ""}
    assert float(third["py"]) == pytest.approx(0.5)


def test_trace_no_rays(rayrace, scene, write):
    for name in ("python", "numpy", "cpp"):
        done = rayrace("trace", scene, write("rays.csv", "ox,oy,oz,dx,dy,dz\n"), "-r", name)
        if "is unavailable" not in done.stderr:
            assert done.returncode == 0 and done.stdout == "hit,t,px,py,pz,nx,ny,nz,object\n", done.stderr


HITS = """import json, struct, sys, time
flags = dict(word[2:].split("=", 1) for word in sys.argv[1:])
now = time.monotonic()
rows = {rows}
with open(flags["out"] + "/hits.npy", "wb") as file:
    header = "{{'descr': '<f8', 'fortran_order': False, 'shape': (%d, 8), }}" % (len(rows) // 8)
    header = header.ljust(117) + "\\n"
    file.write(b"\\x93NUMPY\\x01\\x00" + struct.pack("<H", len(header)) + header.encode())
    file.write(struct.pack("<%dd" % len(rows), *rows))
print(json.dumps({{"event": "frame", "index": 0, "start": now, "end": time.monotonic()}}))
print(json.dumps({{"event": "output", "file": "hits.npy"}}))
"""
MANIFEST = """contract = 1
name = "hits"
technology = "Python"
description = "answers what it is told"
features = ["sphere", "rays"]
[[variant]]
name = "hits"
command = ["{python}", "-S", "{folder}/main.py"]
"""
HIT = "[1.0, 0, 0, 0, 0, 0, 1, {object}]"


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (HIT.format(object="0"), None),
        ("[1e999, 0, 0, 0, 0, 0, 0, -1]", None),
        ("[]", "has shape (0, 8), expected (1, 8)"),
        (HIT.format(object="0") + " * 2", "has shape (2, 8), expected (1, 8)"),
        (HIT.format(object="float('nan')"), "holds a row that is neither a hit nor a miss"),
        (HIT.format(object="float('inf')"), "holds a row that is neither a hit nor a miss"),
        (HIT.format(object="0.5"), "holds a row that is neither a hit nor a miss"),
        (HIT.format(object="-2"), "holds a row that is neither a hit nor a miss"),
        (HIT.format(object="0").replace("1.0", "float('nan')"), "holds a row that is neither a hit nor a miss"),
    ],
)
def test_trace_by_one_that_answers_oddly(rows, message, rayrace, scene, write):
    folder = write("hits/renderer.toml", MANIFEST).parent
    write("hits/main.py", HITS.format(rows=rows))
    rays = write("rays.csv", "ox,oy,oz,dx,dy,dz\n0,0,2,0,0,-4\n")
    done = rayrace("trace", scene, rays, "-r", "hits", "--renderer", folder, code=0 if message is None else 1)
    assert (message or "") in done.stderr


def test_srgb_arithmetic_multiplies_codes(rayrace, tmp_path):
    """A grey wall in grey light: 0.5 x 0.5 of sRGB codes is 0.25 of them, of light it is less dark (figure 2.6)."""
    scene = tmp_path / "grey.txt"
    wall = "POLYGON 4 (-9,-9,0) (9,-9,0) (9,9,0) (-9,9,0) (0.5,0.5,0.5) 0 1 (0,0,0) 1 1\n"
    scene.write_text("CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\nAMBIENT (0.5,0.5,0.5)\n" + wall)
    shown = {}
    for name in ("linear", "srgb"):
        out = tmp_path / f"{name}.png"
        rayrace("render", scene, "-r", "python", "-o", out, "--width", 2, "--height", 2, "--arithmetic", name, code=0)
        with Image.open(out) as picture:
            shown[name] = picture.getpixel((0, 0))[0]
    assert shown["srgb"] == round(0.25 * 255)
    assert shown["linear"] == colour.encode_8bit(colour.decode(0.5) ** 2)
