"""The table of errors: each measure, the worst repetition, and why one is missing; agreement is a tick or a cross."""

import csv

import pytest
import report_tables
from made_up_errors import OF_SCENE, error

from reports.accuracy import accuracy_columns, accuracy_table
from reports.run import results


def table(load, tmp_path, records):
    accuracy_table.write(load(records), tmp_path)
    with open(tmp_path / "accuracy-0-comparison.csv", newline="") as file:
        return {(row["variant"], row["quantity"]): row for row in csv.DictReader(file)}


def test_the_worst_of_all_repetitions_is_shown(load, record, tmp_path):
    worse = {"relative_mse": 0.02, "psnr_db": 20.0, "ssim": 0.5, "flip": 0.25, "rmse": 0.5, "max": 0.875}
    rows = [record("cpp", n, error={**OF_SCENE, **more}) for n, more in enumerate(({}, worse, {}))]
    found = table(load, tmp_path, rows)
    for name, value in worse.items():
        assert float(found["cpp", f"error_{name}"]["value"]) == value


def test_what_is_missing_has_its_reason(load, record, bad, tmp_path):
    small = {**OF_SCENE, "ssim": {"unavailable": "too small"}, "psnr_db": {"unavailable": "infinite"}}
    records = [
        record("cpp", error=small), record("old", error=None), bad("numba", "failed", "it broke"),
        record("alone", error={"unavailable": "nobody makes it"}, agreement={"unavailable": "nobody to judge"}),
    ]  # fmt: skip
    found = table(load, tmp_path, records)
    assert found["cpp", "error_ssim"]["note"] == "unavailable: too small"
    assert found["cpp", "error_psnr_db"]["note"] == "unavailable: infinite"
    assert found["old", "error_flip"]["note"] == "unavailable: the run does not have it"
    assert "it broke" in found["numba", "error_flip"]["note"] and "nobody makes" in found["alone", "error_flip"]["note"]
    assert found["alone", "agrees"]["note"] == "unavailable: nobody to judge"


def test_agreement_is_a_tick_or_a_cross(load, record):
    """Nothing else, but for the share of a mask above 1 %."""
    agreed = record("")["agreement"]
    marks = {
        "right": (agreed | {"mask_fraction": 0.01}, "✓"),
        "masked": (agreed | {"mask_fraction": 0.0125}, "✓ (mask 1.2 %)"),
        "wrong": (agreed | {"mask_fraction": 0.0, "wrong": "7 pixels off"}, "✗"),
        "alone": ({"unavailable": "nobody"}, "unavailable: nobody"),
    }
    run = load([record(name, agreement=told) for name, (told, _) in marks.items()])
    assert {cell.variant: cell.agreement for cell in run.cells} == {name: mark for name, (_, mark) in marks.items()}


@pytest.mark.parametrize(
    ("rmse", "doubt", "change", "said"),
    [
        (0.0625, 1e-4, 1e-5, "0.0625"),
        (0.0625, 5e-3, 1e-5, "0.062 [0.053, 0.072]"),
        (1e-4, 1e-3, 1e-5, "below 0.0021"),
        (0, 0, 1e-5, "below 1e-05"),
        (0, 0, 0, "exactly 0"),
    ],
)
def test_an_rmse_is_told_as_well_as_its_truth_is_known(load, record, rmse, doubt, change, said):
    error = OF_SCENE | {"rmse": rmse, "rmse_standard_error": doubt, "change": change}
    (cell,) = load([record("cpp", error=error)]).cells
    assert accuracy_columns.shown_rmse(cell) == said


OLD = {"truth_file": "pictures/t.npy", "pictures": 4, "standard_error": 0.5, "rmse": 1.0, "max": 2.0}
BASES = [
    (OF_SCENE, None),
    (OF_SCENE | {"depth": 3, "change": None}, "at depth 3"),
    (error(0.5), "over the areas of pixels at depth 10"),
    (error(0.5, False), "at the centres of pixels at depth 10"),
    (OLD, "against a picture with the same depth and places of samples"),
]


@pytest.mark.parametrize(("told", "said"), BASES)
def test_every_table_and_the_summary_say_what_errors_are_held_against(report_text, record, told, said):
    """If that is not the truth of the scene, in words beside each number."""
    text = report_text([record("cpp", error=told)])
    tables = [rows for rows in report_tables.tables(text.partition("## Summary")[2]) if "RMSE" in rows[0]]
    assert tables and all(rows[0].get("error against") == said for rows in tables)
    summary = text.partition("## Summary")[2].partition("\n## ")[0]
    assert (f"Errors are {said}." in summary) == (said is not None) and (said is not None or "against" not in summary)


def test_first_hits_of_earlier_runs_have_their_error_in_the_agreement(make_run, record):
    hits = record("")["parameters"] | {"kind": "rays"}
    agreed = record("")["agreement"] | {"max_outside": 1e-15, "max_inside": 0.5, "bad_pixels": 0.25}
    run = results.load(make_run([record("cpp", parameters=hits, agreement=agreed, error=None)]))
    (cell,) = run.cells
    assert cell.errors == "largest error of a distance 0.5, 25 % of rays hit something else"
    assert str(cell.error()) == "unavailable: first hits have none"
