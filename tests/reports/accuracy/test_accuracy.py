"""The table of errors: each measure, the worst repetition, and why one is missing."""

import csv

from reports.accuracy import accuracy_table

SEEN = {"relative_mse": 1e-4, "psnr_db": 41.0, "ssim": 0.99, "flip": 0.02, "flip_file": "pictures/cpp.flip.npy"}


def table(load, tmp_path, records):
    accuracy_table.write(load(records), tmp_path)
    with open(tmp_path / "accuracy-0-comparison.csv", newline="") as file:
        return {(row["variant"], row["quantity"]): row for row in csv.DictReader(file)}


def test_the_worst_of_all_repetitions_is_shown(load, record, tmp_path):
    accuracy = record("cpp")["accuracy"]
    worse = {"relative_mse": 2e-4, "psnr_db": 40.0, "ssim": 0.98, "flip": 0.03, "rmse": 0.5, "max_inside": 0.7}
    rows = [record("cpp", n, accuracy={**accuracy, **SEEN, **more}) for n, more in enumerate(({}, worse, {}))]
    found = table(load, tmp_path, rows)
    for name, value in worse.items():
        quantity = {"max_inside": "max_inside"}.get(name, name)
        assert float(found["cpp", quantity]["value"]) == value


def test_what_is_missing_has_its_reason(load, record, bad, tmp_path):
    accuracy = record("cpp")["accuracy"]
    small = {**SEEN, "ssim": {"unavailable": "too small"}, "psnr_db": {"unavailable": "infinite"}}
    records = [
        record("cpp", accuracy={**accuracy, **small}), record("old"), bad("numba", "failed", "it broke"),
        record("alone", accuracy={"unavailable": "nobody to judge"}),
    ]  # fmt: skip
    found = table(load, tmp_path, records)
    assert found["cpp", "ssim"]["note"] == "unavailable: too small"
    assert found["cpp", "psnr_db"]["note"] == "unavailable: infinite"
    assert found["cpp", "max_inside"]["note"] == "unavailable: no pixel is in the mask"
    assert found["old", "flip"]["note"] == "unavailable: the run does not have it"
    assert "it broke" in found["numba", "flip"]["note"] and "nobody to judge" in found["alone", "flip"]["note"]
