"""The sentence on how times grow along what a run sweeps."""

import pytest

from reports.summary import glance, growth
from reports.times import headline


@pytest.fixture
def swept(load, record):
    """A function that loads a run of renderers over numbers of lights, each with its time by lights."""

    def make(**times_s):
        return load([
            record(name, n, frames=(9, level), cell=f"{name}-{lights}", point={"lights": lights}, lights=lights,
                   shapes={"sphere": 48}, picture=None, series=None)
            for name, levels in times_s.items() for lights, level in levels.items() for n in range(5)
        ])  # fmt: skip

    return make


def test_the_line_that_grows_least_and_the_one_that_grows_most_are_named(swept):
    run = swept(cpp={1: 0.1, 3: 0.2, 9: 0.65}, numba={1: 0.2, 3: 0.3, 9: 0.5}, numpy={1: 1.0, 3: 2.0, 9: 5.0})
    sentence = "A frame takes 2.5 (numba) to 6.5 times (cpp) as long with 9 lights as with 1 light."
    assert growth.gist(run) == sentence
    assert glance.sentences(run, headline.of(run))[0] == sentence


def test_two_values_are_no_sweep(swept):
    assert growth.gist(swept(cpp={1: 0.1, 9: 0.65}, numba={1: 0.2, 9: 0.5})) == ""


def test_a_single_line_is_named_once(swept):
    assert growth.gist(swept(cpp={1: 0.1, 3: 0.2, 9: 0.65})) == (
        "A frame takes 6.5 times (cpp) as long with 9 lights as with 1 light."
    )
