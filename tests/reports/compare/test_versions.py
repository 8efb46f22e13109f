"""Two versions of a renderer in one run: the verdict on each cell, and on all; ratios that can be checked by hand."""

import numpy as np
import pytest

from harness.statistics import statistics
from reports.compare import gate, versions
from reports.page import report
from reports.run import results

PICTURE = {"file": "pictures/cpp.npy"}
AGAINST = [{"variant": "cpp", "other": "cpp@old"}]


@pytest.fixture
def held(record, make_run, tmp_path):
    """The comparison of a run in which cpp takes `above[n]` s a frame in round n, and cpp@old `below[n]`."""

    def make(above, below, against=AGAINST, **changes):
        rows = [record("cpp", n, (9.0, time, time), **changes) for n, time in enumerate(above)]
        rows += [record("cpp@old", n, (9.0, time, time), series=None, picture=PICTURE) for n, time in enumerate(below)]
        return results.load(make_run(rows, against=against))

    return make


def rounds(seed, count, share=0.2):
    """The times of rounds of very different length, s."""
    return np.exp(np.random.default_rng(seed).normal(0, share, count))


def test_what_a_round_has_in_common_cancels(held):
    times = rounds(1, 9)
    (found,) = versions.comparisons(held(np.linspace(1.04, 1.06, 9) * times, times))
    assert (found.name, found.other) == ("cpp, comparison", "cpp@old")
    assert found.ratio.value == pytest.approx(1.05) and found.ratio.low == pytest.approx(1.0425)
    assert found.verdict == "slower"
    verdicts = [gate.of_versions([found], percent).verdict for percent in (4.2, 4.3, 5.7, 5.8)]
    assert verdicts == [gate.FAIL, gate.UNKNOWN, gate.UNKNOWN, gate.PASS]
    assert versions.verdict([found]) == "cpp, comparison: slower: 1.050 [1.042, 1.058] × the time of cpp@old"
    (found,) = versions.comparisons(held(times, 1.05 * times))
    assert found.verdict == "faster" and gate.of_versions([found], 0).verdict == gate.PASS


def test_two_equal_versions_are_seldom_told_apart():
    """At most 5 of 100 runs have a false verdict, on one cell and on eight, though no noise floor helps."""
    seed = 20
    rng, wrong = np.random.default_rng(seed), {}
    for cells, runs in ((1, 4000), (8, 1000)):
        level = 1 - (1 - statistics.LEVEL) / cells
        times = np.exp(rng.normal(0, 0.05, (2, runs, cells, 20)))
        ratios = [[statistics.ratio(*pair, paired=True, level=level) for pair in zip(*run, strict=True)]
                  for run in zip(*times, strict=True)]  # fmt: skip
        verdicts = [{statistics.verdict(ratio, None) for ratio in run} for run in ratios]
        wrong[cells] = np.mean([seen != {statistics.NOT_RESOLVED} for seen in verdicts])
    assert all(share <= 0.05 for share in wrong.values()), (seed, wrong)


def test_more_cells_take_more_processes(held):
    assert statistics.processes_for(statistics.LEVEL) == statistics.LEAST
    assert [statistics.processes_for(1 - 0.05 / cells) for cells in (2, 10)] == [7, 9]
    assert statistics.median([1.0] * 6, 0.975).note == "no interval from 6 processes, it takes 7"
    (found,) = versions.comparisons(held([1.0] * 4, [1.0] * 4))
    assert found.verdict == versions.INCOMPARABLE and "no interval from 4 processes" in found.text
    assert gate.of_versions([found], 5).verdict == gate.UNKNOWN


def test_a_version_that_fails_is_no_verdict_and_no_pass(held):
    (found,) = versions.comparisons(held([1.0] * 6, [1.0] * 6, status="wrong picture", reason="it is off"))
    assert found.broken and found.verdict == versions.INCOMPARABLE
    assert gate.details([gate.of_versions([found], 5)]) == [f"no longer ok: {found.text}"]
    assert gate.of_versions([found], 5).verdict == gate.FAIL


def test_the_section(held, tmp_path):
    times = rounds(2, 9)
    loaded = held(np.linspace(1.19, 1.21, 9) * times, times)
    assert "## This version against another" in dict(report.write_loaded(loaded, tmp_path))["versions"]
    text = versions.write(loaded).replace("\\", "")
    assert "| cpp, comparison | cpp@old | 1.200 [1.192, 1.208] | slower |" in text
    assert versions.write(held(times, times, against=[])) == ""
