"""The section on instructions: counts a ray and a pixel, what counted them, and why there are none."""

import csv

import pytest

from reports.times import counts_table

PERF = {
    "tool": "perf", "version": "6.1", "width": 4, "height": 4, "rays": 20, "instructions": 4e4, "cycles": 2e4,
    "branches": 5e3, "branch_misses": 50.0, "spread": 2e-4, "smaller": None, "options": [], "environment": {},
}  # fmt: skip
VALGRIND = {
    "tool": "valgrind", "version": "3.19.0", "width": 2, "height": 2, "rays": None, "instructions": 2e4,
    "spread": None, "smaller": "Valgrind is slow", "options": ["-mno-avx512f"], "environment": {"CPU": "old"},
}  # fmt: skip


@pytest.fixture
def counted(record, bad):
    """A function that makes the records of a cell, and of its count; without counts, for a reason."""

    def make(variant, counts=None, reason=""):
        told = {"pass": "count", "counts": counts}
        return [record(variant, 0), bad(variant, "unavailable" if reason else "ok", reason, **told)]

    return make


def test_counts_a_ray_and_a_pixel(load, counted, tmp_path):
    run = load(counted("cpp", PERF) + counted("numba", VALGRIND) + counted("python", reason="no tool"))
    assert len(run.repetitions) == 6 and [len(cell.timed) for cell in run.cells] == [1, 1, 1]
    text = counts_table.write(run, tmp_path)
    assert text.startswith("## Instructions")
    rows = {line.split(" | ")[0].strip("| "): line for line in text.splitlines() if line.startswith("| ")}
    assert rows["cpp"].startswith("| cpp | 2000 | 2500 | 40000 | 0.02 | 2 | 1 |") and "perf 6.1" in rows["cpp"]
    assert "5000 | 20000" in rows["numba"]
    assert "valgrind 3.19.0, 2 × 2 pixels, -mno-avx512f, CPU=old" in rows["numba"]
    assert "no tool" in text
    (file,) = tmp_path.glob("instructions-*.csv")
    found = {(row["variant"], row["quantity"]): row for row in csv.DictReader(file.open())}
    assert float(found["cpp", "instructions_per_cycle"]["value"]) == 2
    assert float(found["cpp", "branch_misses"]["value"]) == 0.01
    assert found["cpp", "cache_misses"]["note"] == "unavailable: perf did not count it, or only a part of the time"
    assert found["numba", "instructions_per_ray"]["note"] == "unavailable: it reports no rays"
    assert found["python", "instructions"]["note"] == "unavailable: no tool"


def test_a_run_without_counts_has_no_section(load, record, tmp_path):
    run = load([record("cpp", 0)])
    assert counts_table.write(run, tmp_path) == "" and run.counts(run.cells[0]).reason == "the run did not count"


def test_of_valgrind_alone_there_are_no_cycles(load, counted, tmp_path):
    text = counts_table.write(load(counted("numba", VALGRIND)), tmp_path)
    assert "instructions a cycle" not in text and "cache misses" not in text


def test_a_report_takes_no_time_from_a_count(report_text, counted):
    text = report_text(counted("cpp", VALGRIND) + counted("numba", reason="no tool"))
    assert "## Instructions" in text and "| cpp | 250 ms" not in text.partition("## Instructions")[2]
