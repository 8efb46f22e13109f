"""The table of technologies: when it is there, and what it says where something is missing."""

import csv

import report_tables

from reports.times import peers

MANY = ("Python", "NumPy", "Numba", "C++20", "Taichi", "JAX")


def run(record, more=(), **changes):
    """A variant for each technology, three processes each; the i-th takes i + 1 times as long as the first."""
    return [
        record(
            "cpp" if name == "C++20" else name.lower(), number, (0.1 * place,) * 4, technology=name, **changes
        )
        for place, name in enumerate(MANY, 1)
        for number in range(5)
    ] + list(more)  # fmt: skip


def test_a_run_of_few_technologies_has_no_table(record, load, tmp_path):
    few = [told for told in run(record) if told["technology"] != "JAX"]
    assert peers.write(load(few), tmp_path) == ""
    assert not list(tmp_path.glob("peers-*"))


def test_the_table(record, bad, load, tmp_path):
    lost = bad("embree", "unavailable", "no Python module embreex (pip install embreex)", technology="Embree")
    compiled = [
        record("cython", number, technology="typed", compile_s=7.0, cache="cold", lines=312) for number in range(5)
    ]
    text = peers.write(load(run(record, [lost, *compiled], lines=None)), tmp_path)
    assert text.startswith("## Technologies beside each other")
    (table,) = report_tables.tables(text)
    embree = next(row for row in table if row["renderer"] == "embree")
    assert embree["status"] == "unavailable: no Python module embreex (pip install embreex)"
    with open(next(tmp_path.glob("peers-0-*.csv")), newline="", encoding="utf-8") as file:
        rows = {(row["variant"], row["quantity"]): row for row in csv.DictReader(file)}
    assert rows["jax", "technology"]["note"] == "JAX"
    assert abs(float(rows["jax", "time_over_cpp"]["value"]) - 6 / 4) < 1e-12
    assert rows["cpp", "time_over_cpp"]["note"] == "1 (the baseline)"
    assert float(rows["cython", "compile_cold"]["value"]) == 7.0
    assert float(rows["cython", "lines"]["value"]) == 312
    assert rows["jax", "lines"]["note"] == "unavailable: the run did not store it"
    assert float(rows["numpy", "peak_bytes"]["value"]) == 4e6
    assert float(rows["numpy", "error_max"]["value"]) == 0.75 and rows["numpy", "agrees"]["note"].startswith("✓")
