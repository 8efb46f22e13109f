"""The cut-off in reports: changes, bounds, rays and times checked by hand, and a bound that does not hold."""

import csv
import itertools

import matplotlib.pyplot as plt
import numpy as np
import pytest
from drawn_files import drawn_files

from reports.accuracy import cutoff_figure
from reports.page import report
from reports.paper import style
from reports.run import results

SIDE = 4
RADIANCE = 2.0
POWERS = (6, 8, 10)
RAYS = {"primary": 10, "reflected": 20, "transmitted": 0, "shadow": 10, "non_finite": 0}


@pytest.fixture
def sweep(record):
    """A function that gives records and files of pictures that lose a quarter of their bound, and half of their rays.

    Every pixel drops the cut-off's weight, but the first nothing.
    """

    def make(variants=("cpp",), processes=5, lost=0.25, whole=True, precision="float64", **changes):
        right = np.full((SIDE, SIDE, 3), 0.5)
        told, files = [], {}
        for variant, power in itertools.product(variants, [None, *POWERS] if whole else POWERS):
            cutoff = 2.0**-power if power else 0.0
            dropped = np.full((SIDE, SIDE), cutoff)
            dropped[0, 0] = 0
            name = f"{variant}-{power}"
            files[f"pictures/{name}.npy"] = right - lost * RADIANCE * dropped[..., None] * np.array([1, 0.5, 0])
            files[f"pictures/{name}.dropped.npy"] = dropped
            bound = {"radiance": RADIANCE, "dropped_file": f"pictures/{name}.dropped.npy"} if power else None
            rays = RAYS | {"reflected": 10, "shadow": 0} if power else RAYS
            own = {
                "cell": name, "point": {"cutoff": cutoff}, "picture": {"file": f"pictures/{name}.npy"},
                "parameters": {**record("")["parameters"], "cutoff": cutoff, "precision": precision}, "bound": bound,
                "rays": rays, "series": None,
            }  # fmt: skip
            for number in range(processes):
                told.append(record(variant, number, frames=(1, 0.8 if power else 1.0), **(own | changes)))
        return told, files

    return make


@pytest.fixture
def points(make_run):
    """A function that gives the points of the only sweep."""

    def find(made, name="run"):
        ((_, (one,)),) = cutoff_figure.sweeps_by_view(results.load(make_run(made[0], name, made[1])))
        return one.points

    return find


@pytest.fixture
def section(make_run, tmp_path, monkeypatch):
    monkeypatch.setattr(style, "save", lambda figure, path: plt.close(figure))
    return lambda made: cutoff_figure.write(results.load(make_run(made[0], files=made[1])), tmp_path)


def test_numbers_by_hand(points, sweep):
    found = points(sweep())
    assert [point.cutoff for point in found] == [2.0**-10, 2.0**-8, 2.0**-6]
    for point in found:
        assert point.change == pytest.approx(0.25 * RADIANCE * point.cutoff)
        assert point.bounds == (RADIANCE * point.cutoff, pytest.approx(RADIANCE * point.cutoff * 15 / 16))
        assert point.ratio == pytest.approx(0.25) and point.beyond == 0
        assert point.rays == 0.5
        assert point.time.value == pytest.approx(0.8)
    assert [point.bad for point in found] == [0, 0, 15 / 16]  # 2^-7 is beyond 1/255


def test_a_bound_that_holds_is_said_to(section, sweep):
    text = section(sweep(variants=("cpp", "numba")))
    assert (
        "The bound holds in every pixel of all 6 pictures with a cut-off; what it changes is at most 25 % of it" in text
    )
    assert "DOES NOT HOLD" not in text


def test_a_bound_that_does_not_hold_is_said_loudly(section, sweep):
    text = section(sweep(lost=1.5))
    assert "**THE BOUND DOES NOT HOLD in 3 of 3 pictures.**" in text
    assert "cpp, cut-off 2^-6: 15 pixels, a change of up to 1.5 times the bound" in text


def test_a_pixel_that_differs_and_dropped_nothing_breaks_it(points, sweep):
    told, files = sweep()
    files["pictures/cpp-8.npy"][0, 0, 1] += 1e-6
    small, broken, large = points((told, files))
    assert broken.ratio == np.inf and broken.beyond == 1
    assert small.beyond == large.beyond == 0


def test_rounding_is_of_its_precision(points, sweep):
    found = {}
    for precision in ("float64", "float32"):
        told, files = sweep(precision=precision)
        files["pictures/cpp-8.npy"][0, 0, 1] += 1e-6  # some 17 u of float32
        found[precision] = points((told, files), precision)[1].beyond
    assert found == {"float64": 1, "float32": 0}


def test_what_cannot_be_compared_has_its_reason(section, sweep, bad):
    assert "3 of cpp: unavailable: the run has no cell without a cut-off" in section(sweep(whole=False))


def test_a_cell_that_failed_is_left_out_by_name(section, sweep, bad):
    told, files = sweep(processes=1)
    broken = bad("cpp", "failed", "it broke", cell="x", point={"cutoff": 2.0**-12})
    broken["parameters"] = told[1]["parameters"] | {"cutoff": 2.0**-12}
    assert "1 of cpp: unavailable: failed: it broke" in section(([*told, broken], files))


def test_no_section_without_a_cutoff(section, record):
    assert section(([record("cpp")], {})) == ""
    assert cutoff_figure in report.PARTS


def test_files_are_the_same_twice_and_hold_no_blank(make_run, tmp_path, sweep):
    told, files = sweep(variants=("cpp", "numba"))
    told = [row | ({"rays": None} if row["variant"] == "numba" else {}) for row in told]
    loaded = results.load(make_run(told, files=files))
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        text = cutoff_figure.write(loaded, tmp_path / name)
    names = sorted(path.name for path in (tmp_path / "a").iterdir())
    assert names == [*drawn_files("cutoff-0-comparison"), "cutoff.csv"]
    for name in names:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name
    with open(tmp_path / "a" / "cutoff.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 6 and {row["rays_kept"] for row in rows} == {"0.5", "NaN"}
    for line in text.splitlines():
        if line.startswith("|"):
            assert "" not in [cell.strip() for cell in line.split("|")[1:-1]] and "nan" not in line.lower(), line
