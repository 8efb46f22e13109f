"""Error against samples: pictures whose error falls with a slope that is known."""

import csv
import itertools

import matplotlib.pyplot as plt
import numpy as np
import pytest
import report_tables
from drawn_files import drawn_files

from reports.accuracy import convergence, convergence_figure
from reports.page import report
from reports.paper import style
from reports.run import results
from reports.run.cell import Missing

SIDE = 24
SIDES = (1, 2, 4, 8, 16)  # n of n x n: 8 octaves
THEORY = {"comparison": {"uniform": -0.5, "jittered": -0.75}}


@pytest.fixture
def sweep(record):
    """A function that gives records and files of pictures whose error is the standard deviation N^slope."""

    def make(slopes, variants=("cpp",), sides=SIDES, standard_error=0.0, dial="samples", seeds=(0,), **changes):
        truth = np.random.default_rng(1).random((SIDE, SIDE, 3))
        told, files = [], {"pictures/truth.npy": truth}
        for (sampler, slope), n, seed in itertools.product(slopes.items(), sides, seeds):
            rng = np.random.default_rng([n, seed, len(sampler)])
            draws = n * n if dial == "samples" else n
            picture = truth + 0.1 * max(draws, 1) ** slope * rng.standard_normal(truth.shape)
            for variant in variants:
                name = f"{variant}-{sampler}-{n}-{seed}"
                files[f"pictures/{name}.npy"] = picture
                error = {"truth_file": "pictures/truth.npy", "standard_error": standard_error or None}
                point = {"sampler": sampler, dial: n, "seed": seed}
                parameters = {
                    **record("")["parameters"], "width": SIDE, "height": SIDE, "region": f"0,0,{SIDE},{SIDE}",
                    "samples": 1, "feelers": 0, "glossy_rays": 0, **point,
                }  # fmt: skip
                picture_told = {"file": f"pictures/{name}.npy"}
                own = {"cell": name, "point": point, "parameters": parameters, "picture": picture_told, "error": error}
                told.append(record(variant, series=None, **(own | changes)))
        return told, files

    return make


@pytest.fixture
def lines(make_run):
    """A function that gives the lines of the only view of what `sweep` made."""
    numbers = itertools.count()

    def find(made, theory=THEORY):
        told, files = made
        experiment = {"processes": 1, "frames": 2, "theory": theory}
        folder = make_run(told, f"run-{next(numbers)}", files, experiment=experiment)
        ((_, found),) = convergence.lines_by_view(results.load(folder))
        for line in found:
            print(line.variants, line.label, line.slope)
        return found

    return find


def test_the_slope_is_found_and_held_against_theory(lines, sweep):
    uniform, jittered = lines(sweep({"uniform": -0.35, "jittered": -0.75}))
    for line, slope in ((uniform, -0.35), (jittered, -0.75)):
        assert line.slope.value == pytest.approx(slope, abs=0.02)
        # 5 pictures of 1728 independent errors: standard error of log2 RMSE 0.0245, of the slope 0.0039
        assert line.slope.low < slope < line.slope.high and 0.008 < line.slope.high - line.slope.low < 0.03
        assert line.octaves == 8
    assert jittered.off == pytest.approx(jittered.slope.value + 0.75) and abs(jittered.off) < convergence.CLOSE
    assert uniform.off == pytest.approx(uniform.slope.value + 0.5) and abs(uniform.off) > convergence.CLOSE


def test_draws_are_counted_by_what_is_swept(lines, sweep):
    made = sweep({"one": -0.5}, dial="feelers", sides=(1, 2, 4, 8, 16, 32))
    (line,) = lines(made, {"comparison": {"feelers": -0.6}})
    assert [point.draws for point in line.points] == [1, 2, 4, 8, 16, 32]
    assert line.label == "feelers" and line.theory == -0.6
    assert line.slope.value == pytest.approx(-0.5, abs=0.03)


def test_a_point_light_is_no_point_of_a_soft_one(lines, sweep):
    (line,), (soft,) = (lines(sweep({"one": -0.5}, dial="feelers", sides=(*more, 1, 4, 16))) for more in ((0,), ()))
    assert [point.draws for point in line.points] == [1, 4, 16]
    assert [point.error for point in line.points] == [point.error for point in soft.points]


def test_one_sample_in_the_middle_begins_the_grid(lines, sweep):
    told, files = sweep({"one": -0.5}, sides=(1,))
    more, others = sweep({"uniform": -0.5}, sides=(2, 4, 8))
    (line,) = lines((told + more, files | others))
    assert line.label == "uniform" and [point.draws for point in line.points] == [1, 4, 16, 64]


def test_fewer_than_four_octaves_have_no_slope(lines, sweep):
    (line,) = lines(sweep({"jittered": -0.75}, sides=(1, 2, 3)))
    assert isinstance(line.slope, Missing) and "needs four octaves, has 3.17" in str(line.slope)


def test_what_the_truth_does_not_tell_is_not_fitted(lines, sweep):
    # error 0.1 N^-0.75: 0.1, 0.0125, 0.0016, 0.0002, 0.00002
    (line,) = lines(sweep({"jittered": -0.75}, sides=(1, 4, 16, 64, 256), standard_error=1e-4))
    assert [point.fits for point in line.points] == [True, True, True, False, False]
    assert line.octaves == 8


def test_errors_of_other_seeds_are_pooled(lines, sweep):
    (line,) = lines(sweep({"jittered": -0.75}, seeds=range(4)))
    alone = lines(sweep({"jittered": -0.75}))[0].slope
    assert len(line.points) == len(SIDES)
    assert line.slope.high - line.slope.low < 0.75 * (alone.high - alone.low)


def test_variants_with_the_same_errors_are_one_line(lines, sweep):
    (line,) = lines(sweep({"jittered": -0.75}, variants=("cpp", "numba")))
    assert line.variants == ("cpp", "numba")
    told, files = sweep({"jittered": -0.75}, variants=("cpp", "numba"))
    files["pictures/numba-jittered-16-0.npy"] = files["pictures/numba-jittered-16-0.npy"] + 1e-3
    assert len(lines((told, files))) == 2


def test_what_has_no_error_is_told(make_run, tmp_path, sweep, monkeypatch):
    monkeypatch.setattr(style, "save", lambda figure, path: plt.close(figure))
    told, files = sweep({"jittered": -0.75})
    told[1]["error"] = {"unavailable": "the truth broke"}
    told[2] |= {"status": "wrong picture", "reason": "7 pixels off"}
    text = convergence_figure.write(results.load(make_run(told, files=files)), tmp_path)
    assert "1 of cpp: unavailable: the truth broke" in text and "1 of cpp: unavailable: wrong picture: 7 pix" in text
    ((row, *_),) = report_tables.tables(text)
    assert row["theory"] == "unavailable: the experiment names none"


def test_no_section_without_a_sweep_or_a_truth(make_run, tmp_path, record, sweep):
    told, files = sweep({"jittered": -0.75}, sides=(4,))
    assert convergence_figure.write(results.load(make_run(told, "one", files)), tmp_path) == ""
    told, files = sweep({"jittered": -0.75}, error=None)
    assert convergence_figure.write(results.load(make_run(told, "old", files)), tmp_path) == ""
    assert convergence_figure in report.PARTS


def test_files_are_the_same_twice_and_hold_no_blank(make_run, tmp_path, sweep):
    told, files = sweep({"uniform": -0.5, "jittered": -0.75}, variants=("cpp", "numba"))
    loaded = results.load(make_run(told, files=files))
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        convergence_figure.write(loaded, tmp_path / name)
    names = sorted(path.name for path in (tmp_path / "a").iterdir())
    assert names == [*drawn_files("convergence-0"), "convergence-slopes.csv", "convergence.csv"]
    for name in names:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name
    with open(tmp_path / "a" / "convergence.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 * 2 * len(SIDES) and all("" not in row.values() for row in rows)
    with open(tmp_path / "a" / "convergence-slopes.csv", newline="") as file:
        slopes = list(csv.DictReader(file))
    assert [row["theory"] for row in slopes] == ["NaN"] * 4 and all(float(row["high"]) < 0 for row in slopes)
