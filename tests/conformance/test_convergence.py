"""Sampling errors fall as theory has it, in every renderer: the scenes of experiments/sampling.toml, made smaller."""

import math
from pathlib import Path

import numpy as np
import pytest

SCENES = Path(__file__).parents[2] / "experiments" / "scenes" / "sampling"
LENS = {"lens_radius": 0.5, "focal_distance": 2.5}
GRID, DRAWS = (2, 3, 4, 6, 8), (1, 2, 4, 8, 16)  # four octaves of samples

# Scene, what is swept, what else the job has, and the slope of log error against log samples.
CASES = {
    "edge, jittered": ("edge", "samples", {"sampler": "jittered"}, -0.75),
    "edge, uniform": ("edge", "samples", {"sampler": "uniform"}, -0.75),
    "aligned, jittered": ("aligned", "samples", {"sampler": "jittered"}, -0.75),
    "aligned, uniform": ("aligned", "samples", {"sampler": "uniform"}, -0.5),
    "smooth, jittered": ("smooth", "samples", {"sampler": "jittered"}, -1.0),
    "lens, jittered": ("lens", "samples", {"sampler": "jittered", **LENS}, -0.5),
    "feelers": ("soft", "feelers", {"shadows": True}, -0.5),
    "glossy rays": ("glossy", "glossy_rays", {"depth": 1}, -0.5),
}


@pytest.fixture(scope="module")
def truth(bench, known):
    """A function that gives the picture of a case from 4096 samples a pixel, with another seed."""
    made = {}

    def find(case):
        scene, swept, more, _ = CASES[case]
        if case not in made:
            name = next(name for name in ("cpp", "numpy") if known[name].unavailable is None)
            many = {"samples": 64, "sampler": "jittered"} if swept == "samples" else {swept: 4096}
            made[case] = bench.picture(name, (SCENES / f"{scene}.txt").read_text(), **job(more), **many, seed=77)
        return made[case]

    return find


def job(more):
    return {"width": 32, "height": 32, "depth": 0, **{key: more[key] for key in more if key != "sampler"}}


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_the_slope_is_that_of_theory(bench, serial, truth, case):
    if bench.known[serial].simulated:
        pytest.skip("a simulator takes too long")
    scene, swept, more, theory = CASES[case]
    source, values = (SCENES / f"{scene}.txt").read_text(), GRID if swept == "samples" else DRAWS
    errors = []
    for value in values:
        sampler = {"sampler": more["sampler"]} if "sampler" in more else {}
        picture = bench.picture(serial, source, **job(more), **sampler, **{swept: value}, seed=5)
        errors.append(math.sqrt(np.mean((picture - truth(case)) ** 2)))
    counts = [value**2 if swept == "samples" else value for value in values]
    slope = np.polyfit(np.log2(counts), np.log2(errors), 1)[0]
    print("seed 5, slope", slope, errors)
    assert abs(slope - theory) < 0.1
