"""The report of a run under stress: break points, what was survived, intervals, and what has no answer."""

import csv
import itertools

import matplotlib.pyplot as plt
import pytest
import report_tables

from reports.page import report
from reports.paper import style
from reports.run import results
from reports.run.cell import Missing
from reports.stability import cost, overview, stability, summary
from reports.stability import figure as stability_figure
from reports.stability import window as stability_window

FACTS = {
    "code": "S1", "title": "A sphere far away", "stress": "distance / radius", "failure": "wrong rays",
    "error": "error of t", "logarithmic": True, "method": "sphere", "aligned": "", "source": "a book",
}  # fmt: skip
LEVELS = (10.0, 100.0, 1e3, 1e5)
VERSIONS = {"compiler": "g++ 1", "flags": "-O3"}


@pytest.fixture
def curve(record, bad):
    """A function that gives the records of one curve: failures of 1000 a level, or a text, why there is no answer."""

    def make(failures, variant="cpp", precision="float64", row="far", levels=LEVELS, seconds=0.25, **swept):
        told = []
        for level, failed in zip(levels, failures, strict=True):
            point = {"stress": row, "level": level, "precision": precision, **swept}
            who = {
                "cell": "-".join(map(str, (variant, *point.values()))), "point": point, "scene": f"stress/{row}.txt",
                "parameters": record("")["parameters"] | {"precision": precision, "sphere": "robust"} | swept,
                "unranked": "exhibit: put under stress",
            }  # fmt: skip
            if isinstance(failed, str):
                status, _, why = failed.partition(": ")
                told.append(bad(variant, status, why, stability=None, **who))
                continue
            found = {
                "row": row, "level": level, "count": 1000, "failures": failed, "error_median": level / 1e9,
                "error_p99": level / 1e8, "error_max": level / 1e7, "expected": level / 2e9, "limit": 1e4,
            }  # fmt: skip
            told.append(record(variant, stability=found, picture=None, agreement=None, series=None, versions=VERSIONS,
                               frames=(1, *[seconds] * 4), **who))  # fmt: skip
        return told

    return make


@pytest.fixture
def load(make_run):
    """A function that loads a run of the given records, each time another."""
    numbers = itertools.count()
    return lambda told, **facts: results.load(make_run(told, name=f"run{next(numbers)}", **facts))


@pytest.fixture
def rows(load):
    """A function that gives the rows of a run of these records."""
    return lambda told, **facts: stability.rows(load(told, stability={"far": FACTS | facts}))


def test_a_curve_breaks_at_its_first_failure(rows, curve):
    (row,) = rows(curve((0, 0, 3, 5), sphere="robust"))
    (found,) = row.curves
    told = row.survival(found)
    assert found.broken.level == 1e3 and found.broken.share == 0.003 and found.limit == 1e4
    assert (told.value, told.of, told.mark, told.whole) == (pytest.approx(1), pytest.approx(4), "1", False)
    assert told.share == pytest.approx(1 / 4)


@pytest.mark.parametrize(
    ("failures", "mark", "share"),
    [
        ((0, 0, 0, 0), "all", 1),
        ((1, 0, 0, 0), "×", 0),
        ((0, 1, 0, 0), "0", 0),
        ((0, 0, 0, 9), "2", 0.5),
        ((0, 0, 0, "failed: it broke"), "≥2", 0.5),
        (("timeout: it hung", 0, 0, 0), "≥3", 0.75),
        (("timeout: it hung", 4, 0, 0), "<1", 0),
    ],
)
def test_decades_survived(rows, curve, failures, mark, share):
    (row,) = rows(curve(failures))
    told = row.survival(row.curves[0])
    assert told.mark == mark and told.share == pytest.approx(share)


def test_a_stress_can_fall_and_need_not_be_of_decades(rows, curve):
    (falling,) = rows(curve((0, 0, 1, 1), levels=(0.1, 1e-2, 1e-4, 1e-6)))
    assert falling.levels == [0.1, 1e-2, 1e-4, 1e-6] and falling.survival(falling.curves[0]).mark == "1"
    (even,) = rows(curve((0, 0, 1, 1), levels=(1.0, 2.0, 3.0, 4.0)), logarithmic=False)
    assert even.survival(even.curves[0]).mark == "2/4"


def test_what_has_no_answer_has_a_reason_and_is_no_failure(rows, curve):
    why = "unsupported: has no precision float32"
    (row,) = rows(curve((0, 0, 0, 0)) + curve((why,) * 4, precision="float32"))
    lacking = row.curves[1]
    assert isinstance(row.survival(lacking), Missing) and lacking.broken is None and not lacking.answered
    assert lacking.missing == {f"unavailable: {why}": lacking.points}
    assert row.survival(row.curves[0]).whole


def test_of_repetitions_the_worst_counts(rows, curve):
    again = [told | {"repetition": 1} for told in curve((0, 7, 0, 0))]
    (row,) = rows(curve((0, 0, 0, 0)) + again)
    assert row.curves[0].broken.level == 100 and row.curves[0].broken.answers["failures"] == 7


def test_ways_are_told_apart_and_naive_ones_known(rows, curve):
    told = curve((0,) * 4, sphere="textbook", floating_point="strict")
    told += curve((0,) * 4, sphere="robust", floating_point="contract")
    told += curve((0,) * 4, sphere="robust", floating_point="strict")
    (row,) = rows(told)
    assert [(way.name, way.naive) for way in row.ways] == [
        ("robust", False), ("textbook", True), ("robust, contract", True),
    ]  # fmt: skip
    (fixed,) = rows(curve((0,) * 4, offset="fixed", epsilon=1e-4), method="")
    assert [(way.name, way.naive) for way in fixed.ways] == [("offset fixed", True)]
    (other,) = rows(curve((0,) * 4, floating_point="strict", fresnel="unclamped"), method="floating_point")
    assert [(way.name, way.naive) for way in other.ways] == [("strict", False)]


def test_an_aligned_row_stands_after_its_row(load, curve):
    told = [record for name in ("far", "other", "far-aligned") for record in curve((0,) * 4, row=name)]
    facts = {"far": FACTS, "other": FACTS, "far-aligned": FACTS | {"aligned": "far"}}
    assert [row.name for row in stability.rows(load(told, stability=facts))] == ["far", "far-aligned", "other"]


def test_intervals_by_hand():
    assert stability.interval(0, 1000) == (0, 0.003) and stability.interval(1000, 1000) == (0.997, 1)
    low, high = stability.interval(
        5, 50
    )  # Wilson, by hand: (0.1 + z²/100 ± z √(0.1 * 0.9 / 50 + z²/10000)) / 1 + z²/50
    assert low == pytest.approx(0.0435, abs=1e-4) and high == pytest.approx(0.2136, abs=1e-4)
    assert stability.interval(0, 2) == stability.interval(0, 0) == (0, 1)


def test_costs_are_ratios_to_the_default_way(load, curve):
    told = curve((0,) * 4, sphere="robust") + curve((0, 0, 1, 1), sphere="textbook", seconds=0.125)
    loaded = load(told, stability={"far": FACTS})
    base, quick = cost.costs(loaded, stability.rows(loaded)[0])
    assert (base.ratio, quick.ratio, quick.spread, len(quick.ratios)) == (1, 0.5, (0.5, 0.5), 4)
    assert quick.frames == 16 and quick.against.name == "robust"
    alone = load(curve((0,) * 4, sphere="textbook"), stability={"far": FACTS})
    assert cost.costs(alone, stability.rows(alone)[0]) == []


def _window(load, curve, acne, leak):
    """The window of a run where these failures are along offsets from 0.1 to 1e-6, and from 1e-6 to 0.1."""
    rising = (1e-6, 1e-4, 1e-2, 1e-1)
    told = curve(acne, row="acne-epsilon", levels=rising[::-1]) + curve(leak, row="leak-epsilon", levels=rising)
    facts = dict.fromkeys(("acne-epsilon", "leak-epsilon"), FACTS | {"method": ""})
    ((window,),) = stability_window.windows(stability.rows(load(told, stability=facts))).values()
    return window.text


def test_the_window_between_acne_and_leaks(load, curve):
    assert _window(load, curve, (0, 0, 0, 5), (0, 0, 0, 5)) == "0.0001 to 0.01, 2 decades"
    assert _window(load, curve, (0, 0, 0, 0), (0, 0, 0, 5)) == "1e-6 to 0.01, at least 4 decades"
    assert _window(load, curve, (0, 5, 5, 5), (0, 5, 5, 5)) == "every offset that was run has acne or leaks"
    assert _window(load, curve, ("failed: no",) * 4, (0, 0, 0, 5)) == "unavailable: failed: no"


def test_the_report_says_who_broke_and_what_did_not_run(report_text, curve):
    told = curve((0, 0, 0, 2), sphere="robust") + curve((0, 4, 900, 900), sphere="textbook")
    told += curve(("failed: no memory",) * 4, variant="numba", sphere="robust")
    text = report_text(told, stability={"far": FACTS})
    assert "float64: textbook first, at 100; without a failure to the end: nothing" in text
    assert "S1 far, robust, float64: from 1e5 on in cpp (theory: 1e4)" in text
    assert "numba: unavailable: failed: no memory (4 cells: far)" in text
    table = next(table for table in report_tables.tables(text) if "theory" in table[0])
    naive = next(row for row in table if row["method"] == "textbook (naive)")
    assert list(naive.values()).count("1e4") == 1 and naive["theory"] == "1e4"
    assert (naive["cpp"], naive["numba"]) == ("100 (0.40 %; 1 % from 1e3 on)", "not run")
    robust = next(row for row in table if row["method"] == "robust")
    assert (robust["cpp"], robust["numba"]) == ("1e5 (0.20 %; never 1 %)", "unavailable: failed: no memory")
    assert "Of 1 kind of failure, naive methods give wrong answers in 1 of 1 and robust methods in 1 of 1." in text
    assert "## Machine" in text and "## Provenance" in text and "Every renderer is ranked" not in text
    assert "| S1 far | float64 | textbook / robust | cpp 1 [1, 1] |".replace("[", r"\[").replace("]", r"\]") in text


def test_what_was_not_run_to_the_end_did_not_hold_to_the_end(load, curve):
    cut = "timeout: it hung"
    text = summary.write(load(curve((0, 0, 0, cut), sphere="robust"), stability={"far": FACTS}))
    assert "float64: nothing breaks at the levels that have an answer." in text
    told = curve((0, 0, 0, cut), sphere="robust") + curve((0, 1, 0, 0), sphere="textbook")
    text = summary.write(load(told, stability={"far": FACTS}))
    assert "without a failure to the end: nothing; without a failure as far as they have answers: robust." in text


def test_an_ordinary_run_has_no_part_of_this(report_text, record):
    text = report_text([record("cpp")], stability={})
    assert "Every renderer is ranked" in text and overview.TITLE not in text


def test_a_run_without_an_answer_is_told(report_text, curve):
    text = report_text(curve(("unsupported: no",) * 4), stability={"far": FACTS})
    assert "no answer" in text and "cpp: unavailable: unsupported: no (4 cells: far)" in text


@pytest.mark.parametrize("code", ["S1", "S21", "S24"])
def test_every_figure_names_versions_flags_and_seed(load, curve, code):
    loaded = load(curve((0, 0, 4, 4), sphere="robust"), stability={"far": FACTS | {"code": code}})
    (row,) = stability.rows(loaded)
    own = stability_figure.OWN.get(code, stability_figure)
    with style.styled():
        figure = own.draw(loaded, row)
    assert any(text.get_text() == "Seed 1. cpp v (g++ 1, -O3)." for text in figure.texts)
    plt.close(figure)


def test_files_are_the_same_twice_and_hold_no_blank(make_run, tmp_path, curve):
    told = []
    for name in ("far", "table", "threads", "acne-epsilon", "leak-epsilon"):
        told += curve((0, 0, 5, 9), row=name, sphere="robust") + curve((0, 7, 5, 9), row=name, sphere="textbook")
        told += curve(("unsupported: no float32",) * 4, row=name, precision="float32", sphere="robust")
    codes = {"far": "S1", "table": "S21", "threads": "S24", "acne-epsilon": "S7", "leak-epsilon": "S8"}
    run = make_run(told, stability={name: FACTS | {"code": code} for name, code in codes.items()})
    for name in ("a", "b"):
        report.write(run, tmp_path / name)
    names = sorted(path.name for path in (tmp_path / "a").iterdir())
    drawn = {name.removesuffix(".png") for name in names if name.endswith(".png")}
    parts = {f"stability-{name}" for name in (*codes, "overview", "overview-naive", "window", "cost")}
    assert drawn == parts and "stability.csv" in names
    for name in names:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name
    with open(tmp_path / "a" / "stability.csv", newline="") as file:
        lines = list(csv.DictReader(file))
    assert len(lines) == 5 * 3 * 4 and all("" not in line.values() for line in lines)
    broken = [line for line in lines if line["breaks_here"] == "True"]
    assert [(line["way"], line["level"]) for line in broken[:2]] == [("robust", "1000.0"), ("textbook", "100.0")]
    assert {line["share"] for line in lines if line["status"] == "unsupported"} == {"NaN"}


def test_words_of_others_are_escaped(load, curve):
    loaded = load(curve(("failed: <b>|no",) * 4), stability={"far": FACTS | {"stress": "a|b"}})
    text = summary.write(loaded)
    assert "<b>" not in text and "a\\|b" in text
