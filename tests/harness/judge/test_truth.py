"""The truth: which pictures share one, what makes it, and how well it is known."""

from dataclasses import replace

import numpy as np
import pytest

from harness.experiment.experiment import Reference as Wanted
from harness.judge import truth
from harness.renderer.parameters import Parameters

SCENE_NEEDS = {"sphere", "diffuse"}
RANDOM = {"jittered": "supersampling", "uniform": "supersampling", "adaptive": "adaptive"}


def needs_of(parameters):
    more = {RANDOM[parameters.sampler]} if parameters.sampler in RANDOM else set()
    more |= {"soft"} if parameters.feelers else set()
    return tuple(sorted(SCENE_NEEDS | more))


SCENE, CENTRES = Wanted(), Wanted(against="centres", depth="own")


def job(*under_test, wanted=SCENE, needs=needs_of):
    """The job of the first of the pictures under test."""
    return truth.jobs(under_test, wanted, needs)[truth.view(under_test[0], wanted)]


PLAIN = Parameters(width=8, height=8, depth=3)
METHODS = (
    {"walk": "stack"}, {"accel": "none"}, {"sphere": "textbook"}, {"floating_point": "fast"}, {"cutoff": 0.1},
    {"threads": 7}, {"frames": 9}, {"seed": 5}, {"glossy_weight": "study"}, {"offset": "relative"},
)  # fmt: skip
# What is a choice of how to render the scene, and changes what is at the centres of pixels.
CHOICES = {"depth": 4}, {"sample_x": 0.25}, {"feelers": 2}, {"glossy_rays": 3}, {"sampler": "jittered", "samples": 3}
OTHER = {"width": 9}, {"shadows": True}, {"lens_radius": 0.1}, {"region": (0, 0, 4, 4)}


@pytest.mark.parametrize("method", [*METHODS, *CHOICES, {"precision": "float32"}, {"epsilon": 1e-3}])
def test_all_methods_share_the_truth_of_the_scene(method):
    assert truth.view(replace(PLAIN, **method), SCENE) == truth.view(PLAIN, SCENE)


@pytest.mark.parametrize("wanted", [SCENE, CENTRES])
@pytest.mark.parametrize("other", OTHER)
def test_another_picture_has_another_truth(other, wanted):
    assert truth.view(replace(PLAIN, **other), wanted) != truth.view(PLAIN, wanted)


@pytest.mark.parametrize("method", METHODS[:-1])
def test_methods_share_what_is_at_the_centres(method):
    assert truth.view(replace(PLAIN, **method), CENTRES) == truth.view(PLAIN, CENTRES)


@pytest.mark.parametrize("other", CHOICES)
def test_other_places_and_depths_have_other_colours(other):
    assert truth.view(replace(PLAIN, **other), CENTRES) != truth.view(PLAIN, CENTRES)


def test_of_the_scene():
    """Areas, its own depth, the epsilon of float64, and nothing random that the scene does not have."""
    made = job(replace(PLAIN, precision="float32", feelers=9, glossy_rays=2), PLAIN)
    told = made.parameters
    assert (told.sampler, told.precision, told.epsilon, made.against, made.deepen) == (
        "jittered", "float64", None, "scene", True,
    )  # fmt: skip
    assert (told.feelers, told.glossy_rays) == (1, 0)
    assert (told.depth, told.cutoff) == (0, 0)  # no ray of this scene has children
    mirrors = job(PLAIN, needs=lambda parameters: (*needs_of(parameters), "reflection"))
    assert (mirrors.parameters.depth, mirrors.parameters.cutoff) == (8, 2.0**-12)
    deep = job(replace(PLAIN, depth=40), PLAIN, needs=lambda parameters: (*needs_of(parameters), "reflection"))
    assert deep.parameters.depth == 40  # never shallower than a picture under test
    assert len(made.seeds) == 4 and made.samples >= 64 * 9 * 2


def test_a_given_depth():
    for depth in (2, 9):
        made = job(PLAIN, replace(PLAIN, depth=1), wanted=Wanted(depth=depth))
        assert made.parameters.depth == depth and not made.deepen and made.parameters.cutoff == 0
    shallow = replace(PLAIN, depth=1)
    assert job(shallow, PLAIN, wanted=CENTRES).parameters.depth == 1
    nine = replace_wanted(CENTRES, depth=9)
    assert job(shallow, PLAIN, wanted=nine) == job(PLAIN, shallow, wanted=nine)


def replace_wanted(wanted, **more):
    return wanted.model_copy(update=more)


def test_at_centres_without_feelers_it_is_one_strict_picture():
    fast = replace(PLAIN, floating_point="fast", sphere="stable", cutoff=0.25, precision="float32")
    made = job(fast, PLAIN, wanted=CENTRES)
    assert made.seeds == (0,) and made.against == "centres"
    assert (made.parameters.floating_point, made.parameters.sphere, made.parameters.cutoff) == ("strict", "robust", 0)
    assert made.parameters.precision == "float64" and made.parameters.sampler == "one"
    assert made.parameters.epsilon == 32 * 2.0**-24  # that of the picture: contact shadows must not differ
    assert job(PLAIN, fast, wanted=CENTRES).parameters.epsilon == 32 * 2.0**-53


@pytest.mark.parametrize("wanted", [SCENE, CENTRES])
def test_64_times_the_samples_of_the_largest_and_other_seeds(wanted):
    small = replace(PLAIN, sampler="jittered", samples=3, seed=truth.FAMILY)
    large = replace(PLAIN, sampler="uniform", samples=4, precision="float32")
    made = job(small, large, wanted=wanted)
    assert made == job(large, small, wanted=wanted)  # its noise hides what the epsilons of two precisions do
    assert (made.parameters.sampler, made.parameters.samples, len(made.seeds)) == ("jittered", 16, 4)
    assert made.samples >= 64 * 16
    assert len(set(made.seeds)) == len(made.seeds) and not {small.seed, large.seed} & set(made.seeds)
    assert all(0 <= seed < 2**32 for seed in made.seeds)
    assert made.against == ("scene" if wanted is SCENE else "areas")


def test_of_adaptive_samples_the_most_count():
    assert job(replace(PLAIN, sampler="adaptive", adaptive_depth=3)).samples >= 64 * 64


def test_feelers_at_the_centre_of_a_pixel_stay_there():
    under_test = replace(PLAIN, feelers=5, shadows=True), replace(PLAIN, feelers=16, shadows=True)
    made = job(*under_test, wanted=CENTRES)
    assert made.parameters.sampler == "one" and made.parameters.feelers == 16
    assert len(made.seeds) == 64


def test_feelers_of_samples_are_samples():
    made = job(replace(PLAIN, sampler="jittered", samples=2, feelers=9), wanted=CENTRES)
    assert made.parameters.feelers == 1 and made.samples >= 64 * 4 * 9


def test_a_kept_truth_serves_if_it_has_samples_enough_and_other_seeds():
    told = job(replace(PLAIN, sampler="jittered", samples=2))
    kept = truth.Truth("cpp", np.zeros((1, 1, 3)), told.samples, told.seeds, None, 8)
    assert kept.serves(told) and not replace(kept, samples=told.samples - 1).serves(told)
    deeper = replace(told, parameters=replace(told.parameters, depth=9))
    assert not kept.serves(deeper) and replace(kept, depth=9).serves(deeper)
    other = job(replace(PLAIN, sampler="jittered", samples=2, seed=told.seeds[1]))
    assert not kept.serves(other) and told.seeds[1] not in other.seeds


def test_mean_and_standard_error():
    rng = np.random.default_rng(61)
    print("seed 61")
    pictures = rng.normal(0.3, 0.2, (25, 4, 5, 3)).astype(np.float32)
    centre, error = truth.mean(iter(pictures))
    wide = pictures.astype(np.float64)
    np.testing.assert_allclose(centre, wide.mean(axis=0), rtol=1e-12)
    np.testing.assert_allclose(error, wide.std(axis=0, ddof=1) / 5, rtol=1e-12)
    found = truth.Truth("cpp", centre, 25, tuple(range(25)), error, 8)
    assert found.uncertainty == pytest.approx(0.04, rel=0.1)
    assert replace(found, change=0.01, unseen=0.02).uncertainty == pytest.approx(0.05, rel=0.1)
    again = truth.Truth.restored(*found.stored())
    assert again.facts() == found.facts() and np.array_equal(again.standard_error, error)
    assert truth.mean(iter(pictures[:1]))[1] is None
