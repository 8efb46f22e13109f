"""The result of a run in a sentence and as bars: who is compared, what is resolved, and what is never claimed."""

import numpy as np
import pytest

from reports.times import headline

ROUNDS = 8
SCENE = "scenes/comparison.txt"


@pytest.fixture
def at(record):
    """at(variant, level, ..): ROUNDS repetitions with steady times around `level`, s, in step with all others."""

    def make(variant, level, noise=0.0, rounds=ROUNDS, **parameters):
        wave = 1 + noise * np.cos(np.arange(rounds) * (3 + len(variant)))
        point = {key: value for key, value in parameters.items() if key != "epsilon"}
        told = {"parameters": record("")["parameters"] | {"vector": "off"} | parameters, "point": point}
        key = "-".join(map(str, (variant, *parameters.values()))).replace(",", "-")
        told |= {"cell": key, "series": None, "picture": {"file": f"pictures/{key}.npy"}}
        return [record(variant, n, frames=(1.0, level * wave[n]), **told) for n in range(rounds)]

    return make


def paired(records, floor):
    """Records and facts of a run whose first cell ran twice in every round, `floor` apart."""
    again = [row | {"pass": "pair", "frames_s": [1.0, row["frames_s"][1] * (1 + floor)]} for row in records]
    mine = [row for row in again if row["cell"] == records[0]["cell"]]
    return [*records, *mine], {"pair": {"cell": records[0]["cell"], "label": "the pair"}}


def test_the_fastest_and_how_much_longer_the_others_take(load, at):
    found = headline.of(load([*at("python", 43.0), *at("cpp", 1.0), *at("numpy", 2.06), *at("numba", 1.04)]))
    assert found.sentence == (
        "cpp is the fastest, 1.00 s a frame; numba takes 4.0 % longer, numpy 2.1 times and python 43 times."
    )
    assert [(bar.name, bar.time.value, bar.ratio and round(bar.ratio.value, 2)) for bar in found.bars] == [
        ("cpp", 1.0, None), ("numba", 1.04, 1.04), ("numpy", 2.06, 2.06), ("python", 43.0, 43.0),
    ]  # fmt: skip
    assert (found.where, found.clock, found.lacking) == ("comparison", "steady frame", [])


def test_what_is_not_resolved_is_never_called_equal(load, at):
    """8 rounds with scatter of 30 % say nothing of 1 %."""
    told = [*at("cpp", 1.0, 0.3), *at("numba", 1.01, 0.3), *at("python", 43.0)]
    found = headline.of(load(told))
    assert " and ".join(bar.name for bar in found.bars[:2]) + " tie at " in found.sentence
    ratio = found.bars[1].ratio
    within = max(1 / ratio.low, ratio.high) - 1
    assert f"the difference could be up to {100 * within:.2g} %. python takes 4" in found.sentence and within > 0.1


@pytest.mark.parametrize(
    ("floor", "said"),
    [
        (0.02, "are equally fast (within 2.0 %), 1.00 s a frame."),
        (0.14, "tie at 1.00 to 1.01 s a frame; the difference could be up to 14 %."),
    ],
)
def test_equal_needs_a_narrow_interval_and_a_low_noise_floor(load, at, floor, said):
    records, facts = paired([*at("cpp", 1.0), *at("numba", 1.01)], floor)
    assert headline.of(load(records, **facts)).sentence == f"cpp and numba {said}"


def test_too_few_processes_resolve_nothing(load, at):
    found = headline.of(load([*at("cpp", 1.0, rounds=3), *at("numba", 2.0, rounds=3)]))
    assert found.sentence == (
        "cpp has the lowest median, 1.00 s a frame; numba takes 2.0 times as long. "
        "3 processes each resolve no difference: 5 are needed."
    )


def test_the_fastest_of_all_is_not_told_from_what_the_intervals_do_not(load, at):
    """Two methods 1 % apart, with scatter of 30 %: neither is called the fastest of all."""
    fast = {"vector": "on", "precision": "float32", "epsilon": 2e-6}
    rows = [*at("cpp", 1.0), *at("numba", 2.0), *at("cpp", 0.1, 0.3, **fast), *at("numba", 0.101, 0.3, **fast)]
    found = headline.of(load(rows)).sentence
    assert "The fastest of all are " in found and " and " in found and ", which tie: " in found


def test_methods_are_named_by_what_varies_and_the_fastest_has_its_error(load, at):
    fast = {"vector": "on", "precision": "float32", "epsilon": 2e-6}
    told = [
        *at("cpp", 1.0),
        *at("numba", 2.0),
        *at("numpy", 5.0),
        *at("cpp", 0.125, **fast),
        *at("numba", 0.25, **fast),
    ]
    for row in told:
        if row["parameters"]["vector"] == "on":
            row["error"] = row["error"] | {"rmse": 0.25, "rmse_standard_error": 0.0}
    found = headline.of(load(told))
    assert [bar.name for bar in found.bars] == [
        "cpp, lanes, float32", "numba, lanes, float32", "cpp", "numba", "numpy",
    ]  # fmt: skip
    assert found.sentence == (
        "cpp is the fastest, 1.00 s a frame; numba takes 2.0 times as long and numpy 5.0 times. The fastest of all is "
        "cpp (lanes, float32): 125 ms, 8.0 times as fast as cpp, RMSE 0.25."
    )
    found = headline.of(load([row for row in told if row["point"]], name="fast"))
    assert ([bar.name for bar in found.bars], found.shared) == (["cpp", "numba"], ["lanes", "float32"])
    found = headline.of(load([row for row in told if row["variant"] == "cpp"], name="alone"))
    assert found.sentence == "cpp (lanes, float32) is the fastest, 125 ms a frame; cpp takes 8.0 times as long."


def test_rivals_are_told_with_their_fastest_methods_where_the_winner_has_no_faster(load, at):
    """A GPU is not told to be so many times as fast as cores that trace one ray after another, and that alone."""
    told = [*at("cuda-cpp", 1.0), *at("cpp-threads", 20.0), *at("numba", 30.0), *at("cpp-threads", 3.0, vector="on")]
    found = headline.of(load(told))
    assert found.sentence == (
        "cuda-cpp is the fastest, 1.00 s a frame; cpp-threads takes 20 times as long and numba 30 times. "
        "With its fastest method, cpp-threads (lanes) takes 3.0 times as long."
    )


def test_the_task_of_most_work_that_all_have_and_the_mean_over_all(load, at):
    """Geometric means: numba over cpp 1, 2 and 4, that is 2; python is in one place only."""
    told = [row for depth, times in ((1, 1.0), (2, 2.0), (3, 4.0))
            for row in (*at("cpp", 1.0 * depth, depth=depth), *at("numba", times * depth, depth=depth))]  # fmt: skip
    found = headline.of(load(told))
    assert found.where == "comparison, depth 3" and [bar.time.value for bar in found.bars] == [3.0, 12.0]
    assert found.sentence.endswith("Over 3 configurations, geometric means: numba 2.0 times the time of cpp.")
    found = headline.of(load([*told, *at("python", 9.0, depth=2)], name="most"))
    assert found.where == "comparison, depth 2" and len(found.bars) == 3
    assert "Over" not in found.sentence, "no mean of one place"


def test_a_variant_without_a_time_has_its_reason(load, at, bad):
    found = headline.of(load([*at("cpp", 1.0), bad("numba", "failed", "it broke")]))
    assert found.sentence == "Only cpp is ranked: 1.00 s a frame." and found.lacking == [("numba", "failed: it broke")]
    found = headline.of(load([bad("cpp", "failed", "it broke"), bad("numba", "failed", "it broke")], name="none"))
    assert found.sentence == "Nothing is ranked: failed: it broke." and found.bars == []


def test_methods_that_trade_speed_for_accuracy_are_compared_within_1_255(load, jittered):
    """Of n x n samples the error is 0.08 / n^1.5: 8 x 8 is the first within 1/255, 4 x 4 has 0.01."""
    told = [*jittered("cpp", 0.09), *jittered("numba", 0.3), *jittered("numpy", 2.0, sides=(1, 2, 4))]
    found = headline.of(load(told))
    assert found.sentence.startswith("Within 1/255 of the truth (RMSE), with jittered 8 × 8: cpp is the fastest, 5.")
    assert [(bar.name, bar.cell.parameters["samples"]) for bar in found.bars] == [("cpp", 8), ("numba", 8)]
    assert found.shared == ["jittered 8 × 8"]
    assert found.lacking == [("numpy", "no method of it is within 1/255: its nearest has 0.010")]
    far = headline.of(load([row for row in told if row["parameters"]["samples"] < 8], name="far"))
    assert far.sentence.startswith("Within 1/32 of the truth (RMSE), with jittered 2 × 2: cpp is the fastest, ")


def test_first_frames_stand_in_where_there_are_no_steady_ones(load, record):
    told = [
        record(variant, frames=(seconds * (1 + depth),), point={"depth": depth}, cell=f"{variant}-{depth}", series=None)
        for depth in (0, 1)
        for variant, seconds in (("cpp", 1.0), ("numba", 2.0))
    ]
    found = headline.of(load(told))
    assert found.sentence == (
        "cpp has the lowest median, 3.00 s for the first frames of all 2 pictures; numba takes 2.0 times as long. "
        "One process each resolves no difference: 5 are needed."
    )
    assert (found.clock, found.where) == ("first frame", "all 2 pictures")


def test_a_start_is_told_warm_and_cold_and_with_the_build(load, record):
    def start(variant, kind, cache, seconds, **more):
        marks = [["start", 0.0, seconds - 0.5], ["compile", seconds - 0.5, seconds - 0.25]][: 1 + bool(cache)]
        return [record(variant, n, frames=(0.5,), phases=[*marks, ["render", 9, 10]], cache=cache, series=None,
                       **{"pass": kind}, **more) for n in range(ROUNDS)]  # fmt: skip

    build = {"seconds": 7.0, "compiler": "g++", "command": ["g++"]}
    told = [*start("numba", "timed", "warm", 2.25), *start("numba", "cold", "cold", 4.25)]
    told += [*start("cpp", "timed", None, 1.0, build=build), *start("cpp", "cold", None, 1.0, build=build)]
    told += [*start("numpy", "timed", None, 1.5), *start("numpy", "cold", None, 1.5)]
    found = headline.of(load(told))
    assert found.sentence == (
        "To the first frame, warm: cpp is the fastest, 1.00 s from the start of the process; numpy takes 1.5 times as "
        "long and numba 2.5 times. From an empty compile cache, the build of a program included: numba 4.50 s, "
        "cpp 8.00 s."
    )
    assert [bar.name for bar in found.bars] == [
        "cpp, warm", "numpy, warm", "numba, warm", "numba, cold", "cpp, cold, with its build",
    ]  # fmt: skip
