"""Speed-up: times that follow Amdahl's and Gustafson's laws give their shares back, and what has no data says so."""

import csv

import numpy as np
import pytest
import stored_run

from reports.run.cell import Missing
from reports.scaling import speedup
from reports.scaling.speedup import AMDAHL, GUSTAFSON

COUNTS = (1, 2, 4, 8)


@pytest.fixture
def threaded(record):
    """A function that gives processes of a variant with numbers of threads and sides, which take seconds(n, side)."""

    def make(variant, points, seconds, noise=0.0, processes=6, seed=3, **changes):
        rng, rows = np.random.default_rng(seed), []
        for count, side in points:
            name = f"{variant}-{count}-{side}"
            size = {"width": side, "height": side, "region": f"0,0,{side},{side}", "threads": count}
            for number in range(processes):
                more = {
                    "cell": name, "point": {"threads": count, "side": side}, "series": None,
                    "picture": {"file": f"pictures/{name}.npy"},
                    "parameters": record(variant)["parameters"] | size, **changes,
                }  # fmt: skip
                time = seconds(count, side) * (1 + noise * rng.normal())
                rows.append(record(variant, number, frames=[time] * 3, **more))
        return rows

    return make


@pytest.fixture
def cores():
    """Facts of a machine with so many usable cores."""
    return lambda usable: {"environment": stored_run.ENVIRONMENT | {"cores": {"usable": usable, "logical": 8}}}


def strong(counts=COUNTS):
    return [(count, 64) for count in counts]


def weak(counts=COUNTS):
    """As many pixels a thread, to whole sides."""
    return [(count, round(64 * count**0.5)) for count in counts]


def test_amdahl_gives_its_share_back(load, threaded, cores):
    rows = threaded("cpp-threads", strong(), lambda n, _: 0.4 / speedup.amdahl(0.93, n))
    (line,) = speedup.lines_of(load(rows, **cores(8)))
    assert line.law is AMDAHL and line.share.value == pytest.approx(0.93, abs=1e-9)
    assert (line.share.low, line.share.high) == pytest.approx((0.93, 0.93), abs=1e-9)
    assert [gain.value for gain in line.gains] == pytest.approx([1 / (0.07 + 0.93 / n) for n in COUNTS])
    assert line.off == pytest.approx(0, abs=1e-9) and line.fitted == 4


@pytest.mark.parametrize("seed", range(4))
def test_the_interval_holds_the_share_though_times_are_noisy(load, threaded, cores, seed):
    rows = threaded("cpp-threads", strong(), lambda n, _: 0.4 / speedup.amdahl(0.93, n), noise=0.02, seed=seed)
    (line,) = speedup.lines_of(load(rows, **cores(8)))
    assert line.share.low < 0.93 < line.share.high and 0 < line.share.high - line.share.low < 0.06
    assert line.share.low < line.share.value < line.share.high


def test_gustafson_gives_its_share_back_where_the_work_grows(load, threaded, cores):
    """Whole sides make the work of a thread differ by up to 1 %, which the times here follow."""
    seconds = lambda n, side: side**2 / 64**2 / speedup.gustafson(0.1, n)  # noqa: E731
    (line,) = speedup.lines_of(load(threaded("cpp-threads", weak(), seconds), **cores(8)))
    assert line.law is GUSTAFSON and line.share.value == pytest.approx(0.1, abs=1e-9)
    assert [gain.value for gain in line.gains] == pytest.approx([n - 0.1 * (n - 1) for n in COUNTS])
    assert line.label == "cpp-threads, 4096 pixels a thread"


def test_every_pair_of_threads_and_sides_has_both_laws(load, threaded, cores):
    points = [(count, side) for count in (1, 4) for side in (64, 128)]
    lines = speedup.lines_of(load(threaded("cpp-threads", points, lambda n, side: side**2 / n), **cores(4)))
    told = [(line.law.title, line.label, [cell.pixels for cell in line.cells]) for line in lines]
    assert told == [
        ("Amdahl", "cpp-threads, side = 64", [64**2] * 2), ("Amdahl", "cpp-threads, side = 128", [128**2] * 2),
        ("Gustafson", "cpp-threads, 4096 pixels a thread", [64**2, 128**2]),
    ]  # fmt: skip
    assert [line.share.value for line in lines] == pytest.approx([1, 1, 0])


def test_more_threads_than_cores_are_shown_and_not_fitted(load, threaded, cores):
    def seconds(n, _):
        return 0.4 / speedup.amdahl(0.9, min(n, 2))

    (line,) = speedup.lines_of(load(threaded("cpp-threads", strong(), seconds), **cores(2)))
    assert (line.fitted, len(line.gains)) == (2, 4) and line.share.value == pytest.approx(0.9)
    (line,) = speedup.lines_of(load(threaded("cpp-threads", strong(), seconds), **cores(1), name="one"))
    assert line.share == Missing("no more than one thread within the 1 usable cores")


def test_a_machine_that_does_not_say_its_cores_has_all_fitted(load, threaded, cores):
    (line,) = speedup.lines_of(load(threaded("a", strong(), lambda n, _: 1 / n), **cores("unavailable: none")))
    assert line.fitted == 4


def test_few_processes_have_no_interval(load, threaded, cores):
    rows = threaded("cpp-threads", strong(), lambda n, _: 0.4 / speedup.amdahl(0.5, n), processes=4)
    (line,) = speedup.lines_of(load(rows, **cores(8)))
    assert line.share.low is None and line.share.value == pytest.approx(0.5) and "no interval" in line.share.note


def test_threads_that_slow_it_down_have_a_share_of_0(load, threaded, cores):
    (line,) = speedup.lines_of(load(threaded("cpp-threads", strong(), lambda n, _: float(n)), **cores(8)))
    assert line.share.value == 0 and line.off > 1


def test_what_is_absent_says_why(load, threaded, cores, tmp_path, drawn):
    text = speedup.write(load(threaded("a", strong(), lambda n, _: 1 / n), name="strong", **cores(8)), tmp_path)
    assert "Gustafson's law (weak scaling): unavailable: the work does not grow" in text and "Amdahl's law" in text
    assert "Amdahl's law (strong scaling): unavailable" not in text and "no limit" in text
    text = speedup.write(load(threaded("a", weak(), lambda n, _: 1.0), name="weak", **cores(8)), tmp_path)
    assert "Amdahl's law (strong scaling): unavailable: no picture was made with two numbers" in text
    assert "Gustafson's law (weak" not in text
    drawn.clear()
    refused = {"status": "unsupported", "reason": "runs one thread", "frames_s": None}
    rows = threaded("cpp", strong((1,)), lambda *_: 1.0) + threaded("cpp", strong((2,)), lambda *_: 1.0, **refused)
    text = speedup.write(load(rows, name="none", **cores(8)), tmp_path)
    assert "- cpp (2 threads): unsupported: runs one thread" in text and text.count("law (") == 2 and not drawn


def test_no_section_where_threads_do_not_vary(load, threaded, tmp_path):
    assert speedup.write(load(threaded("a", [(2, 64), (2, 128)], lambda n, side: side)), tmp_path) == ""
    assert not list(tmp_path.glob("speedup*"))


def test_the_figure_has_the_numbers_of_the_csv(load, threaded, cores, tmp_path, drawn):
    rows = threaded("cpp-threads", strong(), lambda n, _: 0.4 / speedup.amdahl(0.93, n), noise=0.01)
    text = speedup.write(load(rows, **cores(4)), tmp_path)
    with open(tmp_path / "speedup.csv", newline="") as file:
        told = list(csv.DictReader(file))
    assert [int(row["threads"]) for row in told] == list(COUNTS)
    assert [row["fitted"] for row in told] == ["True", "True", "True", "False"]
    left, right = drawn["speedup"].axes
    for axes, column, scale in ((left, "speed_up", 1), (right, "efficiency", 100)):
        points = [line.get_xydata()[0] for line in axes.lines if line.get_marker() == "o"]
        expected = [(int(row["threads"]), scale * float(row[column])) for row in told]
        np.testing.assert_allclose(points, expected)
    hollow = [line.get_markerfacecolor() for line in left.lines if line.get_marker() == "o"]
    assert hollow[3] == "white" and "white" not in hollow[:3]
    (law,) = [line.get_xydata() for line in left.lines if len(line.get_xdata()) == 100]
    with open(tmp_path / "speedup-laws.csv", newline="") as file:
        (share,) = [float(row["value"]) for row in csv.DictReader(file)]
    np.testing.assert_allclose(law[:, 1], 1 / (1 - share + share / law[:, 0]))
    assert f"p = {share:.2f}" in text and "×" in text
