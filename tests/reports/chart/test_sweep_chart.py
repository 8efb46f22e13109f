"""The data of the interactive chart of sweeps: what the figure has, and no more than a page can hold."""

import pytest

from reports.chart import sweep_chart
from reports.chart.embedded import Embedded
from reports.scaling import sweep


@pytest.fixture
def swept(cell):
    """A function that gives five processes of a variant for depths, with times by depth."""

    def make(variant, times, **parameters):
        told = []
        for depth, seconds in times.items():
            told += cell(variant, [seconds * (1 + 0.01 * n) for n in range(5)], 0.01, False, depth=depth, **parameters)
        return told

    return make


def test_every_line_has_every_quantity(load, swept):
    loaded = load(swept("cpp", {1: 0.1, 2: 0.2, 4: 0.4}) + swept("numba", {1: 0.25, 2: 0.25, 4: 0.25}))
    found = sweep_chart.data(loaded, Embedded(0))
    assert [one["title"] for one in found["quantities"]] == [
        "steady frame (ms)", "error (RMSE, linear RGB)", "peak memory (MB)", "number of rays of a frame",
    ]  # fmt: skip
    (panel,) = found["panels"]
    assert (panel["label"], panel["log"], panel["ticks"]) == ("depth", True, [[1, "1"], [2, "2"], [4, "4"]])
    cpp, _ = panel["lines"]
    time, error, memory, rays = cpp["points"]
    assert time == [[depth, *(pytest.approx(0.1 * depth * share) for share in (1.02, 1, 1.04))] for depth in (1, 2, 4)]
    assert error == [[depth, 0.01, None, None] for depth in (1, 2, 4)]
    assert rays == [[depth, 20, 20, 20] for depth in (1, 2, 4)] and len(memory) == 3
    ((x, y, words),), *others = panel["crossings"]
    assert 2 < x < 4 and y == pytest.approx(0.255, rel=1e-3) and words.startswith("numba overtakes cpp")
    assert others == [[], [], []] and found["colours"].keys() == {"cpp", "numba"} and found["says"] == ""


def test_nothing_where_nothing_varies(load, record):
    assert sweep_chart.data(load([record("cpp"), record("numba")]), Embedded(0)) == {}


def test_of_many_points_the_largest_panels_are_kept(load, swept, monkeypatch):
    monkeypatch.setattr(sweep_chart, "MOST", 7)
    rows = swept("cpp", {1: 1.0, 2: 1.0}, samples=1) + swept("cpp", {1: 1.0, 2: 1.0, 4: 1.0}, samples=2)
    loaded = load(rows)
    assert len(sweep.panels(loaded)) == 4
    found = sweep_chart.data(loaded, Embedded(0))
    assert [panel["label"] for panel in found["panels"]] == ["depth: samples 1", "depth: samples 2", "samples: depth 1"]
    assert found["says"].startswith("Shown are 3 of 4 charts")
