"""Means, ratios, break-even and their spelling against values worked out by hand."""

import math

import pytest

from harness.statistics import Estimate
from reports import cpu_figure, quantity, ranking, startup_table, study
from reports.results import Missing


def test_steady_time_is_the_mean_over_processes_of_the_mean_of_frames_after_the_first(load, record):
    # per process: (0.1 + 0.3) / 2 = 0.2, (0.2 + 0.4) / 2 = 0.3, 0.4; the mean is 0.3
    frames = [(9, 0.1, 0.3), (9, 0.2, 0.4), (9, 0.4, 0.4)]
    (cell,) = load([record("cpp", n, frames=f) for n, f in enumerate(frames)]).cells
    found = cell.mean("steady_s", "")
    assert found.value == pytest.approx(0.3)
    # Student: t(0.975, 2) = 4.3027, s = 0.1, half-width 4.3027 * 0.1 / sqrt(3)
    assert found.high - found.value == pytest.approx(4.3027 * 0.1 / math.sqrt(3), rel=1e-4)
    assert found.processes == 3


def test_rays_per_second_is_all_rays_over_the_steady_time(load, record):
    (cell,) = load([record("cpp", frames=(9, 0.1, 0.3))]).cells
    assert cell.mean("rays_per_s", "").value == pytest.approx(20 / 0.2)


def test_ratio_is_of_means_and_one_is_not_resolved(load, record):
    fast = [record("cpp", n, frames=(1, t)) for n, t in enumerate((0.10, 0.11, 0.12))]
    slow = [record("numba", n, frames=(1, t)) for n, t in enumerate((0.20, 0.22, 0.24))]
    same = [record("numpy", n, frames=(1, t)) for n, t in enumerate((0.10, 0.11, 0.13))]
    results = load([*fast, *slow, *same])
    cpp, numba, numpy = results.cells
    found = ranking.ratio(numba, cpp)
    assert found.value == pytest.approx(2.0)
    assert quantity.resolved(found) and "not resolved" not in quantity.ratio(found)
    assert "not resolved" in quantity.ratio(ranking.ratio(numpy, cpp))
    assert ranking.ratio_to(results, cpp, "cpp") == "1 (the baseline)"


@pytest.mark.parametrize(
    ("arguments", "span"),
    [
        ((10.0, 0.1, 1.0, 1.0), (12, None)),  # 10 + 0.1 k < 1 + k from k = 10.0 on, exclusively: k = 11, frame 12
        ((2.5, 0.5, 1.0, 1.0), (5, None)),  # equal at k = 3, frame 4
        ((1.0, 0.1, 2.0, 1.0), (1, None)),
        ((1.0, 1.0, 1.0, 0.5), None),
        ((5.0, 1.0, 1.0, 1.0), None),
        ((1.0, 1.0, 3.0, 0.5), (1, 4)),  # 1 + k < 3 + k / 2 up to k = 3: frame 4
    ],
)
def test_break_even(arguments, span):
    assert startup_table.lead(*arguments) == span
    first, last = span or (None, None)
    start, steady, other, other_steady = arguments
    for n in range(1, 20):
        leads = start + (n - 1) * steady < other + (n - 1) * other_steady - 1e-9
        assert leads == (first is not None and first <= n <= (last or n))


def test_break_even_counts_cold_and_warm_apart(load, record):
    jit = [
        record("numba", 0, frames=(1.0, 0.5), compile_s=7.25, cache="cold"),
        record("numba", 1, frames=(1.0, 0.5), compile_s=0.25, cache="warm"),
    ]
    results = load([record("python", frames=(2.0, 2.0)), *jit])
    numba = results.cells[1]
    # cold: 8.25 + 0.5 k < 2 + 2 k from k = 5 (6.25 / 1.5 = 4.2), frame 6; warm: 1.25 + 0.5 k is less at once
    assert startup_table.break_even(results, numba, warm=False).value == 6
    assert startup_table.break_even(results, numba, warm=True).value == 1
    assert startup_table.compile_s(numba, warm=False).value == pytest.approx(7.25)


def test_a_build_counts_when_nothing_is_warm(load, record):
    built = record("cpp", frames=(1.0, 0.5), build={"seconds": 6.25, "compiler": "c", "command": ["c"]})
    results = load([record("python", frames=(2.0, 2.0)), built])
    # 7.25 + 0.5 k < 2 + 2 k from k = 4 (5.25 / 1.5 = 3.5), frame 5
    assert startup_table.break_even(results, results.cells[1], warm=False).value == 5


def test_memory_of_cold_and_warm_processes_is_kept_apart(load, record):
    (cell,) = load([record("numba", n, compile_s=1, cache=c) for n, c in enumerate(("cold", "warm", "warm"))]).cells
    cold, warm = cell.by_cache()
    assert (cold.label, warm.label) == ("numba (cold cache)", "numba (warm cache)")
    assert cold.mean("peak_bytes", "").value == 2e6
    assert warm.mean("peak_bytes", "").value == 3.5e6


def test_cpu_use_is_the_time_used_between_samples(tmp_path):
    series = tmp_path / "series.csv"
    series.write_text("t,cpu_s,rss_bytes\n0.0,0.0,1\n0.5,0.5,1\n1.0,1.5,1\n1.1,1.5,1\n")
    t, percent = cpu_figure.rates(series)
    assert list(t) == [0.0, 0.5, 1.0, 1.1] and percent == pytest.approx([100, 200, 0])
    t, percent = cpu_figure.rates(series, apart=1.0)
    assert list(t) == [0.0, 1.0] and percent == pytest.approx([150])
    series.write_text("t,cpu_s,rss_bytes\n")  # it ended before the first sample
    t, percent = cpu_figure.rates(series)
    assert len(t) == len(percent) == 0


def test_a_wrong_picture_in_one_repetition_spoils_the_cell(load, record):
    (cell,) = load([record("cpp"), record("cpp", 1, status="wrong picture", reason="off")]).cells
    assert cell.status == "wrong picture" and cell.unranked == "wrong picture: off"
    assert isinstance(cell.mean("steady_s", ""), Missing)


def test_a_failure_beside_good_repetitions_is_told(load, record, bad):
    (cell,) = load([record("cpp"), bad("cpp", "timeout", "killed after 9 s", 1)]).cells
    assert cell.verdict == "ok, but 1 of 2 repetitions not: timeout: killed after 9 s"
    assert cell.mean("steady_s", "").processes == 1


@pytest.mark.parametrize(
    ("value", "half", "text"),
    [
        (14803.2, 123.0, "14800 ± 120"),
        (0.03651, 0.00052, "0.0365 ± 0.0005"),
        (2.1349e-6, 5.2e-8, "(2.13 ± 0.05)e-6"),
        (149.2, 2.4, "149 ± 2"),
        (5.0, 0.0, "5.00 ± 0, all equal"),
        (0.007, 0.03, "0.01 ± 0.03"),
    ],
)
def test_digits_follow_the_interval(value, half, text):
    assert quantity.plus_minus(value, half) == text


def test_without_an_interval_it_is_said():
    assert quantity.text(Estimate(0.25, None, None, 1)) == "0.250 (no interval, n = 1)"
    assert not quantity.resolved(Estimate(2.0, None, None, 1))


def test_the_study_is_shown_only_for_its_own_case(load, record):
    own = {"width": 512, "height": 512, "region": "0,0,512,512", "depth": 10, "shadows": 0, "precision": "float64"}
    (cell,) = load([record("numba", parameters=own)]).cells
    assert study.show(study.find(study.TIMES_S, cell)) == "149 ± 1"
    assert study.show(study.find(study.RSS_MB, cell)) == "202.1 ± 0.5"
    for change in ({"depth": 9}, {"width": 256}, {"shadows": 1}, {"region": "0,0,512,2"}):
        (cell,) = load([record("numba", parameters=own | change)], name=str(change)).cells
        assert isinstance(study.find(study.TIMES_S, cell), Missing)
