"""numba with `vector` on: rays in lanes find what rays one after another do (VEC-1), and tiles leave out nothing that
their rays can meet (VEC-2)."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest
from random_scenes import random_scene, random_stage, words

from harness.process import repetition
from harness.renderer import job
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.needs import needs

pytest.importorskip("numba")
SIDE = 32  # of a tile
WIDE, HIGH = 10 * SIDE, 6 * SIDE
RENDERERS = Path(__file__).parents[2] / "renderers"
STAGE = (
    "CAMERA (0.1,0,0) (2.4,0,0) (0,1.9,0) (0.3,0.4,6)\nAMBIENT (0.2,0.25,0.3)\nBACKGROUND (0.1,0.12,0.2)\n"
    "AIR 1.21 1.1 (1,1,1)\n"
)
LIGHTS = "LIGHT (3,5,6) (0.8,0.7,0.6) 0\nLIGHT (-4,2,-3) (0.4,0.5,0.6) 0\n"
CROWD = (
    "SPHERE (0.4,0.3,0.1) 0.8 (0.6,0.5,0.4) 0.7 20 (0,0,0) 16 1.5\n"
    "SPHERE (-1.1,-0.4,0.6) 0.7 (0.2,0.6,0.5) 0.9 4.5 (0,0,0) 400 1\n"
)
# Ways to be special: (lights, spheres, parameters).
CASES = {
    "one pixel": (LIGHTS, CROWD, {"width": 1, "height": 1}),
    "3 x 5": (LIGHTS, CROWD, {"width": 3, "height": 5}),
    "a column": (LIGHTS, CROWD, {"width": 1, "height": 70}),
    "a row": (LIGHTS, CROWD, {"width": 67, "height": 1}),
    "region across tiles": (LIGHTS, CROWD, {"width": 90, "height": 80, "region": (13, 21, 71, 58)}),
    "region of a pixel": (LIGHTS, CROWD, {"width": 90, "height": 80, "region": (46, 39, 47, 40)}),
    "place in the pixel": (LIGHTS, CROWD, {"sample_x": 0.0, "sample_y": 0.9}),
    "eye inside": (LIGHTS, CROWD + "SPHERE (0.4,0.3,6) 7 (0.2,0.3,0.4) 0.6 9 (0,0,0) 3 1\n", {}),
    "behind the eye": (LIGHTS, CROWD + "SPHERE (1,1,9) 1.5 (0.2,0.3,0.4) 0.6 9 (0,0,0) 30 1\n", {}),
    "as wide as the eye sees": ("", "", {}),
    "lights within": ("LIGHT (0.4,0.3,0.1) (1,1,1) 0\nLIGHT (0,0.2,-9) (1,1,1) 0\n", CROWD, {}),
    "no light": ("", CROWD, {}),
    "order 0": (LIGHTS, CROWD, {"depth": 0}),
    "order 1": (LIGHTS, CROWD, {"depth": 1}),
    "exponents": (LIGHTS, CROWD.replace(" 20 (", " 0 (").replace(" 4.5 (", " 1 ("), {}),
    "a sharp highlight": (LIGHTS, CROWD.replace(" 20 (", " 1e4 ("), {}),
    "matte": (LIGHTS, CROWD.replace(" 0.7 20 ", " 0 20 ").replace(" 0.9 4.5 ", " 0 4.5 "), {}),
    "matte beside mirrors": (LIGHTS, CROWD.replace(" 0.7 20 ", " 0 20 "), {}),
    "not there": (LIGHTS, CROWD.replace(" 16 1.5", " 1.21 1.1"), {}),
    "nothing but light": (LIGHTS, "SPHERE (90,0,0) 0.5 (0.2,0.3,0.4) 0.6 9 (0,0,0) 3 1\n", {}),
}


def random_material(rng):
    """Opaque; one in four is matte."""
    shine = rng.choice([0, *rng.uniform(0.2, 0.8, 3)])
    return f"{words(rng.uniform(0.1, 0.9, 3))} {shine} {rng.uniform(1, 60)} (0,0,0) {rng.uniform(2, 400)} 1.3"


def around(rng, count):
    """Spheres in all directions from the eye of STAGE, near and far, small and large."""
    lines = []
    for _ in range(count):
        way = rng.normal(size=3)
        distance = 10 ** rng.uniform(0, 2)
        centre = np.array((0.4, 0.4, 6)) + way / np.linalg.norm(way) * distance
        lines.append(f"SPHERE {words(centre)} {distance * rng.uniform(0.02, 0.5)} {random_material(rng)}\n")
    return "".join(lines)


def agree(bench, source, variant="numba", **parameters):
    """In lanes the picture is, to 1e-9, and the counts of rays are those of C++."""
    wanted = {"width": 60, "height": 44, "depth": 3, **parameters}
    found = bench.result(variant, source, exact=True, vector="on", **wanted)
    expected = bench.result("cpp", source, **wanted)
    np.testing.assert_allclose(found.array, expected.array, rtol=0, atol=1e-9)
    assert found.said.rays == expected.said.rays
    assert found.said.used["methods"]["vector"] == "on"
    return found


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_special_scenes(bench, case):
    lights, spheres, parameters = CASES[case]
    if case == "as wide as the eye sees":
        source = STAGE.replace("(0.3,0.4,6)", "(0.01,0.02,0.05)") + LIGHTS + around(np.random.default_rng(5), 60)
    else:
        source = STAGE + lights + spheres
    agree(bench, source, shadows=True, **parameters)


def eye_ray(i, j):
    """Unit direction through the middle of pixel (i, j) of WIDE x HIGH, by STAGE (CAM-3)."""
    x, y = 2 * (i + 0.5) / WIDE - 1, 1 - 2 * (j + 0.5) / HIGH
    direction = np.array((2.4 * x, 1.9 * y, 0)) - (0.3, 0.4, 6)
    return direction / np.linalg.norm(direction)


def grazing(rng, count):
    """Spheres beside the cones of tiles: of all the rays of its tile, that of a corner alone meets one, just so."""
    lines = []
    for _ in range(count):
        x0, y0 = SIDE * rng.integers(0, (WIDE // SIDE, HIGH // SIDE))
        corner = eye_ray(x0 + (SIDE - 1) * rng.integers(2), y0 + (SIDE - 1) * rng.integers(2))
        middle = eye_ray(x0 + SIDE // 2, y0 + SIDE // 2)
        outward = corner * (corner @ middle) - middle  # at right angles to the corner's ray, away from the axis
        distance = rng.uniform(2, 20)
        radius = distance * 10 ** rng.uniform(-3.5, -1.5)
        centre = np.array((0.4, 0.4, 6)) + distance * corner + 0.99 * radius * outward / np.linalg.norm(outward)
        lines.append(f"SPHERE {words(centre)} {radius} {words(rng.uniform(0.1, 0.9, 3))} 0.5 9 (0,0,0) 30 1\n")
    return "".join(lines)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [11, 12])
def test_no_tile_leaves_out_what_it_can_see(bench, tmp_path, seed):
    """VEC-2: the same bytes as without, of spheres around the eye and of small ones that graze the cones of tiles."""
    rng = np.random.default_rng(seed)
    source = STAGE + LIGHTS + around(rng, 20) + grazing(rng, 300)
    print(seed, source)
    copies = {}
    for name, margin in (("culled", "MARGIN = 64 * UNIT_ROUNDOFF"), ("all", "MARGIN = math.inf")):
        shutil.copytree(RENDERERS, tmp_path / name / "renderers", ignore=shutil.ignore_patterns("__pycache__"))
        module = tmp_path / name / "renderers" / "numba" / "lanes" / "eye.py"
        code = module.read_text()
        assert "MARGIN = 64 * UNIT_ROUNDOFF" in code
        module.write_text(code.replace("MARGIN = 64 * UNIT_ROUNDOFF", margin))
        copies[name] = tmp_path / name
    for precision in ("float32", "float64"):
        pictures = [alone(copy, tmp_path / f"{precision} {name}", source, precision) for name, copy in copies.items()]
        np.testing.assert_array_equal(*pictures)
        assert len(np.unique(pictures[0])) > 100


def alone(place, out, source, precision):
    """The picture that a copy of the renderers makes."""
    parameters = Parameters(width=WIDE, height=HIGH, depth=2, precision=precision, vector="on")
    scene = text.read(source)
    needed = needs(scene, parameters)
    job.write(out / "job", flatten(scene), parameters, needed)
    done = subprocess.run(
        [sys.executable, "-m", "renderers.numba.main", *job.flags(out / "job", out, "numba", None, parameters, needed)],
        cwd=out,
        env={**os.environ, "PYTHONPATH": str(place)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return np.load(out / "image.npy")


@pytest.mark.slow
@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_threads_and_regions_give_the_same_bytes(bench, precision):
    rng = np.random.default_rng(7)
    source = random_scene(rng, sphere=20, material=random_material, rest=random_stage(rng))
    jobs = {"width": 130, "height": 100, "depth": 3, "shadows": True, "exact": True, "vector": "on"}
    one = bench.result("numba", source, precision=precision, **jobs)
    part = bench.result("numba", source, precision=precision, region=(17, 5, 90, 71), **jobs)
    assert part.array.tobytes() == one.array[5:71, 17:90].tobytes()
    for threads in (1, 2, 3):
        many = bench.result("numba-parallel", source, precision=precision, threads=threads, **jobs)
        assert many.array.tobytes() == one.array.tobytes()
        assert many.said.rays == one.said.rays


def test_what_is_not_finite_is_counted(bench):
    """In float32. Colours are decoded as sRGB, 1e10 to 1e24, and multiplied (CNT-2)."""
    source = "CAMERA (0,0,0) (2,0,0) (0,2,0) (0,0,40)\nAMBIENT (1e10,1,1)\n"
    source += "SPHERE (0,0,0) 1 (1e10,0.5,0.5) 0 1 (0,0,0) 1 1\n"
    jobs = {"width": 50, "height": 40, "depth": 0, "exact": True, "precision": "float32", "vector": "on"}
    found = bench.result("numba", source, **jobs)
    infinite = ~np.isfinite(found.array).all(axis=2)
    assert 0 < infinite.sum() < infinite.size
    assert found.said.rays["non_finite"] == infinite.sum()


GLASS = "".join(f"SPHERE (0,0,0) {1 + k / 64} (0.1,0.1,0.1) 0.9 4 (0.9,0.9,0.9) 2 1\n" for k in range(32))  # nested


@pytest.mark.parametrize(
    ("reason", "more", "parameters"),
    [
        ("sets of up to 31 clear solids alone", GLASS, {}),
        ("does not support sphere textbook", "", {"sphere": "textbook"}),
        ("does not support offset fixed", "", {"offset": "fixed"}),
        ("does not support walk stack", "", {"walk": "stack"}),
        ("does not support floating_point fast", "", {"floating_point": "fast"}),
        ("pictures alone, no rays", "", {"kind": "rays"}),
    ],
)
def test_what_is_not_in_lanes_is_refused(bench, reason, more, parameters):
    scene = text.read(STAGE + LIGHTS + CROWD + more)
    wanted = Parameters(width=4, height=4, depth=2, vector="on", **parameters)
    arrays = {**flatten(scene), "rays": np.ones((1, 6))}
    result = repetition.run(bench.entry("numba"), arrays, wanted, needs(scene, wanted))
    assert (result.status, result.reason) == ("unsupported", f"vector on: {reason}")


POWERS = """
import sys
import numpy as np
from renderers.numba import needs
needs.take((), (), walk="chain", single=sys.argv[1] == "float32", jittered=False, floating_point="strict")
from numba import njit
from renderers.numba.lanes.lanes import COUNT
from renderers.numba.lanes.memory import load, store
from renderers.numba.lanes.functions import power

@njit
def powers(x, m, out):
    for k in range(0, x.shape[1], COUNT):
        store(out, 0, k, power(load(x, 0, k), load(m, 0, k)))

x, m = np.load(sys.argv[2])
out = np.empty_like(x)
powers(x[None], m[None], out[None])
np.save(sys.argv[3], out)
"""


OTHERS = (
    POWERS[: POWERS.index("from renderers.numba.lanes.functions")]
    + """
from renderers.numba.lanes.functions import expm1, logarithm, turn

@njit
def evaluate(x, y, u, out):
    for k in range(0, x.shape[1], COUNT):
        store(out, 0, k, logarithm(load(x, 0, k)))
        store(out, 1, k, expm1(load(y, 0, k)))
        cosine, sine = turn(load(u, 0, k))
        store(out, 2, k, cosine)
        store(out, 3, k, sine)

arguments = np.load(sys.argv[2])
out = np.empty((4, arguments.shape[1]), arguments.dtype)
evaluate(*(arguments[k : k + 1] for k in range(3)), out)
np.save(sys.argv[3], out)
"""
)


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_logarithms_and_angles_are_off_by_a_few_u(tmp_path, precision):
    """Of 1 - u₀ as GLO-2 and SOF-2 draw it, in steps of 2⁻²⁴, and of exponents to -1e3; of angles the error is of 1."""
    rng, unit = np.random.default_rng(9), np.finfo(precision).eps / 2
    x = 1 - rng.integers(0, 2**24, 8192) * 2.0**-24
    y = -(10 ** rng.uniform(-9, 3, 8192))
    u = np.append(rng.integers(0, 2**24, 8184) * 2.0**-24, np.arange(8) / 8)
    arguments = np.stack([x, y, u]).astype(precision)
    np.save(tmp_path / "in.npy", arguments)
    command = [sys.executable, "-c", OTHERS, precision, tmp_path / "in.npy", tmp_path / "out.npy"]
    subprocess.run(command, check=True, env={**os.environ, "PYTHONPATH": str(RENDERERS.parent)})
    mp.mp.dps = 40
    x, y, u = (list(map(mp.mpf, row.tolist())) for row in arguments)
    angles = [2 * mp.pi * value for value in u]
    truths = [map(mp.log, x), map(mp.expm1, y), map(mp.cos, angles), map(mp.sin, angles)]
    for name, row, truth in zip(("log", "expm1", "cos", "sin"), np.load(tmp_path / "out.npy"), truths, strict=True):
        off = [
            abs(found - true) / (abs(true) if name in ("log", "expm1") and true else 1)
            for found, true in zip(row.tolist(), truth, strict=True)
        ]
        print(precision, name, float(max(off) / unit), "u")
        assert max(off) < 6 * unit


@pytest.mark.parametrize(("precision", "least"), [("float32", -100), ("float64", -1000)])
def test_a_power_is_as_good_as_its_bound(tmp_path, precision, least):
    """Bases from the smallest normal number to 1, most of them near 1, and exponents to 1e6, whole and not."""
    rng, unit = np.random.default_rng(8), np.finfo(precision).eps / 2
    near = 1 - rng.integers(1, 2000, 4096) * unit
    bases = [10 ** rng.uniform(np.log10(np.finfo(precision).tiny), 0, 4096), rng.uniform(0, 1, 4096)]
    bases += [1 - 10 ** rng.uniform(np.log10(unit), 0, 8192), near, np.sqrt(0.5) + rng.uniform(-1, 1, 4080) * 64 * unit]
    bases += [np.repeat([1.0, 1 - unit], 8)]
    x = np.concatenate(bases).astype(precision)
    m = np.where(rng.random(len(x)) < 0.5, 10 ** rng.uniform(-3, 6, len(x)), rng.integers(0, 60, len(x)))
    m[-16:] = [0, 1, 2, 30, 1e3, 1e4, 1e5, 1e6] * 2
    m = m.astype(precision)
    np.save(tmp_path / "in.npy", np.stack([x, m]))
    command = [sys.executable, "-c", POWERS, precision, tmp_path / "in.npy", tmp_path / "out.npy"]
    subprocess.run(command, check=True, env={**os.environ, "PYTHONPATH": str(RENDERERS.parent)})
    found = np.load(tmp_path / "out.npy")
    mp.mp.dps = 40
    worst = worst_relative = 0
    for base, exponent, power in zip(x.tolist(), m.tolist(), found.tolist(), strict=True):
        truth = mp.mpf(base) ** mp.mpf(exponent)
        logarithm = mp.log(truth, 2)
        worst = max(worst, abs(power - truth))
        if logarithm > least + 1:
            worst_relative = max(worst_relative, abs(power / truth - 1) / (5 * -logarithm + 3))
        elif logarithm < least - 1:
            assert power == 0
    print(precision, "of 1:", float(worst / unit), "u, of the bound:", float(worst_relative / unit))
    assert worst < 4 * unit and worst_relative < unit
