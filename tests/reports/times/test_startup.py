"""Start-up by phases, cold beside warm: numbers that can be checked by hand."""

import csv

import pytest
import report_tables

from reports.run import results
from reports.times import startup_figure


def phases(compile_s):
    """Of a process that renders from 1 s after it has compiled on, with gaps that count for nothing."""
    marks = [["start", 0.0, 0.25], ["import", 0.25, 0.75], ["load", 0.8, 1.0]]
    marks += [["compile", 1.0, 1.0 + compile_s]] if compile_s else []
    return [*marks, ["render", 9.0, 10.0], ["save", 10.0, 11.0], ["exit", 11.0, 12.0]]


@pytest.fixture
def told(record):
    """Of `numba` six rounds, warm and cold, the first of which was cold in both; of `cpp` three."""

    def make():
        rows = []
        for number in range(6):
            for kind in ("timed", "cold"):
                cold = kind == "cold" or number == 0
                more = {"pass": kind, "phases": phases(4.0 + number if cold else 0.5), "series": None}
                rows.append(record("numba", number, frames=[0.125], cache="cold" if cold else "warm", **more))
        for number in range(3):
            for kind in ("timed", "cold"):
                more = {
                    "pass": kind,
                    "phases": phases(0),
                    "build": {"seconds": 3.0, "compiler": "g++", "command": ["g++"]},
                    "series": None,
                }
                rows.append(record("cpp", number, frames=[0.5], **more))
        return rows

    return make


def the(loaded):
    (starts,) = startup_figure.starts_by_place(loaded).values()
    return {(start.variant, start.state): start for start in starts}


def test_numbers_by_hand(load, told):
    found = the(load(told()))
    assert list(found) == [("numba", "cold"), ("numba", "warm"), ("cpp", "cold"), ("cpp", "warm")]
    cold, warm = found["numba", "cold"], found["numba", "warm"]
    # 4, 4, 5, 6, 7, 8, 9: the first round was cold twice
    assert cold.phases == pytest.approx({"start": 0.25, "import": 0.5, "load": 0.2, "compile": 6, "first frame": 0.125})
    assert (cold.total.value, cold.total.processes) == (pytest.approx(0.95 + 6 + 0.125), 7)
    assert cold.total.low < cold.total.value < cold.total.high
    assert warm.total.value == pytest.approx(0.95 + 0.5 + 0.125) and warm.total.processes == 5
    assert (cold.build, warm.build) == (None, None)
    built = found["cpp", "cold"]
    assert (built.build, found["cpp", "warm"].build) == (3.0, None)
    assert built.total.value == found["cpp", "warm"].total.value == pytest.approx(0.95 + 0.5)


def test_what_failed_is_left_out_and_told(load, told, bad, report_text):
    rows = told()
    for row in rows[2:4]:
        row |= {"status": "failed", "reason": "it broke", "frames_s": None, "phases": None}
    rows[5] |= {"warnings": ["the picture is not the same as in the first repetition"]}
    assert the(load(rows))["numba", "cold"].total.processes == 6
    text = report_text(rows, name="again")
    assert "2 of 12 left out: failed: it broke" in text and "the picture is not the same" in text


def test_a_cell_that_never_ran_has_its_reason(load, told, bad, report_text):
    rows = [*told(), bad("gone", "unavailable", "no such thing")]
    assert ("gone", "cold") not in the(load(rows))
    section = report_text(rows, name="again").partition(f"## {startup_figure.TITLE}")[2].partition("\n## ")[0]
    assert "gone: 1 of 1 left out: unavailable: no such thing" in section


def test_nothing_without_a_cold_pass(make_run, record, tmp_path):
    loaded = results.load(make_run([record("numba", cache="cold", compile_s=1.0)]))
    assert startup_figure.write(loaded, tmp_path) == ""


def test_the_cold_pass_is_in_no_other_time(load, told):
    numba, cpp = load(told()).cells
    assert (len(numba.timed), len(cpp.timed)) == (6, 3)


def test_in_the_report(section, told, tmp_path):
    text, figures = section(told(), startup_figure.TITLE)
    (table,) = report_tables.tables(text)
    told = [table[3][name] for name in ("renderer", "cache", "start", "import", "load", "compile", "first frame")]
    assert told == ["cpp", "warm", "250 ms", "500 ms", "200 ms", "none", "500 ms"]
    assert [row["compiled beforehand"] for row in table] == ["none", "none", "3.00 s", "none"]
    axes = figures["start-0-comparison"].axes[0]
    assert [label.get_text() for label in axes.get_yticklabels()][:2] == ["numba, cold", "numba, warm"]
    reach = {}
    for bar in axes.patches:
        row = round(bar.get_y() + bar.get_height() / 2)
        reach[row] = max(reach.get(row, 0), bar.get_x() + bar.get_width())
    assert reach == pytest.approx({0: 7.075, 1: 1.575, 2: 4.45, 3: 1.45})
    with open(tmp_path / "start.csv", newline="") as file:
        rows = {(row["variant"], row["cache"], row["phase"]): row for row in csv.DictReader(file)}
    assert float(rows["cpp", "cold", "compiled beforehand"]["value_s"]) == 3
    assert rows["cpp", "cold", "sum"]["processes"] == "3"
