"""Medians, ratios, break-even and their spelling against values worked out by hand."""

import pytest

from harness.statistics.statistics import Estimate
from reports.paper import quantity
from reports.run import ranking, study
from reports.run.results import Missing
from reports.times import cpu_figure, startup_table


def test_steady_time_is_the_median_over_processes_of_the_median_of_frames_after_the_first(load, record):
    # per process: 0.1 of three, (0.2 + 0.4) / 2 = 0.3, 0.35, 0.4, 8; the median is 0.35, of 5 the interval is the range
    frames = [(9, 0.1, 7.0, 0.05), (9, 0.2, 0.4), (9, 0.35), (9, 0.4, 0.4), (9, 8.0)]
    (cell,) = load([record("cpp", n, frames=f) for n, f in enumerate(frames)]).cells
    found = cell.median("steady_s", "")
    assert (found.value, found.low, found.high, found.processes) == pytest.approx((0.35, 0.1, 8.0, 5))
    # deviations 0.25, 0.05, 0, 0.05, 7.65: MAD 0.05, of which 14.8 is 0.74
    assert list(cell.good["outlier"]) == [False] * 4 + [True] and cell.outlying == 1


def test_rays_per_second_is_all_rays_over_the_steady_time(load, record):
    (cell,) = load([record("cpp", frames=(9, 0.1, 0.3))]).cells
    assert cell.median("rays_per_s", "").value == pytest.approx(20 / 0.2)


def test_ratio_is_of_medians_and_one_is_not_resolved(load, record):
    fast = [record("cpp", n, frames=(1, t)) for n, t in enumerate((0.10, 0.11, 0.12, 0.11, 0.50))]
    slow = [record("numba", n, frames=(1, t)) for n, t in enumerate((0.20, 0.22, 0.24, 0.22, 0.90))]
    same = [record("numpy", n, frames=(1, t)) for n, t in enumerate((0.10, 0.11, 0.13, 0.105, 0.12))]
    results = load([*fast, *slow, *same])
    cpp, numba, numpy = results.cells
    found = ranking.ratio(numba, cpp)
    assert found.value == pytest.approx(2.0)
    assert ranking.resolved(results, found) and "not resolved" not in quantity.ratio(found, 0.9)
    assert quantity.ratio(found, 1.1).endswith(" not resolved")
    assert "not resolved" in quantity.ratio(ranking.ratio(numpy, cpp), None)
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
    assert cold.median("peak_bytes", "").value == 2e6
    assert warm.median("peak_bytes", "").value == 3.5e6


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
    assert isinstance(cell.median("steady_s", ""), Missing)


def test_a_failure_beside_good_repetitions_is_told(load, record, bad):
    (cell,) = load([record("cpp"), bad("cpp", "timeout", "killed after 9 s", 1)]).cells
    assert cell.verdict == "ok, but 1 of 2 processes not: timeout: killed after 9 s"
    assert cell.median("steady_s", "").processes == 1


@pytest.mark.parametrize(
    ("value", "low", "high", "text"),
    [
        (14803.2, 14680.0, 14930.0, "14800 [14680, 14930]"),
        (0.03651, 0.03599, 0.03701, "0.0365 [0.0360, 0.0370]"),
        (2.1349e-6, 2.08e-6, 2.2e-6, "2.13 [2.08, 2.20]e-6"),
        (149.2, 146.8, 151.6, "149 [147, 152]"),
        (5.0, 5.0, 5.0, "5.00, all equal"),
        (1.0, 0.99, 9.5, "1.000 [0.990, 9.500]"),  # an outlier above does not hide how near the lower end is
        (1.0, 1.0, 1.04, "1.00 [1.00, 1.04]"),
        (0.25, 0.2499999, 0.3, "0.2500 [0.2500, 0.3000]"),
    ],
)
def test_digits_follow_the_interval(value, low, high, text):
    assert quantity.interval(value, low, high) == text


def test_without_an_interval_it_is_said():
    assert quantity.text(Estimate(0.25, None, None, 1)) == "0.250 (no interval, n = 1)"
    assert quantity.ratio(Estimate(2.0, None, None, 1), None) == "2.00 (no interval, n = 1)"


def test_the_study_is_shown_only_for_its_own_case(load, record):
    own = {"width": 512, "height": 512, "region": "0,0,512,512", "depth": 10, "shadows": 0, "precision": "float64"}
    (cell,) = load([record("numba", parameters=own)]).cells
    assert study.show(study.find(study.TIMES_S, cell)) == "149 ± 1"
    assert study.show(study.find(study.RSS_MB, cell)) == "202.1 ± 0.5"
    for change in ({"depth": 9}, {"width": 256}, {"shadows": 1}, {"region": "0,0,512,2"}):
        (cell,) = load([record("numba", parameters=own | change)], name=str(change)).cells
        assert isinstance(study.find(study.TIMES_S, cell), Missing)


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (2.99e-7, "299 ns"), (0.0667, "66.7 ms"), (2.9, "2.90 s"), (0.0009999, "1.00 ms"), (0.00099951, "1.00 ms"),
        (0.000999, "999 µs"), (14800, "14800 s"), (3e-12, "0.00300 ns"), (0, "0 s"), (-0.002, "-2.00 ms"),
        (Estimate(0.0671, 0.0665, 0.0679, 9), "67.1 [66.5, 67.9] ms"),
        (Estimate(0.0671, None, None, 2), "67.1 ms (no interval, n = 2)"),
        (Estimate(0.0671, 0.0671, 0.0671, 9), "67.1 ms, all equal"),
        (Missing("no clock"), "unavailable: no clock"), ("1 (the baseline)", "1 (the baseline)"),
    ],
)  # fmt: skip
def test_seconds_are_in_one_unit_that_suits_them(value, said):
    assert quantity.seconds(value) == said


def test_bytes_ratios_and_shares_are_for_people():
    assert quantity.size(37_600_000) == "37.6 MB" and quantity.size(512) == "512 B" and quantity.size(0) == "0 B"
    assert quantity.times(Estimate(2.06, 1.98, 2.11, 9)) == "2.06 [1.98, 2.11] ×" and quantity.times(43.2) == "43.2 ×"
    assert [quantity.percent(share) for share in (0, 1, 0.00312, 0.5, 0.123, 1e-7, 0.9999)] == [
        "none", "all", "0.31 %", "50 %", "12 %", "1e-05 %", "100 %",
    ]  # fmt: skip
