"""The rule of errors (ERR-1): what each scene of the gallery is rendered to, with its own job, has an error of 0 in the
deep limit. A truth with something in it that no picture of the job has, such as lobes of perfect mirrors, fails.
"""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.experiment.experiment import Reference as Wanted
from harness.judge import judge, truth
from harness.renderer.parameters import Parameters
from harness.scene import load
from harness.scene.flatten import flatten
from harness.scene.needs import needs

FOLDER = Path(__file__).parents[2] / "experiments"
ACCURACY = tomllib.loads((FOLDER / "accuracy.toml").read_text())
CASES = {case["name"]: case for case in ACCURACY["case"]}
# What the experiment gives these two scenes beside their samples, and no other.
METHODS = {"soft shadows": {"feelers": 1}, "glossy mirrors": {"glossy_rays": 1}}
FEW, MANY = 2, 20  # samples of a side of a pixel
TIMES = 256  # as many samples as the picture with few has the truth
SEEDS = range(1, 1 + truth.PICTURES)
SMALLEST = 1e-3  # of an RMSE that the truth must tell from 0
# Standard errors of an RMSE that is 0 but for noise, at most: of its square, four (judge.errors).
SURE = 8


def scene_and_job(case):
    """The scene of a case of accuracy.toml, and its job for a small picture."""
    given = {name: value for name, value in CASES[case].items() if name not in ("name", "scene")}
    job = {**ACCURACY["image"], **given, **METHODS.get(case, {}), "width": 32, "height": 24, "sampler": "jittered"}
    return load(FOLDER / CASES[case]["scene"]), Parameters(**job)


@pytest.fixture
def shoot(bench):
    """A function that renders a scene by C++."""

    def shoot(scene, job):
        def run(entry, arrays, wanted, needed, cache=None):
            return bench.run(entry, arrays, bench.sharing(entry, wanted, needed), needed)

        return run(bench.entry("cpp"), flatten(scene), job, needs(scene, job)).array

    return shoot


def truth_of(bench, scene, job):
    """The truth of a scene for a job, as a run makes it."""

    def run(entry, arrays, wanted, needed, cache=None):
        return bench.run(entry, arrays, bench.sharing(entry, wanted, needed), needed)

    (told,) = truth.jobs([job], Wanted(times=TIMES), lambda parameters: needs(scene, parameters)).values()
    return truth.make(told, bench.entry("cpp"), flatten(scene), None, run)


def limit_of(shoot, scene, job, right):
    """`judge.errors` of the mean of pictures of a job with many samples, as deep as the truth, with its noise too."""
    deep = replace(job, samples=MANY, depth=right.depth, cutoff=right.cutoff)
    picture, noise = truth.mean(shoot(scene, replace(deep, seed=seed)) for seed in SEEDS)
    return judge.errors(picture, right.picture, np.hypot(noise, right.standard_error), None, right.change)


@pytest.mark.parametrize("case", CASES)
def test_the_deep_limit_of_its_own_job_has_no_error(bench, shoot, case):
    scene, job = scene_and_job(case)
    right = truth_of(bench, scene, replace(job, samples=FEW))
    few = judge.errors(shoot(scene, replace(job, samples=FEW, seed=9)), right.picture, right.standard_error, None)
    told = limit_of(shoot, scene, job, right)
    print(case, "few samples:", few["rmse"], "limit:", told, "depth", right.depth)
    assert few["below"] is None and few["rmse"] > 4 * told["rmse"]
    assert told["rmse"] <= SURE * told["rmse_standard_error"] < SURE * SMALLEST


@pytest.mark.parametrize("case", ["mirrors", "mirrors and glass", "Boolean operations"])
def test_lobes_of_perfect_mirrors_would_be_seen(bench, shoot, case):
    """Of a truth of which every mirror is glossy with the exponent of its highlight, as truths once were."""
    scene, job = scene_and_job(case)
    rough = [replace(thing.material, roughness=(2 / (thing.material.exponent + 2)) ** 0.5) for thing in scene.objects]
    lobes = replace(scene, objects=tuple(map(lambda thing, m: replace(thing, material=m), scene.objects, rough)))
    told = limit_of(shoot, scene, job, truth_of(bench, lobes, replace(job, samples=FEW)))
    print(case, told)
    assert told["rmse"] > max(SURE * told["rmse_standard_error"], SMALLEST)
