"""Pictures that are put together from tiles."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import tifffile
from tiled import EMPTY, folder_of, image

from harness.errors import UserError
from harness.picture.grid import Grid
from harness.single import mosaic, single
from harness.store import store

# In general position: shapes that mirror and let light through, a light with a radius, an eye that is not straight.
SCENE = """CAMERA (0.13,0.07,0) (1.5,0,-0.2) (0,1.5,0) (0.8,0.31,6)
BACKGROUND (0.2,0.5,0.7)
AMBIENT (0.21,0.23,0.19)
LIGHT (4.1,5.3,6.2) (0.7,0.8,0.6) 0.5
SPHERE (-0.71,0.53,0.11) 0.62 (0.7,0.5,0.3) 0.6 20 (0,0,0) 1e6 1 0.3
SPHERE (0.67,0.59,-0.83) 0.55 (0.1,0.2,0.3) 0.6 20 (0.9,0.8,1) 2.25 1
BOX (0.21,-1.13,-0.37) (0.71,0.13,0.05) (-0.11,0.83,0.17) (0.07,-0.21,0.77) (0.3,0.6,0.7) 0.5 20 (0,0,0) 9 1
"""
SMALL = ("-r", "python", "--width", 13, "--height", 9, "--depth", 3)
HERE = mosaic.way("", (), "")


@pytest.fixture
def scene(write):
    return write("scene.txt", SCENE)


@pytest.fixture
def both(scene, tmp_path, capsys):
    """Render in one piece and in tiles: both("cpp", 7, ".tif", samples=2) is the two files, and what was told."""

    def make(variant, side, suffix, **values):
        one, many = tmp_path / f"one{suffix}", tmp_path / f"many{suffix}"
        told = []
        for out, do in ((one, "one"), (many, "many")):
            if do == "one":
                single.render(scene, variant, out, image(**values), 0, 600, (), True)
            else:
                mosaic.render(scene, variant, out, image(**values), side, HERE, 600, (), True)
            told.append(json.loads(capsys.readouterr().out))
        assert not many.with_name("many.tif.tiles").exists() and not list(tmp_path.glob("*.part"))
        return one, many, *told

    return make


@pytest.mark.parametrize("bounds", [(0, 0, 1, 1), (0, 0, 40, 30), (3, 2, 40, 31), (7, 0, 8, 99)])
@pytest.mark.parametrize("side", [1, 7, 16, 1000])
def test_a_grid_has_every_pixel_once(bounds, side):
    grid, seen = Grid(bounds, side), np.zeros((120, 60), int)
    for number in range(grid.count):
        x0, y0, x1, y1 = grid.region(number)
        seen[y0:y1, x0:x1] += 1
        assert grid.shape(number) == (y1 - y0, x1 - x0, 3) and 0 < x1 - x0 <= side and 0 < y1 - y0 <= side
    x0, y0, x1, y1 = bounds
    assert (seen[y0:y1, x0:x1] == 1).all() and seen.sum() == (x1 - x0) * (y1 - y0)


def test_a_grid_is_not_of_too_many():
    with pytest.raises(UserError, match=r"--tiles 1: that makes 1,001,000 tiles; expected 1,000,000 at most"):
        Grid((0, 0, 1001, 1000), 1)


@pytest.mark.parametrize("side", [1, 5, 16, 100])
def test_a_crop_of_tiles_is_that_of_the_picture(side, tmp_path):
    rng = np.random.default_rng(side)
    bounds = (11, 5, 48, 28)
    place, pixels = folder_of(tmp_path / "a", bounds, side), rng.random((23, 37, 3))
    for number in range(place.grid.count):
        x0, y0, x1, y1 = place.grid.region(number)
        store.save_whole(place.path / f"{number}.npy", pixels[y0 - 5 : y1 - 5, x0 - 11 : x1 - 11])
    for _ in range(50):
        (x0, x1), (y0, y1) = (sorted(rng.choice(length + 1, 2, replace=False)) for length in (37, 23))
        assert np.array_equal(place.crop(x0, y0, x1, y1), pixels[y0:y1, x0:x1])


CASES = {
    "one": {"region": "3,2,36,21"},
    "jittered": {"sampler": "jittered", "samples": 2, "seed": 5},
    "adaptive": {"sampler": "adaptive", "adaptive_depth": 2, "region": "3,2,36,21"},
    "lens": {"sampler": "uniform", "samples": 2, "lens_radius": 0.2, "focal_distance": 6.0},
    "soft": {"feelers": 3, "glossy_rays": 2, "seed": 8},
    "float32": {"precision": "float32"},
    "cutoff": {"cutoff": 0.05},
    "lanes": {"vector": "on", "shadows": False},
}


@pytest.mark.parametrize(
    ("variant", "case"),
    [
        *(("cpp", case) for case in CASES),
        ("cpp-threads", "adaptive"),
        *(pytest.param("numpy", case, marks=pytest.mark.slow) for case in ("one", "adaptive", "soft")),
        *(pytest.param("numba", case, marks=pytest.mark.slow) for case in ("one", "adaptive", "soft")),
    ],
)
def test_tiles_make_the_same_file(variant, case, both, known):
    if known[variant].unavailable:
        pytest.skip(known[variant].unavailable)
    values = CASES[case]
    if "general" in known[variant].methods.get("kernel", ()) and known[variant].renderer.manifest.build:
        values = {**values, "kernel": "general"}  # so that they share one build
    for side, suffix in ((16, ".tif"), (11, ".npy")):
        one, many, told_one, told = both(variant, side, suffix, **values)
        assert one.read_bytes() == many.read_bytes()
        assert (told["width"], told["height"]) == (told_one["width"], told_one["height"])
        if case == "adaptive":
            assert told["rays"]["primary"] > told_one["rays"]["primary"] and "SAM-5" in told["rays_note"]
        else:
            assert told["rays"] == told_one["rays"] and told["rays_note"] is None
        if case == "cutoff":
            assert told_one["bound"]["mean"] > 0 and told["bound"] == pytest.approx(told_one["bound"], rel=1e-12)
        else:
            assert told["bound"] is None
    whole = tifffile.imread(one.with_suffix(".tif"))
    assert np.array_equal(whole, np.load(one)) and whole.dtype == np.load(one).dtype and np.ptp(whole) > 0.1


def test_by_the_command_line(rayrace, scene, tmp_path):
    one, many = tmp_path / "one.tif", tmp_path / "many.tif"
    words = ("render", scene, *SMALL, "--region", "1,2,12,9", "--sampler", "jittered", "--samples", 2)
    rayrace(*words, "-o", one, code=0)
    done = rayrace(*words, "-o", many, "--tiles", 6, code=0)
    assert one.read_bytes() == many.read_bytes()
    assert done.stdout.startswith(f"{many}: 11 x 7, ") and ": 4 tiles, " in done.stdout and " rays\n" in done.stdout
    assert (
        done.stdout.splitlines()[1]
        == "error and agreement unavailable: not measured; pictures in tiles are not compared with a reference"
    )
    lines = done.stderr.splitlines()
    assert [line.split(": ")[0] for line in lines] == [
        "[1/4] 1,2,7,8", "[2/4] 7,2,12,8", "[3/4] 1,8,7,9", "[4/4] 7,8,12,9", *["warning"] * 3,
    ]  # fmt: skip
    assert sorted(path.name for path in tmp_path.iterdir()) == ["many.tif", "one.tif", "scene.txt"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("-o", "a.png", "--tiles", 4), "a.png: with --tiles the picture must be .tif or .npy"),
        (("-o", "a.tif", "--executor", "slurm"), "--executor, --slurm and --dask are for tiles; add --tiles 1024, say"),
        (("-o", "a.tif", "--slurm", "time=5"), "--executor, --slurm and --dask are for tiles"),
        (("-o", "a.tif", "--tiles", 4, "--frames", 1), "--frames: not with --tiles, where nothing is timed"),
        (("-o", "a.tif", "--tiles", 4, "--max-error", "1/255"), "--max-error: not with --tiles"),
        (("-o", "a.tif", "--tiles", 4, "--executor", "pbs"), "--executor pbs: known: local, slurm, dask"),
        (("-o", "a.tif", "--tiles", 4, "--slurm", "time=5"), "--slurm: only with --executor slurm"),
        (
            ("-o", "a.tif", "--tiles", 4, "--executor", "dask"),
            "--executor dask and --dask ADDRESS (of the scheduler) go together",
        ),
        (("-o", "a.tif", "--tiles", 4, "--executor", "slurm", "--slurm", "x"), "--slurm x: expected key=value, such"),
        (
            ("-o", "a.tif", "--tiles", 4, "--executor", "slurm", "--slurm", "tim='2 h'"),
            '--slurm: tim: unknown key; did you mean "time"?',
        ),
        (
            ("-o", "a.tif", "--tiles", 4, "--executor", "slurm", "--slurm", "options.qos=long", "--slurm", "cells=0"),
            "--slurm: cells: Input should be greater than or equal to 1",
        ),
        (("-o", "a.tif", "--tiles", 4, "--vector", "on"), "python is unsupported: has no vector on"),
        (("-o", "a.tif", "--tiles", 1, "--width", 2000, "--height", 2000), "--tiles 1: that makes 4,000,000 tiles; "),
        (("-o", "no/a.tif", "--tiles", 4), "no: no such folder"),
    ],
)
def test_wrong_use(words, message, rayrace, scene, tmp_path):
    small = SMALL if "--width" not in words else SMALL[:2]
    done = rayrace("render", scene, *small, *words, cwd=tmp_path, code=2)
    assert done.stderr.startswith(f"error: {message}")
    assert [path.name for path in tmp_path.iterdir()] == ["scene.txt"]


def test_a_renderer_without_regions(rayrace, write, bad_folder, tmp_path):
    folder = bad_folder("bad-nothing", name="whole")
    manifest = folder / "renderer.toml"
    manifest.write_text(manifest.read_text().replace('features    = ["region"]', "features    = []"))
    words = ("render", write("empty.txt", EMPTY), "-r", "bad-nothing", "--renderer", folder, "-o", tmp_path / "a.npy")
    done = rayrace(*words, "--width", 8, "--height", 8, "--tiles", 5, code=2)
    assert done.stderr == "error: bad-nothing is unsupported: does not support region\n"
    rayrace(*words, "--width", 8, "--height", 8, "--tiles", 8, code=0)  # one tile is the whole


def start(environment, *words):
    """The command in a session of its own, and its output in nobody's way."""
    program = Path(sys.executable).with_name("rayrace")
    return subprocess.Popen(
        [program, *map(str, words)], env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
        start_new_session=True, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGINT])
def test_the_same_command_goes_on(how, rayrace, scene, environment, tmp_path):
    out = tmp_path / "a.tif"
    # so many samples that a second or more is left when the signal is sent
    picture = "render", scene, "-r", "python", "--width", 51, "--height", 40, "--samples", 5
    words = *picture, "-o", out, "--tiles", 9
    harness = start(environment, *words)
    until = time.monotonic() + 60
    while not (out.with_name("a.tif.tiles") / "2.npy").exists():
        assert time.monotonic() < until and harness.poll() is None
        time.sleep(0.02)
    os.kill(harness.pid, how)
    said = harness.communicate()[1]
    kept = {path: path.stat().st_mtime_ns for path in out.with_name("a.tif.tiles").glob("*.npy")}
    assert not out.exists() and 3 <= len(kept) < 30
    if how == signal.SIGINT:
        assert f"stopped; finished tiles stay in {out}.tiles; the same command goes on\n" in said
        assert harness.returncode == 130
    done = rayrace(*words, "--json", code=0)
    told = json.loads(done.stdout)
    assert told["kept"] == len(kept) and told["tiles"] == 30
    first, *lines, slant, glossy, soft = done.stderr.splitlines()
    assert slant.startswith(f"warning: {scene}:1: the eye is ")
    assert "rendered as perfect mirrors" in glossy and "rendered as points" in soft
    assert first == f"{len(kept)} of 30 tiles are already in {out}.tiles" and len(lines) == 30 - len(kept)
    rayrace(*picture, "--json", "-o", tmp_path / "one.tif", code=0)
    assert out.read_bytes() == (tmp_path / "one.tif").read_bytes()


def test_a_renderer_that_fails_ends_it(rayrace, write, bad_folder, tmp_path):
    """Other tiles would fail alike: nobody waits for each of them."""
    words = ("render", write("empty.txt", EMPTY), "-r", "bad-segv", "--renderer", bad_folder("bad-segv", name="fails"))
    done = rayrace(*words, "--width", 8, "--height", 8, "-o", tmp_path / "a.tif", "--tiles", 3, code=1)
    first, second = done.stderr.splitlines()
    assert first.startswith("1 job: ") and ": bad-segv: failed at --region 0,0,3,3: ended by SIGSEGV" in first
    assert second == "error: 9 of 9 tiles are missing; the same command renders those alone"


def test_one_at_a_time(rayrace, scene, environment, tmp_path):
    words = ("render", scene, "-r", "python", "--width", 51, "--height", 40, "--samples", 5, "--tiles", 17)
    words += ("-o", tmp_path / "a.tif")
    first = start(environment, *words)
    try:
        until = time.monotonic() + 60
        while not (tmp_path / "a.tif.tiles" / "0.npy").exists():
            assert time.monotonic() < until and first.poll() is None
            time.sleep(0.02)
        first.send_signal(signal.SIGSTOP)  # so that it is not done before the second begins
        done = rayrace(*words, code=2)
        assert done.stderr == f"error: {tmp_path}/a.tif.tiles: another rayrace is at work on it\n"
    finally:
        first.send_signal(signal.SIGCONT)
        first.communicate()
    assert first.returncode == 0
