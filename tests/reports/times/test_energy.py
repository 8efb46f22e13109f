"""The section on the energy of the processor."""

import csv

from reports.times import energy_table

USED = {"power_w": 40.0, "energy_j": 70.0, "energy_s": 1.75, "joules_per_frame": 10.0, "joules_per_mray": 2.5}
NONE = {"unavailable": "no RAPL here"}


def test_a_table(load, record, tmp_path):
    of_none = {**USED, "joules_per_mray": {"unavailable": "it does not count its rays"}}
    run = load(
        [record("cpp", n, energy=USED) for n in range(5)] + [record("numba", n, energy=of_none) for n in range(5)]
    )
    text = energy_table.write(run, tmp_path)
    assert text.startswith("## Energy of the processor") and "it does not count its rays" in text
    (file,) = tmp_path.glob("energy-*.csv")
    found = {(row["variant"], row["quantity"]): row for row in csv.DictReader(file.open())}
    assert float(found["cpp", "joules_per_frame"]["value"]) == 10 and float(found["numba", "power_w"]["value"]) == 40


def test_one_reason(load, record, tmp_path):
    run = load([record(name, n, energy=NONE) for name in ("cpp", "numba") for n in range(2)])
    assert energy_table.write(run, tmp_path) == "## Energy of the processor\n\nunavailable: no RAPL here"


def test_a_run_of_a_version_without_it(load, record, tmp_path):
    assert energy_table.write(load([record("cpp", 0)]), tmp_path) == ""
