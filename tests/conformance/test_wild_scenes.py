"""All renderers agree on random scenes of any size, place and content.

The scenes differ from commit to commit (seeds.py). A scene with a disagreement is reduced and kept as a file.
"""

import itertools
import math
import os
import shlex
import time
from dataclasses import replace
from pathlib import Path

import conformance_spaces as spaces
import numpy as np
import pytest
import seeds
import wild_scenes
from judged import Court

from harness.judge.judge import STEP
from harness.process import repetition
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.needs import needs

COUNT, BY_NIGHT = 60, 2000
BUDGET, LEAST = 150.0, 10  # s by day for the scenes of an accel, of which so many are tried in any case
BATCH = 10  # scenes of a test of devices
PARTS = {"none": 0, "bvh": 1}  # accel (each is a kernel of Numba), and the number of its scenes modulo 2
MAKER = "cpp"
LANES = {"vector": "on"}  # of C++, which has them for everything (VEC-1)
JUDGED = (("numba", {}), ("numpy", {}), ("python", {}), ("opencl", {}), ("cpp", LANES))
THREADED = (("cpp-threads", {}, "cpp"), ("numba-parallel", {}, "numba"), ("cpp-threads", LANES, "cpp"))
SHARE = 5  # every fifth scene is rendered by several threads too
THREADS = 3
MOVES, WIDER = 8, 2  # of the places of a scene far away; a pixel may be off by so many times what they change it
SHAPES = ("spheres", "boxes", "ellipsoids")
PLACED = ("lights", *SHAPES, *(f"csg_{shape}" for shape in SHAPES), "polygon_vertices", "mesh_vertices")
SCENE = "RAYRACE_SCENE"  # environment variable: the number of a scene, which then is the only one
KEPT = Path(__file__).parents[2] / "build" / "disagreements"


@pytest.fixture(scope="module")
def court(bench):
    return Court(bench)


def drawn(number):
    return wild_scenes.draw(seeds.numbers("wild", number))


def result_of(bench, variant, wild, accel, moved=None, **more):
    """The Result of a variant with its general kernel; or text, why it failed. moved: the generator for displaced()."""
    entry = bench.known[variant]
    chosen = {"kernel": "general"} if "general" in entry.methods.get("kernel", ()) else {}
    if accel in entry.methods.get("accel", ()):
        chosen["accel"] = accel
    wanted = replace(wild.parameters, **chosen, **more)
    needed = needs(wild.scene, wanted)
    if "contact" in needed and wanted.vector == "on":  # cpp gathers what is in one place through the hierarchy alone
        wanted = replace(wanted, accel="bvh")
    reason = repetition.unsupported(entry, wanted, needed)
    assert reason is None, reason
    arrays = flatten(wild.scene)
    result = bench.run(entry, arrays if moved is None else displaced(arrays, moved), wanted, needed)
    return result if result.status == "ok" else f"{result.status}: {result.reason}\n{result.stderr[-500:]}"


def disagreement(bench, court, variant, methods, wild, accel):
    """None, or how the picture of `variant` by `methods` differs from the reference."""
    result = result_of(bench, variant, wild, accel, **methods)
    if isinstance(result, str):
        return result
    beside = (lambda: rounding(bench, wild, accel)) if wild.away else (lambda: 0.0)
    return court.wrong((MAKER,), wild.scene, wild.parameters, result, beside)


def rounding(bench, wild, accel):
    """What the rounding of coordinates can do to each pixel of a scene far from the origin, (height, width).

    A million sizes away they are rounded to 1e-10 of the size, and each curved face on a ray's way makes more of that.
    """
    plain, rng = result_of(bench, MAKER, wild, accel), np.random.default_rng(seeds.numbers("moves"))
    moved = [result_of(bench, MAKER, wild, accel, moved=rng) for _ in range(MOVES)]
    return WIDER * np.max([np.abs(result.array - plain.array).max(axis=2) for result in moved], axis=0)


def displaced(arrays, rng):
    """The arrays of a scene, each coordinate of a place moved by 0 or a unit in the last place of the largest."""
    found = {name: array.copy() for name, array in arrays.items()}
    places = [found["camera"][:1], *(found[name][:, :3] for name in PLACED)]
    unit = np.spacing(max(np.abs(place).max(initial=0) for place in places))
    for place in places:
        place += unit * rng.integers(-1, 1, place.shape, endpoint=True)
    return found


def differs_by_threads(bench, variant, methods, twin, wild, accel):
    """None, or that the picture of several threads is not that of `twin`, byte for byte."""
    several = result_of(bench, variant, wild, accel, threads=THREADS, **methods)
    found = [several, result_of(bench, twin, wild, accel, **methods)]
    if not all(hasattr(result, "array") for result in found):
        return str(found)
    if found[0].array.tobytes() != found[1].array.tobytes() or found[0].said.rays != found[1].said.rays:
        return f"not the bytes of {twin}"
    return None


def command(wild, file, variant, methods):
    """The command that renders a kept scene."""
    usual = Parameters()
    options = {name: value for name, value in wild.job.items() if value != getattr(usual, name)}
    options.setdefault("depth", 10)
    told = [f"--{name.replace('_', '-')} {value}" for name, value in options.items() if name != "shadows"]
    told += [f"--{name} {value}" for name, value in methods.items()]
    told.append("--shadows" if wild.job["shadows"] else "--no-shadows")
    return (
        f"rayrace render {shlex.quote(str(file))} -r {variant} {' '.join(told)} -o {'-'.join([variant, *methods])}.npy"
    )


def report(wild, number, variant, methods, wrong, shows, folder):
    """Reduces and keeps a scene with a disagreement; returns the text about it."""
    small = wild_scenes.shrink(wild, shows)
    file = small.keep(folder / f"{seeds.seed()}-{number}-{variant}.txt".replace("/", "-"))
    twin = next((twin for *one, twin in THREADED if one == [variant, methods]), None)
    other = (twin, methods) if twin else (MAKER, {})
    return (
        f"scene {number}: {variant} {methods}: {wrong}\n{small.source}{small.job}\nkept as {file}; see it by\n"
        f"  {command(small, file, variant, methods)}\n  {command(small, file, *other)}"
    )


def has_threads(number, accel):
    """Whether several threads render a scene too; by day all of these through a tree: Numba compiles once for them."""
    return number % SHARE == 0 if number >= COUNT else accel == "bvh" and number % SHARE < 2


def try_scenes(bench, court, numbers, accel, test, folder=KEPT, budget=math.inf):
    """Returns how many of the scenes were rendered by all and judged: those for which the budget (s) has time."""
    for variant in dict.fromkeys((MAKER, *(name for name, _ in JUDGED))):
        bench.entry(variant)  # the test is skipped where one is not here, before anything is compiled
    faults, judged, scenes, end = [], 0, 0, time.monotonic() + budget
    only = os.environ.get(SCENE)
    print(f"seed {seeds.seed()}: scenes {numbers[0]} to {numbers[-1]}, accel {accel}")
    for number in numbers if only is None else {int(only)} & set(numbers):
        if scenes >= LEAST and time.monotonic() > end:
            break
        wild, scenes = drawn(number), scenes + 1
        checks = [(name, methods, disagreement, (court, name, methods)) for name, methods in JUDGED]
        if has_threads(number, accel):
            checks += [(name, methods, differs_by_threads, (name, methods, twin)) for name, methods, twin in THREADED]
        for variant, methods, check, given in checks:
            wrong = check(bench, *given, wild, accel)
            judged += 1
            if wrong and not faults:  # only the first is reduced

                def shows(less, check=check, given=given):
                    return bool(check(bench, *given, less, accel))

                again = seeds.again(test, **{SCENE: number})
                faults.append(f"{report(wild, number, variant, methods, wrong, shows, folder)}\n  again: {again}")
            elif wrong:
                faults.append(f"scene {number}: {variant} {methods}: {wrong}")
    assert not faults, f"{len(faults)} of {judged}\n" + "\n".join(faults)
    assert judged
    return scenes


@pytest.mark.whole
@pytest.mark.slow
@pytest.mark.parametrize("accel", PARTS)
def test_all_renderers_agree(bench, court, request, accel, record_property):
    numbers = range(PARTS[accel], COUNT, 2)
    scenes = try_scenes(bench, court, numbers, accel, request.node.nodeid, budget=BUDGET)
    record_property("scene", (f"accel {accel}", scenes, seeds.seed()))


@pytest.mark.nightly("2,000 scenes: CI has 60")
@pytest.mark.slow
@pytest.mark.parametrize("part", range(COUNT, BY_NIGHT, 97))
def test_many_scenes(bench, court, request, part):
    accel = list(PARTS)[part % 2]
    try_scenes(bench, court, range(part, min(part + 97, BY_NIGHT)), accel, request.node.nodeid)


def differs_from_cpp(bench, court, device, wild, accel):
    """None, or how the picture of a device in float32 differs from that of C++ in float32, by more than a step.

    Both are held to each other, as many of these scenes are too far from the origin, or too small, for float32.
    """
    found = [result_of(bench, name, wild, accel) for name in (device, MAKER)]
    if not all(hasattr(result, "array") for result in found):
        return str(found)
    off = ~(np.abs(found[0].array - found[1].array).max(axis=2) <= STEP)
    if off.any():
        off &= ~court.reference((MAKER,), wild.scene, wild.parameters).mask
    return f"{off.sum()} pixels outside the mask differ from those of {MAKER}" if off.any() else None


@pytest.mark.nightly("by day test_features.py has devices at real sizes, and test_all_renderers_agree these scenes")
@pytest.mark.slow
@pytest.mark.parametrize("precision", ["float64", "float32"])
@pytest.mark.parametrize("part", range(0, COUNT, BATCH))
@pytest.mark.parametrize("device", spaces.ON_DEVICES)
def test_devices_at_real_sizes(bench, court, request, device, part, precision):
    """Where their groups are many, and run at the same time."""
    only, faults = os.environ.get(SCENE), []
    print(f"seed {seeds.seed()}: scenes {part} to {part + BATCH - 1}")
    for number in range(part, part + BATCH) if only is None else [int(only)]:
        wild, accel = drawn(number), list(PARTS)[number % 2]
        wild = replace(wild, job={**wild.job, "width": 128, "height": 128, "precision": precision})
        if precision == "float64":
            wrong = disagreement(bench, court, device, {}, wild, accel)
        else:
            wrong = differs_from_cpp(bench, court, device, wild, accel)
        if wrong:
            again = seeds.again(request.node.nodeid, **{SCENE: number})
            faults.append(f"scene {number}: {wrong}\n{wild.source}{wild.job}\n  again: {again}")
    assert not faults, f"{len(faults)} scenes\n" + "\n".join(faults)


def test_scenes_have_everything():
    """Each feature occurs in several of 60 scenes."""
    scenes = [drawn(number) for number in range(COUNT)]
    used = [needs(wild.scene, wild.parameters) for wild in scenes]
    for feature in ("sphere", "box", "polygon", "ellipsoid", "mesh", "csg", "shadows", "soft", "reflection", "glossy",
                    "transmission", "attenuation", "media", "supersampling", "adaptive", "lens"):  # fmt: skip
        assert sum(feature in needed for needed in used) >= 4, feature
    assert sum(wild.away > 0 for wild in scenes) > 10 and sum("NOT" in wild.source for wild in scenes) > 10


class Broken:
    """A bench whose NumPy is off by a millionth if a solid has the complement of an ellipsoid."""

    def __init__(self, bench):
        self.bench = bench

    def __getattr__(self, name):
        return getattr(self.bench, name)

    def run(self, entry, arrays, parameters, needs):
        result = self.bench.run(entry, arrays, parameters, needs)
        code = arrays["csg_code"][:, 0].tolist()
        if entry.name == "numpy" and (2, 6) in itertools.pairwise(code):
            result.array = result.array * (1 + 1e-6)
        return result


@pytest.mark.whole
@pytest.mark.slow
def test_a_disagreement_is_made_small_and_kept(bench, tmp_path):
    """An artificial error: only the solid that shows it and some light remain of the scene."""
    broken = Broken(bench)
    numbers = [n for n in range(200) if "NOT ELLIPSOID" in drawn(n).source and len(drawn(n).parts) > 8][:1]
    with pytest.raises(AssertionError) as told:
        try_scenes(broken, Court(broken), numbers, "none", "this test", tmp_path)
    print(told.value)
    files = list(tmp_path.glob("*-numpy.txt"))
    assert len(files) == 1 and str(files[0]) in str(told.value) and "rayrace render" in str(told.value)
    words = [line.split()[0] for line in files[0].read_text().splitlines()]
    assert "NOT ELLIPSOID" in files[0].read_text() and len(words) <= 4, words
    small = text.read(files[0].read_text(), files[0])
    assert len(small.objects) == 1
