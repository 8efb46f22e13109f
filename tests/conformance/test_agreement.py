"""Every renderer makes the same picture and traces the same rays, whatever its threads or region."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from nightly import by_night
from random_scenes import random_material, random_scene, random_stage

from harness.judge import judge, reference
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.needs import needs

SCENES = Path(__file__).parents[2] / "experiments" / "scenes"
SEEDS = (101, 102)
JOBS = {"local light": (0, False), "shadows": (0, True), "mirrors": (4, False), "mirrors and shadows": (10, True)}


@cache
def source(name):
    """Text of a scene: a file of experiments/scenes, or one in general position made from a seed."""
    if isinstance(name, str):
        return (SCENES / name).read_text(encoding="utf-8")
    rng = np.random.default_rng(name)
    return random_scene(rng, 5, 5, 5, 5, material=random_material, rest=random_stage(rng))


@pytest.fixture(scope="module")
def reference_of(known, bench):
    """The reference that a variant is judged by, made once per scene and job."""
    made = {}

    def find(variant, name, parameters):
        scene = text.read(source(name), str(name))
        needed = needs(scene, parameters)
        maker = reference.choose(known[variant], known, parameters, needed)
        assert maker is not None
        key = name, parameters.picture(), maker.name
        if key not in made:
            made[key] = bench.reference(maker, flatten(scene), parameters, needed)
            assert isinstance(made[key], reference.Reference), made[key]
        return made[key]

    return find


def compare(bench, reference_of, variant, name, **parameters):
    """Render with `variant` and judge; the Verdict, after the gates of its precision have passed.

    C++ has a kernel that tests share: its own of each scene are in test_covering.py.
    """
    wanted = Parameters(**parameters)
    exact = not bench.known[variant].renderer.manifest.build
    result = bench.result(variant, source(name), exact=exact, **parameters)
    found = reference_of(variant, name, wanted)
    verdict = judge.judge(result.array, found, wanted.precision)
    print(f"{variant} against {found.maker}: {verdict}")
    assert verdict.wrong is None, verdict.wrong
    assert judge.compare_rays(result.said.rays, found.rays, wanted.precision) is None
    assert result.said.rays["non_finite"] == 0
    return verdict


@pytest.mark.parametrize("job", JOBS)
@pytest.mark.parametrize("name", by_night(["comparison.txt", "local.txt", *SEEDS], *map(str, SEEDS)))
def test_float64_pictures_agree(bench, reference_of, serial, name, job):
    print("seed", name)
    depth, shadows = JOBS[job]
    width, height = (16, 16) if bench.known[serial].simulated else (48, 40)
    compare(bench, reference_of, serial, name, width=width, height=height, depth=depth, shadows=shadows)


@pytest.mark.parametrize("name", ["comparison.txt", "local.txt", *SEEDS])
def test_float32_pictures_are_within_a_step(bench, reference_of, serial, name):
    print("seed", name)
    side = 32 if bench.known[serial].simulated else 96
    verdict = compare(
        bench, reference_of, serial, name, width=side, height=side, depth=5, shadows=True, precision="float32"
    )
    assert verdict.max_outside > 1e-9, "float32 that agrees to 1e-9 was computed in float64"


@pytest.mark.nightly("test_float32_pictures_are_within_a_step has smaller pictures by day; a case takes 15 s or more")
@pytest.mark.slow
@pytest.mark.parametrize("name", ["comparison.txt", "local.txt"])
def test_large_float32_pictures_with_shadows(bench, reference_of, serial, name):
    """Where a mask of too few perturbations, or a reference with another epsilon, leaves single pixels outside."""
    if bench.known[serial].simulated:
        pytest.skip("a simulator takes too long")
    compare(bench, reference_of, serial, name, width=512, height=512, depth=10, shadows=True, precision="float32")


@pytest.mark.slow
def test_the_study_s_picture(bench, reference_of, variant):
    """comparison.txt at 512 x 512, d = 10: 1e-9 outside the mask, and a mask that is small."""
    if bench.known[variant].simulated:
        pytest.skip("a simulator takes too long")
    verdict = compare(bench, reference_of, variant, "comparison.txt", width=512, height=512, depth=10)
    assert verdict.mask_fraction < 0.15


@pytest.mark.parametrize("name", ["comparison.txt", SEEDS[0]])
def test_threads_do_not_change_a_byte(bench, known, variant, name):
    if known[variant].variant.threads == 1:
        pytest.skip("runs one thread")
    jobs = {"width": 61, "height": 47, "depth": 6, "shadows": True}
    pictures = [bench.result(variant, source(name), threads=threads, **jobs) for threads in (1, 2, 3, 7)]
    for other in pictures[1:]:
        assert other.array.tobytes() == pictures[0].array.tobytes()
        assert other.said.rays == pictures[0].said.rays


def test_a_threaded_variant_is_its_serial_twin(bench, known):
    for name, entry in known.items():
        manifest = entry.renderer.manifest
        if entry.variant.threads == 1 or manifest.external or "box" not in manifest.features or entry.variant.exhibit:
            continue  # peers that know fewer shapes have tests of their own, and exhibits of faults are wrong
        twin = entry.renderer.manifest.variant[0].name
        pair = [
            bench.picture(each, source(SEEDS[1]), width=40, height=30, depth=6, shadows=True) for each in (name, twin)
        ]
        assert pair[0].tobytes() == pair[1].tobytes(), f"{name} and {twin}"


def test_a_region_is_a_part_of_the_picture(bench, variant):
    jobs = {"width": 37, "height": 29, "depth": 5, "shadows": True}
    whole = bench.picture(variant, source(SEEDS[0]), **jobs)
    for x0, y0, x1, y1 in ((0, 0, 37, 1), (18, 14, 19, 15), (5, 3, 30, 28), (36, 28, 37, 29)):
        part = bench.picture(variant, source(SEEDS[0]), region=(x0, y0, x1, y1), **jobs)
        assert part.tobytes() == whole[y0:y1, x0:x1].tobytes()


def test_every_frame_is_the_same(bench, variant):
    first = bench.picture(variant, source(SEEDS[0]), width=20, height=20, depth=3, frames=0)
    later = bench.result(variant, source(SEEDS[0]), width=20, height=20, depth=3, frames=3)
    assert first.tobytes() == later.array.tobytes()
    assert len(later.said.frames) == 4


def test_a_batch_is_so_many_renders(bench, variant):
    """Picture and counts are those of one render, and each render is done: no ray takes less than 3 ns."""
    jobs = {"width": 20, "height": 20, "depth": 3, "frames": 2}
    once = bench.result(variant, source(SEEDS[0]), **jobs)
    often = bench.result(variant, source(SEEDS[0]), **jobs, least_frame=5e-3)
    assert once.array.tobytes() == often.array.tobytes() and once.said.rays == often.said.rays
    assert [frame["renders"] for frame in once.said.frames] == [1, 1, 1]
    first, *later = often.said.frames
    assert first["renders"] == 1 and later[0]["renders"] == later[1]["renders"]
    print(later[0]["renders"], "renders")
    rays = later[0]["renders"] * once.said.rays["primary"]
    assert all(frame["end"] - frame["start"] > 3e-9 * rays for frame in later)


def test_the_oracle_certifies_the_reference(bench, known):
    """The same pixels with 60 digits: the float64 picture is right to 1e-10 where the scene allows it."""
    rng = np.random.default_rng(7)
    print("seed 7")
    jobs = {"width": 64, "height": 64, "depth": 10, "shadows": True}
    picture = bench.picture("numba", source("comparison.txt"), **jobs)
    parameters = Parameters(**jobs)
    scene = text.read(source("comparison.txt"), "comparison.txt")
    made = bench.reference(known["numba"], flatten(scene), parameters, needs(scene, parameters))
    certain = np.argwhere(~made.mask)
    for j, i in rng.choice(certain, 12, replace=False):
        pixel = bench.picture(
            "python",
            source("comparison.txt"),
            region=(int(i), int(j), int(i) + 1, int(j) + 1),
            precision="mp60",
            **jobs,
        )
        np.testing.assert_allclose(pixel[0, 0], picture[j, i], rtol=0, atol=1e-10)
