"""Warm-up and steady state of made-up frames, over many seeds: the seeds of wrong answers are in the failure."""

import re
from pathlib import Path

import numpy as np
import pytest

from harness.statistics import steady

SEEDS = 200
FRAME = 0.123  # s


def frames(seed, count=101, noise=0.01, outliers=0.0, shape=1.0):
    """Seconds of frames: normal noise, a share of outliers 2 to 10 times as long, all times `shape`."""
    rng = np.random.default_rng(seed)
    made = FRAME * (1 + noise * rng.standard_normal(count)) * shape
    hit = rng.random(count) < outliers
    made[hit] *= rng.uniform(2, 10, hit.sum())
    return made.tolist(), hit


def right(answer, **how):
    """Of the seeds, those with another answer than `answer(first, state, hit)` allows."""
    wrong = []
    for seed in range(SEEDS):
        made, hit = frames(seed, **how)
        found = steady.find(made)
        if not answer(found, hit):
            wrong.append((seed, found))
    return wrong


def is_steady_at_once(found, _):
    return (found.first, found.state) == (1, "steady")


def is_none(found, _):
    return found.first is None and found.state == "none" and found.note


def slow_start(count=101, warm=7, by=(1.2, 1.2)):
    return np.concatenate([np.geomspace(*by, warm), np.ones(count - warm)])


@pytest.mark.parametrize("count", [11, 21, 101])
def test_even_frames_are_steady_from_the_second_on(count):
    found = steady.find([FRAME] * count)
    assert (found.first, found.state, found.warm_up, found.note) == (1, "steady", 0, "")


@pytest.mark.parametrize(
    ("how", "most_wrong"),
    [
        ({}, 0.01),
        ({"outliers": 0.12}, 0.04),  # frame 1 may be an outlier with several behind it
        ({"noise": 0.2}, 0.01),
        ({"count": 21}, 0.03),
        ({"count": 11, "outliers": 0.12}, 0.06),
    ],
)
def test_noise_and_outliers_are_steady(how, most_wrong):
    wrong = right(is_steady_at_once, **how)
    assert len(wrong) <= most_wrong * SEEDS, wrong


def test_a_drift_of_3_percent_a_minute_is_steady():
    time = FRAME * np.arange(101)
    wrong = right(is_steady_at_once, shape=1 + 0.03 * time / 60)
    assert not wrong, wrong


@pytest.mark.parametrize("by", [(1.2, 1.2), (5, 5), (5, 1.2), (1.5, 1.2)])
@pytest.mark.parametrize("count", [31, 101])
def test_a_warm_up_of_7_frames_is_7_frames(by, count):
    wrong = right(lambda found, _: (found.first, found.warm_up) == (7, 7), count=count, shape=slow_start(count, by=by))
    assert not wrong, wrong


@pytest.mark.parametrize("by", [(1.2, 1.2), (5, 1.2)])
def test_with_outliers_the_warm_up_ends_at_the_first_frame_that_is_none(by):
    def at_first_good(found, hit):
        return found.state == "steady" and found.first == 7 + int(np.argmin(hit[7:]))

    wrong = right(at_first_good, outliers=0.12, shape=slow_start(by=by))
    assert len(wrong) <= 0.02 * SEEDS, wrong


@pytest.mark.parametrize("count", [51, 101, 301])
@pytest.mark.parametrize("outliers", [0.0, 0.12])
@pytest.mark.parametrize("ends", [(1.0, 0.7), (1.0, 1.3)])
def test_a_drift_of_30_percent_is_no_steady_state(count, outliers, ends):
    wrong = right(is_none, count=count, outliers=outliers, shape=np.linspace(*ends, count))
    assert not wrong, wrong


@pytest.mark.parametrize("count", [21, 101])
@pytest.mark.parametrize("outliers", [0.0, 0.12])
@pytest.mark.parametrize("ends", [(1.0, 1.2), (1.2, 1.0)])
def test_two_levels_are_no_steady_state(count, outliers, ends):
    wrong = right(is_none, count=count, outliers=outliers, shape=np.where(np.arange(count) < count // 2, *ends))
    assert len(wrong) <= 0.01 * SEEDS, wrong


def test_the_note_says_what_changed():
    # frame n lasts 2 - n / 100: the median of frames 1 to 33 is 1.83, of 68 to 100 1.16, 36.6 % less
    found = steady.find((2 - np.arange(101) / 100).tolist())
    assert found.note == "no steady state: its frames became 37 % faster"
    assert found.change == pytest.approx(1.16 / 1.83)
    found = steady.find([1.0] * 60 + [2.5] * 40)
    assert found.note == "no steady state: its frames became 150 % slower"


def test_a_late_change_that_is_small_is_none():
    """More than 1/3 of the frames lie outside the band of 2 % around the last level: all count."""
    found = steady.find([9.0] + [1.0] * 13 + [1.04] * 17)
    assert found == steady.Steady(1, "steady", change=1.04)
    assert steady.find([9.0] + [1.0] * 13 + [1.06] * 17).state == "none"


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ([1.06] * 5, "6 % slower"),
        ([0.9] * 5, "10 % faster"),
        ([1.05] * 5, ""),  # not more than 5 %
        ([0.97] * 5, ""),
        ([1.2] * 4 + [0.99], ""),  # the interval of 5 is their range
        ([1.2] * 9 + [0.8], "20 % slower"),  # that of 10 leaves out one on either side
        ([1.2] * 8 + [0.8] * 2, ""),
        ([1.2, 0.8] * 5, ""),
    ],
)
def test_processes_that_change_alike_have_no_steady_state_together(changes, told):
    found = steady.together(changes, [""] * len(changes))
    assert found == (told and f"no steady state: the frames of {len(changes)} processes became {told}")
    assert steady.together(changes, ["a note"] * len(changes)) == found


@pytest.mark.parametrize(
    ("notes", "told"),
    [
        (["a"], "a"), ([""], ""), (["a", ""], ""), (["", "a", "b"], "a, in 2 of 3 repetitions"), (["a", "b"], "a"),
        (["a", "", "", "b"], ""), ([], ""),
    ],
)  # fmt: skip
def test_of_few_processes_more_than_half_must_have_none(notes, told):
    assert steady.together([1.5] * len(notes), notes) == told


def test_few_frames_are_assumed_to_be_steady():
    assert steady.find([9.0, 1.0]) == steady.find([9.0, 1.0, 2.0]) == steady.Steady(1, "assumed")
    assert steady.find([9.0] + [1.0] * 9).state == "assumed"
    assert steady.find([9.0] + [1.0] * 10) == steady.Steady(1, "steady", warm_up=1, change=1.0)


@pytest.mark.parametrize(
    ("following", "starts"),
    [
        ("....||||...", True),  # 4 of the next 8
        ("|...|||....", True),
        ("....|||.|||", False),  # 3, not counting itself; and those behind the 8 do not matter
        ("|..|....|||", False),
    ],
)
def test_a_warm_up_ends_before_8_frames_half_of_which_are_in_the_band(following, starts):
    """Frames in the band are |, frames above it are a point."""
    warm = [3.0, 1.0, *(1.0 if sign == "|" else 1.5 for sign in following)]
    found = steady.find([*warm, *[1.5] * 4, *[1.0] * 60])
    assert found.state == "steady" and (found.warm_up == 1) == starts, found


def test_the_time_of_a_process_is_the_median_of_its_steady_frames():
    warm = [9.0] + [3.0] * 4 + [1.0, 1.1, 1.2, 1.0, 1.1, 1.2, 1.1, 1.0, 1.2, 1.1, 1.0]
    found = steady.find(warm)
    assert found.start == 5 and list(found.frames) == warm[5:] and found.seconds == 1.1
    assert steady.find([9.0, 1.0, 2.0, 4.0]).seconds == steady.rough([9.0, 1.0, 2.0, 4.0]) == 2.0
    growing = [1.0 + 0.1 * n for n in range(40)]
    assert steady.find(growing).first is None and list(steady.find(growing).frames) == growing[1:]


def test_a_rough_time_may_be_that_of_the_only_frame():
    assert steady.find([9.0]).seconds is None and steady.rough([9.0]) == 9.0
    assert steady.find([9.0, 0.0]).seconds == steady.rough([9.0, 0.0]) == 0.0


# What works out a time of a frame: frames without the first, and the middle or the least of frames.
OF_FRAMES = re.compile(r"""frames(_s)?(["'\]]*)\[1:\]|\b(min|median|mean)\([\[(]*(\w+[.\[]["']?)?frame""")


def test_the_rule_stands_in_one_place():
    rules = 'median([frame["end"] - frame["start"]', 'row["frames_s"][1:]', "min(facts['frames_s'])", "said.frames[1:]"
    for rule in rules:
        assert OF_FRAMES.search(rule), rule
    root = Path(steady.__file__).parents[2]
    files = [path for name in ("harness", "reports", "rayrace") for path in (root / name).rglob("*.py")]
    found = {
        f"{path.relative_to(root)}: {line.strip()}"
        for path in files
        for line in path.read_text(encoding="utf-8").splitlines()
        if OF_FRAMES.search(line)
    }
    assert {line.partition(":")[0] for line in found} == {"harness/statistics/steady.py"}, sorted(found)


@pytest.mark.parametrize("frames_s", [[], [1.0]])
def test_without_a_later_frame_there_is_none(frames_s):
    found = steady.find(frames_s)
    assert (found.first, found.state, found.note) == (None, "none", "no steady frames")


def test_times_of_0_are_no_fault():
    assert steady.find([0.0] * 30).state == "steady"
    assert steady.find([0.0] * 15 + [1.0] * 15).state == "none"
