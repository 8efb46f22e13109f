"""Ill-conditioned pixels are judged too: a right renderer passes, and one that is wrong in them alone does not."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from nightly import by_night
from random_scenes import random_material, random_scene, random_stage

from harness.judge import judge, reference, span
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.needs import needs

SEED = 29
OFF = 0.3
MIRRORS = Path(__file__).parents[2] / "experiments" / "scenes" / "comparison.txt"
# Scene, job, and whether the mask has so many pixels that what is off in all of them is found; None: either.
CASES = {
    "mirrors": ("mirrors", {"width": 33, "height": 25, "depth": 10}, True),
    "mirrors and shadows": ("mirrors", {"width": 97, "height": 73, "depth": 6, "shadows": True}, True),
    "chaos": ("mirrors", {"width": 201, "height": 151, "depth": 14}, True),
    "a few pixels": ("mirrors", {"width": 9, "height": 7, "depth": 10, "sampler": "uniform", "samples": 2}, False),
    "supersampled": ("mirrors", {"width": 61, "height": 47, "depth": 10, "sampler": "uniform", "samples": 3}, True),
    "jittered": ("mirrors", {"width": 31, "height": 27, "depth": 8, "sampler": "jittered", "samples": 3}, True),
    "adaptive": ("mirrors", {"width": 41, "height": 37, "depth": 6, "sampler": "adaptive", "adaptive_depth": 2}, True),
    "glass": ("glass", {"width": 97, "height": 73, "depth": 8, "shadows": True}, True),
    "sampled glass": ("glass", {"width": 31, "height": 27, "depth": 6, "sampler": "jittered", "samples": 4}, False),
    "all sorts": ("all sorts", {"width": 131, "height": 97, "depth": 8, "shadows": True}, None),
    "all sorts, lens": ("all sorts", {"width": 51, "height": 43, "depth": 8, "sampler": "jittered", "samples": 3,
                                      "lens_radius": 0.05, "focal_distance": 4.0}, None),
}  # fmt: skip


@cache
def source(name):
    mirrors = MIRRORS.read_text(encoding="utf-8")
    if name == "glass":
        return mirrors.replace("(0,0,0) 1e6 1", "(0.95,0.9,0.97) 2.25 1")
    if name == "mirrors":
        return mirrors
    rng = np.random.default_rng(SEED)
    return random_scene(rng, 9, 9, 9, 9, material=random_material, rest=random_stage(rng))


@pytest.fixture(scope="module")
def reference_of(known, bench):
    made = {}

    def find(variant, case, wanted):
        scene = text.read(source(CASES[case][0]), case)
        needed = needs(scene, wanted)
        maker = reference.choose(known[variant], known, wanted, needed, ("cpp", "numpy"))
        key = case, maker.name, wanted.precision
        if key not in made:
            made[key] = bench.reference(maker, flatten(scene), wanted, needed)
            assert isinstance(made[key], reference.Reference), made[key]
        return made[key]

    return find


@pytest.mark.parametrize("precision", ["float64", "float32"])
@pytest.mark.parametrize("case", by_night(CASES, *(name for name in CASES if name not in ("mirrors", "a few pixels"))))
def test_what_is_off_in_all_ill_conditioned_pixels_is_rejected(bench, reference_of, serial, case, precision):
    print("seed", SEED)
    scene, job, enough = CASES[case]
    result = bench.result(serial, source(scene), **job, precision=precision)
    found = reference_of(serial, case, Parameters(**job, precision=precision))
    count = int(found.mask.sum())
    limit = span.most(count, found.left) if count else 0
    beyond = int(span.leaves(result.array[found.mask], found.span, judge.TOLERANCE[precision]).sum())
    print(f"{serial}, {case}: {count} pixels in the mask, {found.left} leave, {beyond} of the picture, {limit} may")
    assert judge.judge(result.array, found, precision).wrong is None
    if enough is None:
        return
    for off in (OFF, -OFF):
        picture = np.where(found.mask[:, :, np.newaxis], result.array + off, result.array)
        wrong = judge.judge(picture, found, precision).wrong
        assert (wrong is not None) == enough, (wrong, count, limit)
        assert not enough or "inside the mask" in wrong
