"""The first section: a sentence, bars as numbers, what was raced, and what limits the result."""

from itertools import pairwise

import numpy as np
import pytest
import report_tables

from harness.statistics.statistics import Estimate
from reports.chart.embedded import Embedded
from reports.run import study
from reports.summary import doubts, glance
from reports.times import headline

ALL = study.VARIABLES | {"region": "0,0,512,512"}


@pytest.fixture
def told(record):
    """Five rounds of cpp, numba and numpy on the study's scene, cpp in lanes too."""
    rows = []
    for variant, level, vector in (
        ("cpp", 0.5, "off"),
        ("numba", 1.0, "off"),
        ("numpy", 2.0, "off"),
        ("cpp", 0.1, "on"),
    ):
        for n in range(5):
            parameters = record("")["parameters"] | ALL | {"vector": vector}
            rows.append(record(variant, n, frames=(9, level * (1 + 0.01 * n)), cell=f"{variant}-{vector}",
                               parameters=parameters, point={"vector": vector}, shapes={"sphere": 48, "box": 0},
                               lights=1, picture=None, series=None))  # fmt: skip
    return rows


def test_the_section_has_the_sentence_and_a_table_of_the_bars(load, told):
    text = glance.write(load(told))
    assert text.startswith("## At a glance\n\ncpp is the fastest, 510 ms a frame; numba takes 2.0 times as long and")
    (table,) = report_tables.tables(text)
    assert [(row["renderer"], row["÷ cpp"].partition(" ")[0], row["the study, 2020"]) for row in table] == [
        ("cpp, lanes", "0.200,", "none"), ("cpp", "1", "11.22 ± 0.03 s"), ("numba", "2.00,", "149 ± 1 s"),
        ("numpy", "4.00,", "none"),
    ]  # fmt: skip
    assert table[0]["steady frame"] == r"102 \[100, 104\] ms" and table[0]["RMSE"] == "0.062"
    assert "comparison, 512 × 512, depth 10, no shadows, 48 spheres, 1 light." in text


def test_what_limits_the_result_is_said_with_the_section_that_has_more(load, told, bad):
    told[0]["warnings"] = ["odd"]
    told += [
        bad("cuda", "unavailable", "no device"),
        bad("jax", "failed", "it broke"),
        bad("pypy", "failed", "it broke"),
    ]
    results = load(told)
    found = dict(glance.remarks(results, headline.of(results)))
    assert found == {
        "Noise floor: unavailable: the run has no A/A pair.": "summary",
        "cuda: unavailable: no device.": "summary",
        "jax, pypy: failed: it broke.": "summary",
        "Without a result: 2 failed.": "summary",
        "1 measurement warning.": "doubts",
    }
    assert len(doubts.kinds(results)) == 1


def test_the_axis_is_linear_from_0_and_logarithmic_for_long_spans():
    near, far = (glance.scale([Estimate(value, None, None, 1) for value in ends]) for ends in ((0.1, 0.4), (1e-3, 2.0)))
    assert not near.logarithmic and near.at(0.21) == 50.0
    assert near.ticks == [(0.0, "0"), (23.81, "100 ms"), (47.62, "200 ms"), (71.43, "300 ms"), (95.24, "400 ms")]
    for end in np.geomspace(1, 10, 50):  # labels are 35 pixels wide, the axis 340
        places = [place for place, _ in glance.scale([Estimate(end, None, None, 1)]).ticks]
        assert 3 <= len(places) <= 6 and min(b - a for a, b in pairwise(places)) > 15 and places[-1] <= 100
    assert far.logarithmic and [label for _, label in far.ticks] == ["1 ms", "10 ms", "100 ms", "1 s"]
    places = [place for place, _ in far.ticks]
    steps = {round(b - a, 1) for a, b in pairwise(places)}
    assert len(steps) == 1 and 0 < far.at(1e-3) < far.at(2.0) < 100


def test_of_many_bars_each_variant_keeps_its_fastest_and_the_one_compared(load, record):
    told = [
        record(f"v{v}", cell=f"v{v}-{cutoff}", frames=(1, (1 + v) * 2.0**-cutoff), series=None, picture=None,
               parameters=record("")["parameters"] | {"seed": cutoff}, point={"seed": cutoff})
        for v in range(4) for cutoff in range(20)
    ]  # fmt: skip
    found = headline.of(load(told))
    assert len(found.bars) == 80
    shown = glance.few(found.bars, glance.MOST)
    assert len(shown) == glance.MOST and shown == [bar for bar in found.bars if bar in shown]
    assert {bar.cell.variant for bar in shown if bar.compared} == {"v0", "v1", "v2", "v3"}
    assert {bar.cell.variant for bar in shown if not bar.compared} == {"v0", "v1", "v2", "v3"} and shown[
        0
    ] is found.bars[0]
    assert "Shown are 60 of 80 methods" in glance.write(load(told, name="again"))


def test_a_picture_for_each_scene_and_case(load, record):
    told = [record("cpp", cell=f"cpp-{case}", point={"case": case}, series=None,
                   picture={"file": f"pictures/{case}.npy"}) for case in ("one", "two")]  # fmt: skip
    results, pictures = load(told), Embedded(10**6)
    found = glance.data(results, pictures)
    assert [name for _, name in found["pictures"]] == ["one", "two"] and len(pictures.images) == 1, "equal: kept once"
    assert found["machine"] == "a processor, 2 cores, 8 GB, an OS, a virtual machine"
