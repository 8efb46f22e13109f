"""Ladders: the product of known factors, what has no time, and the study's time beside the first rung."""

import csv

import pytest

from reports.run.cell import Missing
from reports.study import ladder, ladder_table

RUNGS = [
    {"name": "arrays", "renderer": "study-python", "changes": "c", "image": {}},
    {"name": "ours", "renderer": "python", "changes": "c", "image": {"walk": "chain"}},
    {"name": "lanes", "renderer": "cpp", "changes": "c", "image": {"vector": "on"}},
]
IMAGE = {"width": 4, "height": 4, "depth": 10, "walk": "least", "vector": "off"}
TIMES = {"study-python": 8.0, "python": 2.0, "cpp": 0.004}


@pytest.fixture
def rows(record):
    """rows(noise): six rounds of each rung; `noise` of a round is the same for all of them."""

    def make(noise=(0, 0, 0, 0, 0, 0), without=()):
        found = []
        for rung in RUNGS:
            variant, point = rung["renderer"], {"walk": "least", "vector": "off", **rung["image"]}
            parameters = record(variant)["parameters"] | IMAGE | point
            for number, share in enumerate(noise):
                told = {"parameters": parameters, "point": point, "lines": 100, "series": None}
                told |= {"status": "failed", "reason": "it broke"} if variant in without else {}
                if variant.startswith("study"):
                    told["unranked"] = "exhibit of a cost: slow"
                frames = [TIMES[variant] * (1 + share)] * 3
                found.append(record(variant, number, frames=frames, **told))
        return found

    return make


@pytest.fixture
def climb(load, rows):
    def make(study="python", **changes):
        told = [{"name": "L", "study": study, "rung": RUNGS}]
        (found,) = ladder.climbs(load(rows(**changes), experiment={"ladder": told, "image": IMAGE}))
        return found

    return make


def test_factors_and_their_product(climb):
    found = climb(noise=(0, 0.5, -0.2, 0.1, 0.3, 0))  # of whole rounds: paired ratios do not see it
    assert [step.factor and step.factor.value for step in found.steps] == [None, pytest.approx(4), pytest.approx(500)]
    assert found.steps[2].factor.low == pytest.approx(500) == found.steps[2].factor.high
    assert (found.product, found.whole.value) == (pytest.approx(2000), pytest.approx(2000))
    assert found.accounted == pytest.approx(1) and [step.lines for step in found.steps] == [100] * 3


def test_a_rung_without_a_time_is_stepped_over(climb):
    found = climb(without=("python",))
    assert isinstance(found.steps[1].factor, Missing) and "it broke" in str(found.steps[1].time)
    assert found.steps[2].factor.value == pytest.approx(2000) == found.product


def test_one_rung_is_no_ladder(climb):
    found = climb(without=("python", "cpp"))
    assert isinstance(found.whole, Missing) and isinstance(found.accounted, Missing)
    assert "unavailable: fewer than two rungs have a time" in ladder_table.account(found)


def test_the_studys_time_by_the_number_of_pixels(climb):
    found = climb()
    assert found.published.value == pytest.approx(14800 * 16 / 512**2)
    assert found.rest == pytest.approx(14800 * 16 / 512**2 / 8)
    assert "This is an estimate" in ladder_table.account(found)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"study": None}, "unavailable: the ladder begins with no program of the study"),
        ({"without": ("study-python",)}, "unavailable: the first rung has no time"),
    ],
)
def test_there_is_no_rest_without_both_times(climb, changes, reason):
    assert str(climb(**changes).rest) == reason


def test_the_section(make_run, report_text, rows, drawn, tmp_path):
    told = [{"name": "L", "study": "python", "rung": RUNGS}]
    text = report_text(rows(), experiment={"ladder": told, "image": IMAGE})
    shown = text.partition("## From the study's code to ours")[2].partition("\n## ")[0]
    assert "4.00 ×, all equal" in shown and "accounts for 100 % of the factor" in shown
    (lines,) = [list(csv.DictReader(file.open())) for file in tmp_path.rglob("ladder.csv")]
    assert [line["rung"] for line in lines] == ["arrays", "ours", "lanes"]
    assert float(lines[2]["factor"]) == pytest.approx(500) and lines[0]["factor"] == "NaN"


def test_a_run_without_ladders_has_no_section(report_text, record):
    assert "From the study's code to ours" not in report_text([record("cpp")])
