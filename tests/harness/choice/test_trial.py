"""Tiles of a picture, their truth, and what they say of the whole."""

import numpy as np
import pytest
from laws import Laws, trial

from harness.choice.trial import ACROSS, CannotTell, TimeUp, tiles
from harness.judge import judge, truth
from harness.judge.truth import Truth


def test_tiles_lie_apart_in_the_picture_one_in_each_cell():
    for seed in range(20):
        found = tiles((7, 11, 407, 311), seed)
        assert len(found) == ACROSS**2 and found != tiles((7, 11, 407, 311), seed + 1)
        sides = {(x1 - x0, y1 - y0) for x0, y0, x1, y1 in found}
        assert sides == {(21, 21)}
        covered = np.zeros((311, 407), int)
        for x0, y0, x1, y1 in found:
            covered[y0:y1, x0:x1] += 1
        assert covered.max() == 1 and not covered[:11].any() and not covered[:, :7].any()
        assert covered.sum() == 21 * 21 * ACROSS**2


@pytest.mark.parametrize("bounds", [(0, 0, 1, 1), (3, 4, 9, 7), (0, 0, 128, 64), (0, 0, 20, 4000)])
def test_a_small_picture_is_one_tile(bounds):
    assert tiles(bounds, 3) == [bounds]


@pytest.mark.parametrize("limit", [0.05, 0.01, 0.002])
def test_the_truth_is_known_to_a_quarter_of_the_limit(limit):
    laws = Laws(0.1)
    asked = trial(laws, limit, seed=truth.FAMILY)
    found, side = asked.truth([asked.parameters.bounds()], 4, 1)
    assert found.uncertainty <= limit / 4
    off = np.sqrt(np.mean((found.picture - 0.5) ** 2))
    assert off == pytest.approx(found.uncertainty, rel=0.1) and len(set(found.seeds)) == len(found.seeds)
    assert asked.parameters.seed not in found.seeds and found.samples == side**2 * len(found.seeds)
    other, _ = asked.truth([asked.parameters.bounds()], 4, 2**16)
    assert not set(found.seeds) & set(other.seeds)


@pytest.mark.parametrize(("share", "is_clear"), [(0.5, True), (0.9, True), (1.0, False), (1.1, True), (3.0, True)])
def test_a_clear_verdict_takes_a_truth_of_half_the_limit(share, is_clear):
    """Of a picture that is as far off as the limit the truth is known to a quarter of it, as before."""
    limit, seed = 0.01, 5
    asked = trial(Laws(0.1), limit)
    noise = np.random.default_rng(seed).normal(0, share * limit, asked.parameters.shape())
    picture = 0.5 + noise * share * limit / np.sqrt(np.mean(noise**2))
    found, _ = asked.truth([asked.parameters.bounds()], 4, 1, of=picture)
    assert found.uncertainty <= (limit / 2 if is_clear else limit / 4)
    assert asked.is_clear(picture, found)
    told = judge.errors(picture, found.picture, found.standard_error, None)
    assert told["rmse"] == pytest.approx(share * limit, abs=4 * told["rmse_standard_error"])
    if share in (0.5, 3.0):
        assert found.uncertainty > limit / 4  # it has not gone on


def test_a_truth_that_cannot_be_known_in_time():
    with pytest.raises(CannotTell, match=r"no truth from samples can tell in this time: it is known to 0\.0"):
        asked = trial(Laws(0.1), 1e-9, seconds=20)
        asked.truth([asked.parameters.bounds()], 4, 1)


def test_depths_that_never_end_are_told():
    laws = Laws(0.0)
    laws.picture = lambda job: np.full(job.shape(), 0.5 + 0.01 * job.depth)
    asked = trial(laws, 0.01)
    with pytest.raises(CannotTell, match=r"rays deeper than 64 and of weights below 6e-08 could add an RMS of 0\.24"):
        asked.truth([asked.parameters.bounds()], 4, 1)


def test_time_is_up():
    asked = trial(Laws(), 0.01, seconds=0)
    with pytest.raises(TimeUp):
        asked.shoot(asked.entries["cpp-threads"], asked.parameters, [asked.parameters.bounds()])


@pytest.mark.parametrize("known", [False, True], ids=["spread", "ratio"])
def test_the_error_of_the_whole_lies_within_that_of_tiles(known):
    """Noise of very different size over the picture: in two standard errors lie 95 of 100, or nearly."""
    width, height, inside, wide = 160, 130, 0, []
    for seed in range(100):
        rng = np.random.default_rng([7, seed])
        x, y = np.meshgrid(np.arange(width), np.arange(height))
        hard = (1 + np.sin(x / 9 + seed) * np.cos(y / 7))[..., None] ** 2
        array = 0.5 + hard * rng.normal(0, 0.1, (height, width, 3))
        asked = trial(Laws(), 0.01, width, height)
        places = tiles(asked.parameters.bounds(), seed)
        cut = np.concatenate([array[y0:y1, x0:x1] for x0, y0, x1, y1 in places])
        right = Truth("t", np.full(cut.shape, 0.5), 1, (0,), None, 0, 0.0, 0.0)
        proxy = (hard * rng.normal(0, 0.3, (height, width, 3))) ** 2 if known else None
        told = asked.error(cut, right, places, proxy)
        whole = np.sqrt(np.mean((array - 0.5) ** 2))
        inside += abs(told["rmse"] - whole) <= 2 * told["rmse_standard_error"]
        wide.append(told["rmse_standard_error"] / whole)
    assert inside >= 88
    assert np.median(wide) < (0.03 if known else 0.15)
