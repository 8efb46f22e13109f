"""Mirror chaos in reports: a growth that is known, and that of float32 in a grid of mirrors."""

import csv
import itertools

import matplotlib.pyplot as plt
import numpy as np
import pytest
from drawn_files import drawn_files

from reports.accuracy import chaos, chaos_figure
from reports.accuracy.resampling import Blocks
from reports.page import report
from reports.paper import style
from reports.run import results
from reports.run.cell import Missing

SIDE = 48
DEPTHS = range(13)
SINGLE, FUSED = ("float32", "strict"), ("float64", "contract")
FIRST = {SINGLE: 24 * 2.0**-24, FUSED: 24 * 2.0**-53}  # error of bounce 1


@pytest.fixture
def sweep(record):
    """A function that gives records and files of pictures whose error is `growth` times larger with each bounce.

    Each bounce reaches 0.8 of the pixels of the one before, and its light is below 1 by chance.
    """

    def make(growth=5.0, methods=(SINGLE,), variants=("cpp",), depths=DEPTHS, need=("reflection",), **changes):
        rng = np.random.default_rng(1)
        told, files = [], {}
        reaches = rng.random((SIDE, SIDE))
        light = [rng.random((SIDE, SIDE, 3)) * (reaches < 0.8**k)[..., None] for k in DEPTHS]
        other = [rng.random((SIDE, SIDE, 3)) * (reaches < 0.8**k)[..., None] for k in DEPTHS]
        scatter = [np.exp(rng.normal(size=(SIDE, SIDE, 1))) for _ in DEPTHS]  # median 1
        for variant, method in itertools.product(variants, (chaos.STRICT, *methods)):
            parts = []
            for k in DEPTHS:
                error = FIRST.get(method, 0) * growth ** (k - 1) * scatter[k]
                lost = np.minimum(error, 1) if k else 0 * error
                parts.append((1 - lost) * light[k] + lost * other[k])
            for depth in depths:
                name = f"{variant}-{'-'.join(method)}-{depth}"
                files[f"pictures/{name}.npy"] = sum(parts[: depth + 1]).astype(method[0])
                point = {"precision": method[0], "floating_point": method[1], "depth": depth}
                own = {
                    "cell": name, "point": point, "parameters": {**record("")["parameters"], **point}, "series": None,
                    "picture": {"file": f"pictures/{name}.npy"}, "needs": list(need),
                }  # fmt: skip
                told.append(record(variant, **(own | changes)))
        return told, files

    return make


@pytest.fixture
def growths(make_run):
    """A function that gives the growths of the only view."""

    numbers = itertools.count()

    def find(made):
        (one,) = chaos.mirror_views(results.load(make_run(made[0], f"run-{next(numbers)}", made[1])))
        for growth in one.growths:
            print(growth.label, growth.growth, growth.useful, growth.passes)
        return one.growths

    return find


@pytest.mark.parametrize("growth", [3.0, 6.0])
def test_the_growth_is_found(growths, sweep, growth):
    single, fused = growths(sweep(growth, methods=(SINGLE, FUSED)))
    for one, unit in ((single, 2.0**-24), (fused, 2.0**-53)):
        assert one.growth.value == pytest.approx(growth, rel=0.03)
        assert one.growth.low < growth < one.growth.high
        assert one.useful == pytest.approx(np.log(1 / (24 * unit)) / np.log(one.growth.value))
    # 24 u g^(k - 1) / 3 or so is beyond 1/255 first: the light itself, and the other, are some tenths
    expected = 1 + np.log(3 / 255 / (24 * 2.0**-24)) / np.log(growth)
    assert single.passes == pytest.approx(expected, abs=1)


def test_saturation_and_rounding_are_not_fitted(growths, sweep):
    (one,) = growths(sweep(6.0))
    numbers = [bounce.number for bounce in one.fitted]
    assert numbers[0] == 1 and numbers[-1] < 8 < one.bounces[-1].number
    assert [bounce.median for bounce in one.bounces][-1] > 0.1 * one.bounces[-1].random
    (one,) = growths(sweep(6.0, methods=(FUSED,)))
    assert one.fitted[-1].number == 12
    assert one.bounces[0].floor == pytest.approx(4 * 2.0**-53, rel=1)


def test_few_bounces_have_no_growth(growths, sweep):
    (one,) = growths(sweep(3000.0))
    assert isinstance(one.growth, Missing) and "needs 3 bounces" in str(one.growth) and one.useful is None


def test_pixels_that_reach_a_bounce_are_counted(growths, sweep):
    made = sweep()
    (one,) = growths(made)
    light = made[1]["pictures/cpp-float64-strict-4.npy"] - made[1]["pictures/cpp-float64-strict-3.npy"]
    assert one.bounces[3].pixels == np.count_nonzero(light.any(axis=-1)) == pytest.approx(0.8**4 * SIDE**2, rel=0.1)


def test_medians_of_resamples_lie_about_the_median():
    values = np.random.default_rng(1).random((SIDE, SIDE))
    some = values < 0.6
    blocks = Blocks(SIDE, SIDE)
    found = blocks.medians(values, some)
    assert np.median(found) == pytest.approx(np.median(values[some]), abs=0.005)
    # of 1382 values, uniform below 0.6: 0.6 / (2 sqrt(1382)) = 0.0081
    assert np.std(found) == pytest.approx(0.0081, rel=0.3)
    assert np.isnan(blocks.medians(values, values < 0)).all()


@pytest.fixture
def section(make_run, tmp_path, monkeypatch):
    monkeypatch.setattr(style, "save", lambda figure, path: plt.close(figure))
    numbers = itertools.count()

    def write(made):
        return chaos_figure.write(results.load(make_run(made[0], f"run-{next(numbers)}", made[1])), tmp_path)

    return write


def test_what_is_equal_in_every_bit_is_said_to_be(section, sweep):
    text_ = section(sweep(variants=("cpp", "numba")))
    assert "- numba, float64 strict (and cpp): equal in every bit" in text_
    assert "| numba, float32 strict | numba |" in text_


def test_a_picture_that_is_missing_has_its_reason(section, sweep, bad):
    told, files = sweep()
    own = {key: told[-3][key] for key in ("cell", "point", "parameters", "needs")}
    told[-3] = bad("cpp", "failed", "it broke", **own)
    assert section((told, files)) == ""  # nothing else is left to compare
    told, files = sweep(methods=(SINGLE, FUSED))
    del files["pictures/cpp-float32-strict-5.npy"]
    told = [row | ({"picture": None} if row["cell"] == "cpp-float32-strict-5" else {}) for row in told]
    assert "- cpp, float32 strict: unavailable: depth 5: no picture was stored" in section((told, files))


@pytest.mark.parametrize("changes", [
    {"need": ("reflection", "transmission")}, {"need": ()}, {"depths": (0, 1, 3, 5, 7)}, {"methods": ()},
])  # fmt: skip
def test_no_section_without_a_sweep_between_mirrors(section, sweep, changes):
    assert section(sweep())
    assert section(sweep(**changes)) == ""
    assert chaos_figure in report.PARTS


def test_files_are_the_same_twice_and_hold_no_blank(make_run, tmp_path, sweep):
    told, files = sweep(methods=(SINGLE, FUSED), variants=("cpp", "numba"))
    loaded = results.load(make_run(told, files=files))
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        chaos_figure.write(loaded, tmp_path / name)
    names = sorted(path.name for path in (tmp_path / "a").iterdir())
    assert names == [*drawn_files("chaos-0-comparison"), "chaos.csv"]
    for name in names:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name
    with open(tmp_path / "a" / "chaos.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 * 2 * 12 and all("" not in row.values() for row in rows)


def mirrors(radius):
    """4 x 4 x 3 mirroring spheres with spacing 1, seen from a generic place, coloured so that light varies."""
    lines = [
        "CAMERA (1.5123,1.4877,-1.0219) (1.4,0,0) (0,1.4,0) (0,0,-3)",
        "LIGHT (10.1,12.3,-9.7) (0.9,0.9,0.9) 0", "LIGHT (-8.3,-4.1,-11.9) (0.8,0.8,0.8) 0",
        "LIGHT (1.7,9.1,12.3) (0.8,0.8,0.8) 0",
    ]  # fmt: skip
    for x, y, z in itertools.product(range(4), range(4), range(3)):
        colour = f"({0.2 + 0.2 * x:.1f},{0.2 + 0.2 * y:.1f},{0.2 + 0.3 * z:.1f})"
        lines += [f"SPHERE ({x},{y},{z}) {radius}", f"{colour} 1 10 (0,0,0) 1e6 1"]
    return "\n".join(lines) + "\n"


# A curved mirror spreads an angle by 1 + 2 L / (r cos θ), with L the way from the last one.
@pytest.mark.slow
@pytest.mark.parametrize(("radius", "angle"), [(0.3, 10.0), (0.4, 5.5), (0.45, 4.4)])
def test_errors_between_mirrors_grow_as_angles_do(bench, growths, record, radius, angle):
    """angle: its median growth per bounce between rays that were traced in float32 and in float64, without pictures."""
    told, files = [], {}
    scene = mirrors(radius)
    methods = [chaos.STRICT, SINGLE, *([FUSED] if radius == 0.4 else [])]
    for (precision, floating_point), depth in itertools.product(methods, range(13)):
        point = {"precision": precision, "floating_point": floating_point, "depth": depth}
        wanted = {"width": 160, "height": 160, **point}
        name = f"cpp-{precision}-{floating_point}-{depth}"
        files[f"pictures/{name}.npy"] = bench.result("cpp", scene, **wanted).array
        told.append(record(
            "cpp", cell=name, point=point, series=None, needs=["reflection"],
            parameters=record("")["parameters"] | wanted, picture={"file": f"pictures/{name}.npy"},
        ))  # fmt: skip
    for one in growths((told, files)):
        print([(bounce.number, bounce.pixels, bounce.median) for bounce in one.bounces])
        assert one.growth.value == pytest.approx(angle, rel=0.15)
        unit = 2.0**-24 if one.arithmetic == SINGLE else 2.0**-53
        assert one.useful == pytest.approx(np.log(1 / (24 * unit)) / np.log(angle), rel=0.08)
        if one.arithmetic == SINGLE and one.passes is not None:
            assert one.useful / 2 < one.passes < one.useful
