"""Speed against accuracy: what is on the front and how surely, what is compared, and the chart that shows it."""

import csv
import itertools
import re
from zlib import crc32

import cpu_time
import numpy as np
import pytest

from reports import budget_table, command, method, pareto, pareto_figure, pareto_table, repetition, style
from reports.cell import Missing

pytestmark = pytest.mark.alone

NOISE = 1.2e-4  # standard error of a made-up sampled truth
DEFAULTS = {
    "width": 512, "height": 512, "region": "0,0,512,512", "depth": 10, "shadows": 1, "sampler": "one", "samples": 1,
    "adaptive_depth": 3, "adaptive_threshold": 0.1, "lens_radius": 0.0, "focal_distance": 1.0, "feelers": 0,
    "glossy_rays": 0, "glossy_weight": "plain", "seed": 0, "walk": "least", "accel": "auto", "sphere": "robust",
    "floating_point": "strict", "cutoff": 0.0, "epsilon": 3.6e-15,
}  # fmt: skip
ASKED = {"processes": 1, "frames": 2, "seed": 1, "override": {}, "image": {}, "measure": {"interval": 0.05}}
FACTS = {
    "experiment": ASKED | {"reference": {"depth": 10, "spots": 100}},
    "command": ["rayrace", "run", "experiments/a.toml"],
}


def error(rmse, sampled=True):
    certificate = {"unavailable": "sampled"} if sampled else {"spots": 100, "digits": 60, "largest": 2.1e-13}
    return {
        "truth": "judge", "truth_file": "pictures/t.npy", "pictures": 64 if sampled else 1, "certificate": certificate,
        "standard_error": NOISE if sampled else None, "rmse": rmse, "max": 9 * rmse, "bad_pixels": min(rmse, 1),
        "max_outside": 5 * rmse, "flip": {"unavailable": "too small"},
    }  # fmt: skip


@pytest.fixture
def cell(record):
    """A function that gives the records of a cell: its variant, times of its processes (s), error, and parameters."""

    def make(variant, times, rmse, sampled=True, scene="scenes/mirrors.txt", **parameters):
        key = f"{variant}-{scene[7:-4]}-{crc32(repr(sorted(parameters.items())).encode())}"
        told = {"cell": key, "scene": scene, "point": parameters, "series": None, "error": error(rmse, sampled)}
        told |= {"parameters": record("")["parameters"] | DEFAULTS | parameters}
        told |= {"picture": {"file": f"pictures/{key}.npy", "sha256": "0"}}
        return [record(variant, number, frames=[time] * 4, **told) for number, time in enumerate(times)]

    return make


@pytest.fixture
def jittered(cell):
    """A function that gives cells along n × n samples, whose error falls with n to the power -1.5."""

    def make(variant, speed, sides=(1, 2, 4, 8), sampler="jittered", **parameters):
        rng = np.random.default_rng(len(variant))
        told = []
        for n in sides:
            times = speed * n * n * rng.lognormal(0, 0.03, 6)
            told += cell(variant, times, 0.08 / n**1.5, sampler=sampler, samples=n, **parameters)
        return told

    return make


@pytest.fixture
def many(cell, jittered, bad, record):
    """A run of some thirty methods in two views, with one that failed."""
    told = []
    for variant, speed in {
        "numpy": 2.0,
        "numba": 0.1,
        "numba-parallel": 0.06,
        "cpp": 0.09,
        "cpp-threads": 0.05,
    }.items():
        told += jittered(variant, speed)
        for size, precision in ((1e-15, "float64"), (1e-3, "float32")):
            times = [speed * (1 + 0.01 * n) * (1 if precision == "float64" else 0.7) for n in range(6)]
            told += cell(variant, times, size * (1 + speed), False, "scenes/local.txt", precision=precision)
    for variant, speed in {"numba": 0.1, "cpp": 0.09}.items():
        for k in (6, 10, 14):
            told += cell(variant, [speed * (0.5 + k / 40)] * 6, 0.3 * 2**-k, False, "scenes/local.txt", cutoff=2.0**-k)
    told += cell("cpp-threads", [0.04] * 6, 0.0, False, "scenes/local.txt", floating_point="contract")
    parameters = record("")["parameters"] | DEFAULTS
    return [
        *told,
        bad("numba-cuda", "unsupported", "has no sampler", scene="scenes/local.txt", parameters=parameters),
    ]


def by_name(chart):
    return {point.name: point for point in chart.points}


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


def test_five_hundred_points_take_a_second():
    rng = np.random.default_rng(6)
    errors = 10 ** rng.uniform(-6, -1, 500)
    times = [list(1e-3 / size * rng.lognormal(0, 1) * rng.lognormal(0, 0.05, 6)) for size in errors]
    pareto.shares(times[:5], errors[:5])
    found, took = cpu_time.seconds(lambda: pareto.shares(times, errors))
    assert took < 1 and 1 < found.sum() < 500


def test_names_say_what_is_not_as_by_default(load, cell):
    told = [
        *cell("cpp", [1], 0.1, sampler="jittered", samples=8, precision="float32"),
        *cell("cpp", [1], 0.1, cutoff=2.0**-10, depth=4),
        *cell("cpp", [1], 0.1, cutoff=0.003),
        *cell("cpp", [1], 0.1, sampler="adaptive", adaptive_threshold=0.02, sphere="textbook"),
        *cell("numba", [1], 0.1, floating_point="fast", walk="stack", samples=4),
    ]
    areas, centres = pareto.charts(load(told, **FACTS))
    assert list(by_name(areas)) == ["cpp, float32, jittered 8 × 8", "cpp, textbook spheres, adaptive, threshold 0.02"]
    assert areas.view.label.endswith("areas of pixels") and centres.view.label.endswith("centres of pixels")
    assert list(by_name(centres)) == [
        "cpp, cut-off 2⁻¹⁰, depth 4",
        "cpp, cut-off 0.003",
        "numba, fast floating point, stack walk",
    ]


def test_a_view_has_one_truth(load, cell):
    told = [
        told
        for depth, feelers, side in itertools.product((3, 10), (0, 4, 9), (64, 128))
        for told in cell(
            "cpp", [1], 0.1, depth=depth, feelers=feelers, width=side, height=side, region=f"0,0,{side},{side}"
        )
    ]
    told += [*cell("cpp", [1], 0.1, scene="scenes/b.txt"), *cell("cpp", [1], 0.1, scene="scenes/b.txt", seed=3)]
    with_depth = method.views(load(told, **FACTS))
    assert sorted(len(seen.cells) for seen in with_depth) == [2, 2, 2, 4, 4]
    own = {**FACTS, "experiment": ASKED | {"reference": None}}
    assert len(method.views(load(told, name="own", **own))) == 9
    assert len({seen.label for seen in with_depth}) == 5
    for seen in with_depth:
        assert len({bool(cell.parameters["feelers"]) for cell in seen.cells}) == 1


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
    assert "no method" in str(chart.cheapest(run, 1e-3)) and "is known to 0.00012" in str(chart.cheapest(run, 1e-4))


def test_budgets_are_a_table_and_a_file(load, many, tmp_path):
    run = load(many, **FACTS)
    text = budget_table.write(run, tmp_path)
    with open(tmp_path / "budgets.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 * len(pareto.BUDGETS)
    exact = next(row for row in rows if row["view"] == "local" and float(row["budget"]) == 1e-9)
    assert exact["variant"] == "cpp-threads" and exact["method"] == "contract floating point"
    assert f"`{exact['command']}`" in text
    assert "| 1/255 |" in text and "unavailable: the truth is known to 0.00012 only" in text
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


def test_a_floor_is_drawn_where_samples_no_longer_help(load, cell):
    def line(variant, errors, **more):
        return [
            told
            for n, size in zip((1, 2, 4, 8), errors, strict=True)
            for told in cell(variant, [n * n] * 6, size, sampler="jittered", samples=n, **more)
        ]

    told = [
        *line("cpp", (0.08, 0.03, 0.0201, 0.02), cutoff=0.01), *line("numba", (0.08, 0.03, 0.01, 0.0035), cutoff=0.01),
        *line("cpp", (0.08, 0.03, 0.0201, 0.02)), *line("numpy", (0.01, 1e-3, 3e-4, 3e-4), cutoff=0.01),
    ]  # fmt: skip
    (chart,) = pareto.charts(load(told, **FACTS))
    found = {(curve.variant, curve.family): pareto.bias_floor(chart, curve) for curve in chart.curves}
    cut = "jittered n × n, cut-off 0.01"
    assert found == {("cpp", cut): 0.02, ("numba", cut): None, ("cpp", "jittered n × n"): None, ("numpy", cut): None}


def test_the_section_holds_every_point_and_its_command(load, many, tmp_path):
    run = load(many, **FACTS)
    text = pareto_figure.write(run, tmp_path)
    local, mirrors = sorted(pareto.charts(run), key=lambda chart: chart.view.label)
    assert (local.view.label, mirrors.view.label) == ("local", "mirrors")
    for chart in (local, mirrors):
        for point in chart.front:
            line = next(line for line in text.splitlines() if line.startswith(f"| {point.number} | {point.name} |"))
            assert line.endswith(f"| `{command.of(run, point.cell)}` |")
    assert "- numba-cuda, one sample" not in text and "- numba-cuda: unsupported: has no sampler" in text
    assert "largest difference outside the mask is 2.1e-13" in text and "standard error is 0.00012" in text
    assert "numpy; numba" in text.split("Never worth the time")[1]
    for path, chart in ((tmp_path / "pareto-1-local.csv", local), (tmp_path / "pareto-0-mirrors.csv", mirrors)):
        with open(path, newline="") as file:
            rows = list(csv.DictReader(file))
        assert len(rows) == len(chart.view.cells)
        for row in rows:
            assert all(value or name in ("note",) for name, value in row.items()), row
            assert row["command"].startswith("rayrace render experiments/scenes/")
            assert row["measured_by"].startswith("rayrace run experiments/a.toml --only")
        assert sum(row["number"] != "NaN" for row in rows) == len(chart.front)


def test_every_point_of_the_drawing_tells_its_command(load, many, tmp_path):
    run = load(many, **FACTS)
    pareto_figure.write(run, tmp_path)
    for number, chart in enumerate(pareto.charts(run)):
        text = (tmp_path / f"pareto-{number}-{chart.view.label}.svg").read_text()
        found = dict(re.findall(r'<g id="method-(\d+)">\s*<title>(.*?)</title>', text))
        assert len(found) == len(chart.points) > 10
        for place, point in enumerate(chart.points):
            told = found[str(place)].replace("&amp;", "&")
            assert command.of(run, point.cell) in told and point.name in told
            assert told.startswith(f"{point.number}: ") == bool(point.number)


def test_twice_the_same_bytes(load, many, tmp_path):
    outs = tmp_path / "a", tmp_path / "b"
    for out in outs:
        out.mkdir()
        pareto_figure.write(load(many, name=f"run-{out.name}", **FACTS), out)
    files, again = (sorted(path.name for path in out.iterdir()) for out in outs)
    assert len(files) == 6 and files == again
    for file in files:
        assert (outs[0] / file).read_bytes() == (outs[1] / file).read_bytes(), file


def shown(figure):
    """Every text of a figure and its box; matplotlib keeps ticks beyond the ends, which it does not draw."""
    figure.canvas.draw()
    texts = [*figure.texts, *(text for legend in figure.legends for text in legend.get_texts())]
    for axes in figure.axes:
        texts += [*axes.texts, axes.xaxis.label, axes.yaxis.label]
        for axis in (axes.xaxis, axes.yaxis):
            low, high = axis.get_view_interval()
            ticks = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
            texts += [tick.label1 for tick in ticks if low <= tick.get_loc() <= high]
    return [(text.get_text(), text.get_window_extent()) for text in texts if text.get_text().strip()]


@pytest.mark.parametrize("crowded", [False, True])
def test_no_two_texts_meet(load, many, cell, jittered, crowded):
    more = []
    for n in range(12 * crowded):  # a front of points that are close together, and float32 close to a visible step
        more += cell(
            "cpp", [0.01 * 1.04**n] * 6, 0.003 * 0.93**n, False, "scenes/local.txt", precision="float32", seed=n
        )
        more += jittered("cpp", 0.04 * 0.95**n, cutoff=2.0 ** -(4 + n))
    run = load([*many, *more], **FACTS)
    for chart in pareto.charts(run):
        with style.styled():
            figure = pareto_figure.draw(run, chart)
            boxes = shown(figure)
        assert len(boxes) > 20
        for (text, box), (other, beside) in itertools.combinations(boxes, 2):
            assert not box.padded(-2).overlaps(beside.padded(-2)), (text, other)
        for text, box in boxes:
            assert figure.bbox.contains(box.x0, box.y0) and figure.bbox.contains(box.x1, box.y1), text


def test_a_run_without_errors_has_no_section(load, record, tmp_path):
    old = [
        *(record("cpp", n) for n in range(3)),
        record("cpp", point={"depth": 9}, parameters=record("")["parameters"] | {"depth": 9}),
    ]
    run = load(old)
    assert pareto_figure.write(run, tmp_path) == budget_table.write(run, tmp_path) == ""
    assert run.repetitions["error_rmse"].isna().all() and run.repetitions["bound_max"].isna().all()


def test_errors_and_their_reasons_are_columns(record):
    bound = {"radiance": 2.0, "max": 0.5, "mean": 0.1, "dropped_file": "x"}
    row = repetition.row(record("cpp", error=error(0.25), bound=bound))
    assert (row["error_rmse"], row["error_max"], row["standard_error"], row["truth_pictures"]) == (
        0.25,
        2.25,
        NOISE,
        64,
    )
    assert (row["error_flip"], row["no_error_flip"], row["no_error"]) == (None, "too small", None)
    assert (row["bound_max"], row["bound_mean"]) == (0.5, 0.1)
    row = repetition.row(record("cpp", error={"unavailable": "nobody can"}))
    assert (row["error_rmse"], row["no_error"], row["bound_max"]) == (None, "nobody can", None)
    assert set(row) <= set(repetition.COLUMNS) | {"pass"}


def test_nothing_drawn_says_why(load, cell, tmp_path):
    told = [{**one, "error": {"unavailable": "no judge here"}} for n in (1, 2) for one in cell("cpp", [1], 0, seed=n)]
    text = pareto_figure.write(load(told, **FACTS), tmp_path)
    assert "unavailable: nothing has both a time and an error" in text and "no judge here" in text


def test_commands_in_tables_stay_commands():
    assert pareto_table.code("a | b") == "`a \\| b`"
    assert pareto_table.code("echo `x`") == "`` echo `x` ``"
