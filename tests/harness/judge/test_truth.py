"""The truth: which pictures share one, what makes it, and how well it is known."""

from dataclasses import replace

import numpy as np
import pytest

from harness.judge import truth
from harness.renderer.parameters import Parameters

SCENE_NEEDS = {"sphere", "diffuse"}
RANDOM = {"jittered": "supersampling", "uniform": "supersampling", "adaptive": "adaptive"}


def needs_of(parameters):
    more = {RANDOM[parameters.sampler]} if parameters.sampler in RANDOM else set()
    more |= {"soft"} if parameters.feelers else set()
    return tuple(sorted(SCENE_NEEDS | more))


def job(*under_test, depth=None, times=64):
    """The job of the first of the pictures under test."""
    return truth.jobs(under_test, depth, times, needs_of)[truth.view(under_test[0], depth)]


PLAIN = Parameters(width=8, height=8, depth=3)
METHODS = (
    {"walk": "stack"}, {"accel": "none"}, {"sphere": "textbook"}, {"floating_point": "fast"}, {"cutoff": 0.1},
    {"threads": 7}, {"frames": 9}, {"seed": 5}, {"glossy_weight": "study"},
)  # fmt: skip


@pytest.mark.parametrize("method", METHODS)
def test_methods_share_a_truth(method):
    assert truth.view(replace(PLAIN, **method)) == truth.view(PLAIN)


@pytest.mark.parametrize("other", [{"width": 9}, {"shadows": True}, {"depth": 4}, {"sample_x": 0.25}, {"feelers": 2}])
def test_what_is_shown_is_no_method(other):
    assert truth.view(replace(PLAIN, **other)) != truth.view(PLAIN)


def test_without_samples_it_is_one_strict_picture():
    fast = replace(PLAIN, floating_point="fast", sphere="stable", cutoff=0.25, precision="float32")
    made = job(fast, PLAIN)
    assert made.seeds == (0,)
    assert (made.parameters.floating_point, made.parameters.sphere, made.parameters.cutoff) == ("strict", "robust", 0)
    assert made.parameters.precision == "float64" and made.parameters.sampler == "one"
    assert made.parameters.epsilon == 32 * 2.0**-24  # that of the picture: contact shadows must not differ
    assert job(PLAIN, fast).parameters.epsilon == 32 * 2.0**-53


def test_the_depth_that_the_experiment_gives():
    shallow = replace(PLAIN, depth=1)
    assert job(shallow, PLAIN, depth=9) == job(PLAIN, shallow, depth=9)
    assert job(shallow, depth=9).parameters.depth == 9
    assert job(shallow, PLAIN).parameters.depth == 1


def test_64_times_the_samples_of_the_largest_and_other_seeds():
    small = replace(PLAIN, sampler="jittered", samples=3, seed=truth.FAMILY)
    large = replace(PLAIN, sampler="uniform", samples=4, precision="float32")
    made = job(small, large)
    assert made == job(large, small)  # its noise hides what the epsilons of two precisions do
    assert (made.parameters.sampler, made.parameters.samples) == ("jittered", 8)
    assert len(made.seeds) * made.parameters.samples**2 >= 64 * 16
    assert len(set(made.seeds)) == len(made.seeds) and not {small.seed, large.seed} & set(made.seeds)
    assert all(0 <= seed < 2**32 for seed in made.seeds)


def test_of_adaptive_samples_the_most_count():
    made = job(replace(PLAIN, sampler="adaptive", adaptive_depth=3))
    assert len(made.seeds) * made.parameters.samples**2 >= 64 * 64


def test_feelers_at_the_centre_of_a_pixel_stay_there():
    made = job(replace(PLAIN, feelers=5, shadows=True), replace(PLAIN, feelers=16, shadows=True))
    assert made.parameters.sampler == "one" and made.parameters.feelers == 16
    assert len(made.seeds) == 64


def test_feelers_of_samples_are_samples():
    made = job(replace(PLAIN, sampler="jittered", samples=2, feelers=9))
    assert made.parameters.feelers == 1 and len(made.seeds) * made.parameters.samples**2 >= 64 * 4 * 9


def test_a_sampled_truth_must_be_asked_for():
    made = job(replace(PLAIN, sampler="uniform", samples=2), times=None)
    assert made.seeds == () and "[reference]" in made.reason
    assert job(PLAIN, times=None).seeds == (0,)


def test_mean_and_standard_error():
    rng = np.random.default_rng(61)
    print("seed 61")
    pictures = rng.normal(0.3, 0.2, (25, 4, 5, 3)).astype(np.float32)
    found = truth.mean("cpp", iter(pictures))
    wide = pictures.astype(np.float64)
    np.testing.assert_allclose(found.picture, wide.mean(axis=0), rtol=1e-12)
    np.testing.assert_allclose(found.standard_error, wide.std(axis=0, ddof=1) / 5, rtol=1e-12)
    assert found.uncertainty == pytest.approx(0.04, rel=0.1)
    one = truth.mean("cpp", iter(pictures[:1]))
    assert one.standard_error is None and one.uncertainty is None and one.pictures == 1
