"""The search for the quickest method within an error, by laws that are known."""

import pytest
from laws import Laws, trial

from harness.choice.search import Search
from harness.errors import UserError


def search(laws, limit, fixed=(), variant="", **more):
    return Search(trial(laws, limit, **more), variant, frozenset(fixed))


@pytest.mark.parametrize(("limit", "side"), [(0.2, 1), (0.055, 2), (0.0127, 8), (0.0041, 28)])
def test_as_many_samples_as_it_takes(limit, side):
    found = search(Laws(0.1, bias=1.0), limit).choose()
    assert (found.parameters.samples if side > 1 else 1, found.parameters.precision) == (side, "float64")
    assert found.rmse + 2 * found.standard_error <= limit
    assert found.seconds == pytest.approx(side**2)


@pytest.mark.parametrize(("bias", "precision"), [(0.001, "float32"), (0.012, "float32"), (0.03, "float64")])
def test_precision_where_its_bias_is_small(bias, precision):
    found = search(Laws(0.1, bias), 0.02).choose()
    assert found.parameters.precision == precision


def test_a_depth_that_leaves_little_out():
    found = search(Laws(0.05, bias=1.0, deep=0.002), 0.02).choose()
    assert 1 < found.parameters.depth < 8 and found.rmse <= 0.02


def test_what_is_fixed_stays_and_is_named_where_it_is_in_the_way():
    asked = search(Laws(0.1), 0.02, ("sampler", "precision"), sampler="one")
    assert asked.choose() is None
    assert {job.sampler for job in (method.parameters for method in asked.measured)} == {"one"}
    assert asked.in_the_way() == ["sampler"]
    assert asked.choose() is None  # although it has been measured without


def test_of_two_options_the_one_that_suffices_is_in_the_way():
    asked = search(Laws(0.1, deep=0.02), 0.09, ("sampler", "depth"), sampler="one", depth=4)
    assert asked.choose() is None and asked.in_the_way() == ["sampler"]


@pytest.mark.parametrize(("deep", "depth"), [(0.002, 2), (0.0, 0)])
def test_adaptive_samples_have_a_depth_of_their_own(deep, depth):
    """They know no cut-off, so that a deep tree of rays would cost too much."""
    asked = search(Laws(0.05, deep=deep), 0.05)
    asked.choose()
    assert asked.shallow == depth


def test_a_miss_is_learnt_from():
    """Tiles that are four times too good: after the miss it takes that many more samples."""
    asked = search(Laws(0.1, bias=1.0, lie=0.25), 0.0127, width=400, height=300)
    asked.hard = None
    before = asked.choose()
    assert before.parameters.samples < 4
    asked.learn(before, 4 * before.rmse)
    after = asked.choose()
    assert 7 <= after.parameters.samples <= 10


def test_nobody_can_do_it():
    laws = Laws()
    asked = trial(laws, 0.01, kernel="general")
    with pytest.raises(UserError, match="no renderer can do this job: cpp-threads: has no kernel general"):
        Search(asked, "", frozenset({"kernel"}))
