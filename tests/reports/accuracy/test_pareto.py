"""Speed against accuracy: what is on the front and how surely, what is compared, and what a budget buys."""

import csv
import itertools

import cpu_time
import numpy as np
import pytest
import report_tables
from made_up_errors import FACTS, NOISE, error

from reports.accuracy import budget_table, pareto, pareto_figure
from reports.run import repetition
from reports.run.cell import Missing


def test_the_front_is_what_nobody_beats():
    print("seed 5")
    rng = np.random.default_rng(5)
    times, errors = rng.integers(1, 6, (40, 25)).astype(float), rng.integers(1, 6, 25).astype(float)
    found = pareto.front(times, errors)
    for row, (n, size) in itertools.product(range(40), enumerate(errors)):
        beaten = any(
            other <= size and t <= times[row, n] and (other < size or t < times[row, n])
            for other, t in zip(errors, times[row], strict=True)
        )
        assert found[row, n] == (not beaten)


def test_the_share_is_that_of_all_resamples():
    """Three processes each: all 27 resamples of each point are counted out; the third is beaten in all."""
    times = [[1.0, 2.0, 6.0], [1.5, 3.0, 5.0], [7.0, 8.0, 9.0], [0.5, 4.0, 4.5], [0.9, 1.8, 4.2]]
    errors = np.array([1e-3, 1e-3, 1e-3, 1e-2, 1e-4])
    medians = [[np.median(drawn) for drawn in itertools.product(values, repeat=3)] for values in times]
    every = np.array(list(itertools.product(*map(np.unique, medians))))
    weights = np.array(
        [np.prod([np.mean(np.array(m) == t) for m, t in zip(medians, row, strict=True)]) for row in every]
    )
    expected = weights @ pareto.front(every, errors)
    found = pareto.shares(times, errors)
    assert found[2] == 0 == expected[2] and 0.1 < expected[0] < 0.9
    assert np.abs(found - expected).max() < 4 * 0.5 / pareto.RESAMPLES**0.5


@pytest.mark.alone
def test_five_hundred_points_take_a_second():
    rng = np.random.default_rng(6)
    errors = 10 ** rng.uniform(-6, -1, 500)
    times = [list(1e-3 / size * rng.lognormal(0, 1) * rng.lognormal(0, 0.05, 6)) for size in errors]
    pareto.shares(times[:5], errors[:5])
    found, took = cpu_time.seconds(lambda: pareto.shares(times, errors))
    assert took < 1 and 1 < found.sum() < 500


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, True),
        ({"sampler": "uniform"}, False),
        ({"sampler": "adaptive"}, False),
        ({"cutoff": 1e-3}, False),
        ({"depth": 4}, False),
        ({"precision": "float32"}, False),
        ({"floating_point": "fast"}, False),
        ({"glossy_rays": 4}, True),
        ({"glossy_rays": 4, "glossy_weight": "study"}, False),
        ({"feelers": 4}, True),
    ],
)
def test_only_noise_is_unbiased(load, cell, changes, expected):
    same = {key: changes[key] for key in ("glossy_rays", "feelers") if key in changes}
    told = [
        *cell("cpp", [2], 0.01, **{"sampler": "jittered", "samples": 4, **changes}),
        *cell("cpp", [1], 0.1, sampler="jittered", samples=2, seed=9, **same),
    ]
    (chart,) = pareto.charts(load(told, **FACTS))
    point = chart.points[0]
    assert point.unbiased is expected
    assert isinstance(point.efficiency, Missing) is not expected
    if expected:
        assert point.efficiency == pytest.approx(1 / (0.01**2 * 2))


def test_one_sample_of_soft_light_is_unbiased_among_its_like(load, cell):
    told = [*cell("cpp", [1], 0.1, feelers=1), *cell("cpp", [2], 0.05, feelers=4)]
    assert all(point.unbiased for point in pareto.charts(load(told, **FACTS))[0].points)
    exact = [*cell("cpp", [1], 1e-9, False), *cell("cpp", [2], 1e-9, False, walk="stack")]
    assert not any(point.unbiased for point in pareto.charts(load(exact, name="exact", **FACTS))[0].points)


def test_curves_run_along_the_dial_that_varies_most(load, jittered, cell):
    told = [
        *jittered("cpp", 0.1), *cell("cpp", [1], 0.01, sampler="jittered", samples=4, cutoff=0.01),
        *jittered("cpp", 0.1, sides=(1, 2, 4), sampler="uniform"), *jittered("numba", 0.1, sides=(3,)),
    ]  # fmt: skip
    (chart,) = pareto.charts(load(told, **FACTS))
    found = [(curve.variant, curve.family, curve.dial, len(curve.cells)) for curve in chart.curves]
    assert found == [
        ("cpp", "jittered n × n", "samples", 4),
        ("cpp", "uniform n × n", "samples", 3),
        ("cpp", "jittered 4 × 4, cut-off w", "cutoff", 2),  # from a point of the first
        ("numba", "jittered 3 × 3", None, 1),
    ]
    samples = [cell.parameters["samples"] for cell in chart.curves[0].cells]
    assert samples == sorted(samples)


def test_errors_that_the_truth_does_not_tell_apart_are_alike(load, cell):
    """1e-15 against 2e-15 is rounding, so the faster is on the front alone, even beside an error of exactly 0."""
    told = [
        *cell("cpp", [2.0] * 6, 1e-15, False), *cell("numba", [1.0] * 6, 2e-15, False),
        *cell("numpy", [3.0] * 6, 0.0, False), *cell("cpp", [0.5] * 6, 1e-5, False, precision="float32"),
    ]  # fmt: skip
    (chart,) = pareto.charts(load(told, **FACTS))
    assert [point.name for point in chart.front] == ["cpp, float32", "numba"]
    assert {point.name: point.share for point in chart.points} == {
        "cpp": 0, "numba": 1, "numpy": 0, "cpp, float32": 1,
    }  # fmt: skip


def test_one_method_has_one_error_whoever_renders(load, cell):
    """Two renderers differ in the last digits, and so do the truths that they are measured against."""
    told = [
        *cell("numba", [2.0] * 6, 0.01 - 4e-11, sampler="uniform", samples=4),
        *cell("cpp", [1.0] * 6, 0.01, sampler="uniform", samples=4),
        *cell("numpy", [3.0] * 6, 0.01 - 1e-5, sampler="jittered", samples=4),
    ]
    (chart,) = pareto.charts(load(told, **FACTS))
    assert {point.name.split(",")[0]: point.share for point in chart.points} == {"numba": 0, "cpp": 1, "numpy": 1}


def test_the_cheapest_within_a_budget(load, cell):
    told = [
        *cell("cpp", [1.00, 1.10, 1.20, 0.90, 1.00, 1.05], 0.003, sampler="jittered", samples=4),
        *cell("numba", [1.02, 1.08, 1.15, 0.95, 0.98, 1.10], 0.003, sampler="jittered", samples=4),
        *cell("numpy", [9.0] * 6, 0.003, sampler="jittered", samples=4),
        *cell("cpp", [0.1] * 6, 0.02, sampler="jittered", samples=2),
    ]
    run = load(told, **FACTS)
    (chart,) = pareto.charts(run)
    point, rivals = chart.cheapest(run, 1 / 32)
    assert (point.name, rivals) == ("cpp, jittered 2 × 2", [])
    point, rivals = chart.cheapest(run, 1 / 255)
    assert {point.cell.variant, *(rival.cell.variant for rival in rivals)} == {"cpp", "numba"}
    assert "no method" in str(chart.cheapest(run, 1e-3)) and "below the truth's accuracy, 0.00048" in str(
        chart.cheapest(run, 1e-4)
    )


def test_budgets_are_a_table_and_a_file(load, many, tmp_path):
    run = load(many, **FACTS)
    text = budget_table.write(run, tmp_path)
    with open(tmp_path / "budgets.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 * len(pareto.BUDGETS)
    exact = next(row for row in rows if row["view"] == "local" and float(row["budget"]) == 1e-9)
    assert exact["variant"] == "cpp-threads" and exact["method"] == "contract floating point"
    assert f"`{exact['command']}`" in text
    table, _ = report_tables.tables(text)
    told = {row["error at most"]: row["fastest"] for row in table}
    assert "1/255" in told and told["1e-09"] == "unavailable: below the truth's accuracy, 0.00048"
    for row in rows:
        assert all(value or name in ("note", "not_resolved_from", "command") for name, value in row.items())
        assert row["command"] or row["note"]


def test_who_never_pays(load, many):
    variants, methods = pareto.never_pays(pareto.charts(load(many, **FACTS)))
    assert variants == ["numpy", "numba", "numba-parallel", "cpp"]
    assert methods == ["as by default", "cut-off 2⁻⁶", "cut-off 2⁻¹⁰", "cut-off 2⁻¹⁴"]


def test_who_pays_in_one_chart_pays(load, cell):
    told = [
        *(one for scene in ("scenes/a.txt", "scenes/b.txt") for one in cell("cpp", [2] * 6, 1e-15, False, scene)),
        *cell("cpp", [1] * 6, 1e-3, False, "scenes/a.txt", cutoff=0.01),
        *cell("cpp", [3] * 6, 1e-3, False, "scenes/b.txt", cutoff=0.01),
    ]
    assert pareto.never_pays(pareto.charts(load(told, **FACTS))) == ([], [])


def test_a_run_without_errors_has_no_section(load, record, tmp_path):
    old = [
        *(record("cpp", n, error=None) for n in range(3)),
        record("cpp", point={"depth": 9}, error=None, parameters=record("")["parameters"] | {"depth": 9}),
    ]
    run = load(old)
    assert pareto_figure.write(run, tmp_path) == budget_table.write(run, tmp_path) == ""
    assert run.repetitions["error_rmse"].isna().all() and run.repetitions["bound_max"].isna().all()


def test_errors_and_their_reasons_are_columns(record):
    bound = {"radiance": 2.0, "max": 0.5, "mean": 0.1, "dropped_file": "x"}
    row = repetition.row(record("cpp", error=error(0.25), bound=bound))
    assert (row["error_rmse"], row["error_max"], row["uncertainty"], row["truth_samples"]) == (0.25, 2.25, NOISE, 64)
    assert (row["against"], row["agrees"]) == ("over the areas of pixels at depth 10", True)
    assert repetition.row(record("cpp"))["against"] == "", "the truth of the scene"
    assert (row["error_flip"], row["no_error_flip"], row["no_error"]) == (None, "too small", None)
    assert (row["bound_max"], row["bound_mean"]) == (0.5, 0.1)
    row = repetition.row(record("cpp", error={"unavailable": "nobody can"}))
    assert (row["error_rmse"], row["no_error"], row["bound_max"]) == (None, "nobody can", None)
    assert set(row) <= set(repetition.COLUMNS) | {"pass"}
