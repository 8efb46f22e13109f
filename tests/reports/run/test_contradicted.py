"""A variant whose times are contradicted is shown without a rank: it is nobody's denominator and on no front."""

import csv

import pytest
from made_up_errors import FACTS

from reports.accuracy import pareto
from reports.run import ranking

WHY = "its marks contradict its phases: its frames cover 2e-06 s of 0.6 s of phase render"
FALSE = {"unranked": WHY}


@pytest.fixture
def records(cell):
    """Two methods of numpy, and `cpp`, the baseline elsewhere, whose times are false."""
    told = [
        *cell("cpp", [1e-6] * 5, 1e-3, sampler="jittered", samples=2),
        *cell("cpp", [1e-6] * 5, 1e-2, sampler="jittered", samples=1),
    ]
    for record in told:
        record |= FALSE
    for rmse, samples in ((1e-3, 2), (1e-2, 1)):
        told += cell("numpy", [0.1 * samples] * 5, rmse, sampler="jittered", samples=samples)
    return told


def test_nowhere_is_it_first(load, records):
    loaded = load(records, **FACTS)
    for place in loaded.places:
        assert [cell.variant for cell in ranking.ranked(loaded, place)] == ["numpy"]
    assert ranking.baseline(loaded, loaded.scenes[0]) == "numpy"
    (chart,) = pareto.charts(loaded)
    assert {point.cell.variant for point in chart.points} == {"numpy"} and chart.front
    assert {(cell.variant, why) for cell, why in chart.lacking} == {("cpp", f"{WHY} (in 5 of 5 processes)")}
    best, _ = chart.cheapest(loaded, 1.0)
    assert best.cell.variant == "numpy"


def test_the_report_says_why(report_text, records, tmp_path):
    text = report_text(records, **FACTS)
    summary = text.partition("## Summary")[2].partition("\n## ")[0]
    assert "only numpy is ranked" in summary and "**cpp**" not in summary
    assert f"cpp: {WHY} (in 5 of 5 processes) (everywhere)" in summary.partition("Not ranked:")[2]
    assert "in no comparison" not in summary
    assert "1e-06 s a frame" not in text and "1.0 µs" not in text
    with open(tmp_path / "report" / "times-0-mirrors.csv", encoding="utf-8", newline="") as lines:
        told = {(line["variant"], line["quantity"]): line for line in csv.DictReader(lines)}
    assert told["numpy", "steady_frame"]["value"] != "NaN"
    assert told["cpp", "steady_frame"]["value"] == "NaN" and WHY in told["cpp", "steady_frame"]["note"]
