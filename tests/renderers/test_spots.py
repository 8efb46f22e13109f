"""Single pixels worked out one by one: they are those of the picture, in any precision (README.md, "Spots")."""

import sys
import tempfile
from pathlib import Path

import mpmath
import numpy as np
import pytest
from feature_scenes import features
from random_scenes import random_material, random_scene, random_stage

from harness.judge import reference
from harness.process import process
from harness.renderer import events, job
from harness.renderer.builder import fill
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.needs import needs

SEED = 60
SIZE = {"width": 13, "height": 11}
REGION = (4, 3, 11, 9)
NAMES = [
    *("transmission", "uniform", "jittered", "adaptive", "lens", "soft", "glossy"),
    *("mix: glass mesh and solid in water", "mix: jittered glass, soft shadows", "mix: all of it"),
]


@pytest.fixture(scope="module")
def scenes(tmp_path_factory):
    return features(tmp_path_factory.mktemp("meshes"))


@pytest.fixture
def work_out(known, tmp_path):
    """Rows (m, 3) of the pixels `wanted` (n, 2) of a scene, by the command of the manifest."""

    def run(source, wanted, parameters, seconds=600.0):
        here = Path(tempfile.mkdtemp(dir=tmp_path))
        scene = text.read(source, "scene of the test")
        needed, renderer = needs(scene, parameters), known["python"].renderer
        job.write(here / "job", {**flatten(scene), "spots": np.asarray(wanted, np.int32)}, parameters, needed)
        for name in ("out", "neutral"):
            (here / name).mkdir()
        places = {"folder": str(renderer.folder), "python": sys.executable}
        command = [fill(word, places) for word in renderer.manifest.spots.command]
        command += job.flags(here / "job", here / "out", "python", None, parameters, needed)
        stdout, stderr = here / "stdout", here / "stderr"
        outcome = process.run([*command, f"--seconds={seconds}"], here / "neutral", stdout, stderr, 600.0)
        assert outcome.code == 0, stderr.read_text()
        said = events.read(stdout)
        assert not said.faults and said.output == "spots.npy"
        return np.load(here / "out" / said.output)

    return run


def some(rng, count, width=SIZE["width"], height=SIZE["height"]):
    """Pixels (count, 2) in no order, columns and rows, with a corner of the picture and one of them twice."""
    pixels = np.column_stack([rng.integers(0, width, count), rng.integers(0, height, count)])
    pixels[0], pixels[-1] = (width - 1, height - 1), pixels[1]
    return pixels


@pytest.mark.parametrize("name", NAMES)
def test_spots_are_pixels_of_the_picture(bench, scenes, work_out, name):
    print("seed", SEED)
    source, jobs = scenes[name]
    pixels = some(np.random.default_rng(SEED), 8)
    picture = bench.result("python", source, exact=True, **SIZE, **jobs).array
    expected = picture[pixels[:, 1], pixels[:, 0]]
    assert work_out(source, pixels, Parameters(**SIZE, **jobs)).tobytes() == expected.tobytes()
    assert len(np.unique(expected, axis=0)) > 2, "the spots show nothing"


@pytest.mark.parametrize("name", ["jittered", "adaptive"])
def test_a_region_moves_no_spot(bench, scenes, work_out, name):
    source, jobs = scenes[name]
    x0, y0, x1, y1 = REGION
    picture = bench.result("python", source, exact=True, **SIZE, **jobs, region=REGION).array
    pixels = np.array([(x, y) for y in range(y0, y1) for x in range(x0, x1)])
    found = work_out(source, pixels, Parameters(**SIZE, **jobs, region=REGION))
    assert found.reshape(picture.shape).tobytes() == picture.tobytes()


def test_spots_are_cut_off_as_the_picture_is(bench, scenes, work_out):
    source, jobs = scenes["mix: glass, mirrors, shadows"]
    jobs = {**SIZE, **jobs, "cutoff": 2.0**-4}
    cut = bench.result("python", source, exact=True, **jobs)
    rows, columns = np.nonzero(cut.dropped)
    found = work_out(source, np.column_stack([columns, rows]), Parameters(**jobs))
    assert len(rows) > 10 and found.tobytes() == cut.array[rows, columns].tobytes()


def mirrors():
    rng = np.random.default_rng(SEED)
    return random_scene(rng, 12, 0, 0, 0, material=random_material, rest=random_stage(rng))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["mirrors", "mix: jittered glass, soft shadows", "mix: all of it"])
def test_sixty_digits_agree_with_float64(known, bench, scenes, work_out, name):
    print("seed", SEED)
    source, jobs = scenes.get(name) or (mirrors(), {"depth": 6, "shadows": True})
    size = {"width": 48, "height": 40}
    parameters = Parameters(**size, **jobs)
    scene = text.read(source, name)
    maker = known["cpp"] if not known["cpp"].unavailable else known["numpy"]
    made = bench.reference(maker, flatten(scene), parameters, needs(scene, parameters))
    assert isinstance(made, reference.Reference), made
    rows, columns = np.random.default_rng(SEED).permutation(np.argwhere(~made.mask))[:10].T
    digits = Parameters(**size, **jobs, precision="mp60", epsilon=parameters.values()["epsilon"])
    found = work_out(source, np.column_stack([columns, rows]), digits)
    off = np.abs(found - made.picture[rows, columns])
    print(f"{maker.name}: off by up to {off.max():.3g}")
    assert off.max() <= 1e-10


def by_hand(arrays, i, j):
    """Linear RGB of pixel (i, j) of a matte sphere in 80 digits (CAM-2, CAM-3, SPH-2, LOC-1 to LOC-3)."""
    with mpmath.workdps(80):
        c, u, v, e, centre = map(mpmath.matrix, (*arrays["camera"], arrays["spheres"][0, :3]))
        radius, half = mpmath.mpf(arrays["spheres"][0, 3]), mpmath.mpf(0.5)
        d = (2 * (i + half) / SIZE["width"] - 1) * u + (1 - 2 * (j + half) / SIZE["height"]) * v - e
        d /= mpmath.norm(d)
        f = c + e - centre
        b = mpmath.fdot(f, d)
        discriminant = b * b - mpmath.fdot(f, f) + radius * radius
        if discriminant < 0:
            return arrays["background"]
        n = (f - (b + mpmath.sqrt(discriminant)) * d) / radius
        light = mpmath.matrix(arrays["ambient"])
        for *place, red, green, blue, _ in arrays["lights"]:
            l = mpmath.matrix(place) - centre - radius * n  # noqa: E741, the SPEC's letter
            light += max(0, mpmath.fdot(n, l) / mpmath.norm(l)) * mpmath.matrix([red, green, blue])
        return [float(k * x) for k, x in zip(map(mpmath.mpf, arrays["materials"][0, :3]), light, strict=True)]


def test_sixty_digits_are_right_to_the_last_bit(work_out):
    print("seed", SEED)
    ball = "SPHERE (0.11,-0.07,0.23) 1.7 (0.7,0.5,0.3) 0 20 (0,0,0) 9 1"
    source = f"{random_stage(np.random.default_rng(SEED))}\n{ball}\n"
    arrays = flatten(text.read(source, "one sphere"))
    pixels = [(i, j) for j in range(SIZE["height"]) for i in range(SIZE["width"])]
    expected = np.array([by_hand(arrays, i, j) for i, j in pixels])
    found = work_out(source, pixels, Parameters(**SIZE, depth=0, precision="mp60"))
    assert found.tobytes() == expected.tobytes()
    assert len(np.unique(found)) > 50, "the scene shows nothing"


def test_no_spot_is_begun_when_the_time_is_over(work_out, scenes):
    source, jobs = scenes["soft"]
    found = work_out(source, some(np.random.default_rng(SEED), 8), Parameters(**SIZE, **jobs), seconds=0)
    assert found.shape == (0, 3) and found.dtype == np.float64


@pytest.mark.alone
def test_spots_end_in_time(work_out, scenes):
    """Rows of the first pixels only, as many as there was time for."""
    source, jobs = scenes["soft"]
    pixels = np.tile(some(np.random.default_rng(SEED), 8), (50_000, 1))
    found = work_out(source, pixels, Parameters(**SIZE, **jobs), seconds=3)
    print(len(found), "spots")
    assert 8 < len(found) < len(pixels)
    assert found[8:16].tobytes() == found[:8].tobytes()
