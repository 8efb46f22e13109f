"""Sweeps: made-up runs whose lines, scales and crossings are known, and figures that show what the CSV file has."""

import csv
import math

import matplotlib.pyplot as plt
import numpy as np
import pytest
import seeds
from figure_lint import faults

from reports.paper import heat_map, style
from reports.scaling import crossing, sweep, sweep_figure
from reports.scaling.sweep import MEMORY, TIME

SIDES = (16, 32, 64, 128, 256)
A, B, C = 0.02, 1e-6, 3e-6  # s, and s a pixel: A + B p meets C p where p = A / (C - B) = 10,000: 100 × 100


@pytest.fixture
def swept(record):
    """A function that gives five processes a cell of a variant, whose time is `seconds` of its swept values."""

    def make(variant, points, seconds, spread=0.01, rng=None, **changes):
        rows = []
        for point in points:
            side = point.get("side", 4)
            size = {"width": side, "height": side, "region": f"0,0,{side},{side}"}
            values = {key: value for key, value in point.items() if key in ("depth", "samples", "threads", "cutoff")}
            name = f"{variant}-{'-'.join(map(str, point.values()))}".replace(" ", "-")
            for number in range(5):
                noise = 1 + spread * (number - 2 if rng is None else rng.normal())
                more = {
                    "cell": name, "point": point, "series": None, "lights": 3, "shapes": {"sphere": 48},
                    "picture": {"file": f"pictures/{name}.npy"},
                    "parameters": record(variant)["parameters"] | size | values, **changes,
                }  # fmt: skip
                rows.append(record(variant, number, frames=[seconds(**point) * noise] * 3, **more))
        return rows

    return make


def sides(values=SIDES):
    return [{"side": side} for side in values]


@pytest.fixture
def crossing_lines(swept):
    rows = swept("numba", sides(), lambda side: A + B * side**2)
    return rows + swept("cpp", sides(), lambda side: C * side**2)


def the(loaded):
    (panel,) = sweep.panels(loaded)
    return panel


def found(loaded, what=TIME):
    panels = sweep.panels(loaded)
    return [one for mine in sweep_figure.crossings(loaded, panels, what).values() for _, one in mine]


def test_lines_hold_the_medians_with_their_intervals(load, crossing_lines):
    panel = the(load(crossing_lines))
    assert (panel.axis.name, panel.label, panel.mark, panel.squares) == ("pixels", "", "", True)
    numba, cpp = panel.lines
    assert (numba.label, cpp.label) == ("numba", "cpp")
    assert [x for x, _ in cpp.points(TIME)] == [side**2 for side in SIDES]
    for x, value in cpp.points(TIME):
        assert (value.value, value.low, value.high) == pytest.approx((C * x, 0.98 * C * x, 1.02 * C * x))


def test_a_crossing_is_where_straight_lines_between_medians_meet_on_the_chart(load, crossing_lines):
    (one,) = found(load(crossing_lines))
    assert (one.line.label, one.other.label, one.between) == ("numba", "cpp", (64**2, 128**2))
    # By hand: on both logarithms, between 64² and 128².
    at = [math.log(side**2) for side in (64, 128)]
    mine, its = ([math.log(f(side**2)) for side in (64, 128)] for f in (lambda p: A + B * p, lambda p: C * p))
    share = (mine[0] - its[0]) / (mine[0] - its[0] - mine[1] + its[1])
    assert one.x == pytest.approx(math.exp(at[0] + share * (at[1] - at[0])))
    assert one.y == pytest.approx(math.exp(its[0] + share * (its[1] - its[0])))
    assert one.x == pytest.approx(A / (C - B), rel=0.15), "and near to where the two laws meet"


def test_a_crossing_in_words(load, crossing_lines):
    loaded = load(crossing_lines)
    (one,) = found(loaded)
    said = sweep_figure.words(the(loaded), TIME, one)
    assert said.startswith("numba overtakes cpp at about ")
    side = int(said.split("about ")[1].split(" ×")[0])
    assert side == float(f"{one.x**0.5:.2g}") and said.endswith(", between 64 × 64 and 128 × 128 pixels.")


def test_a_crossing_on_a_linear_axis(load, swept):
    """Even steps are linear: 1 + d and 4 - d / 2 meet at d = 2, where both are 3."""
    depths = [{"depth": depth} for depth in (1, 3, 5)]
    rows = swept("a", depths, lambda depth: 1 + depth) + swept("b", depths, lambda depth: 4 - depth / 2)
    (one,) = found(load(rows))
    assert (one.line.label, one.x, one.y, one.between) == ("b", pytest.approx(2), pytest.approx(3), (1, 3))


def test_what_does_not_resolve_the_order_on_both_sides_makes_no_crossing(load, swept):
    """Medians cross between 3 and 5, but the intervals at 5 and 7 overlap."""
    depths = [{"depth": depth} for depth in (1, 3, 5, 7)]
    rows = swept("a", depths, lambda depth: depth, spread=0.1)
    rows += swept("b", depths, lambda depth: 4 + depth * 0.1 if depth < 5 else 0.9 * depth, spread=0.1)
    assert found(load(rows)) == []


def test_a_crossing_over_values_that_are_not_resolved_is_between_those_that_are(load, swept):
    depths = [{"depth": depth} for depth in (1, 3, 5, 7)]
    rows = swept("a", depths, lambda depth: {1: 1, 3: 2, 5: 2.02, 7: 3}[depth], spread=0.02)
    rows += swept("b", depths, lambda depth: {1: 2, 3: 2.01, 5: 2, 7: 2}[depth], spread=0.02)
    (one,) = found(load(rows))
    assert one.line.label == "b" and one.between == (1, 7) and 3 < one.x < 5


def test_equal_lines_have_no_crossing(load, swept):
    rows = [row for name in "abc" for row in swept(name, sides(), lambda side: C * side**2)]
    assert found(load(rows)) == []


def test_noise_makes_no_crossing(load, swept):
    """Eight renderers that are equally fast but for 10 % of noise: 28 pairs, none of which crosses."""
    rng = np.random.default_rng(5)
    rows = [row for name in "abcdefgh" for row in swept(name, sides(), lambda side: C * side**2, 0.1, rng)]
    assert found(load(rows)) == []


def test_a_difference_below_the_noise_floor_orders_nothing(load, swept):
    """1 % apart on both sides, resolved by the intervals, but the A/A pair differs by 5 %."""
    depths = [{"depth": depth} for depth in (1, 3)]
    rows = swept("a", depths, lambda depth: 1.0, spread=0.001)
    rows += swept("b", depths, lambda depth: 1.01 if depth == 1 else 0.99, spread=0.001)
    assert len(found(load(rows, name="bare"))) == 1
    again = [row | {"pass": "pair", "frames_s": [1.05] * 3} for row in rows[:5]]
    paired = load(rows + again, name="paired", pair={"cell": rows[0]["cell"], "label": "a"})
    assert paired.floor.value == pytest.approx(0.05, rel=0.1) and found(paired) == []


def test_memory_crosses_too(load, swept):
    depths = [{"depth": depth} for depth in (1, 3)]
    rows = swept("a", depths, lambda depth: 1.0) + swept("b", depths, lambda depth: 1.0)
    for row in rows:
        most = {("a", 1): 1e6, ("a", 3): 9e6, ("b", 1): 4e6, ("b", 3): 5e6}[row["variant"], row["point"]["depth"]]
        row["memory"]["peak_bytes"] = most * (1 + 0.001 * row["repetition"])
    loaded = load(rows)
    (one,) = found(loaded, MEMORY)
    assert one.x == pytest.approx(1 + 2 * 3 / 7)  # 3 MB apart, then 4
    assert sweep_figure.words(the(loaded), MEMORY, one).startswith("b needs less memory than a at about depth 1.9")
    assert found(loaded) == []


@pytest.mark.parametrize(
    ("values", "name"),
    [
        ([1, 2, 3], "linear"), ([16, 32, 48, 64, 512], "log"), ([1, 2, 4], "log"), ([1, 2], "linear"),
        ([1, 20], "log"), ([0, 1, 2, 4, 8], "symlog"), ([0, 1, 2], "linear"), (range(1, 100), "linear"),
        ([5], "linear"), ([0, 0.5], "linear"), ([0.25, 0.5, 1, 2.01], "log"),
    ],
)  # fmt: skip
def test_scales(values, name):
    assert crossing.across(values).name == name


def test_scales_of_quantities():
    assert crossing.upright([1, 9]).name == "linear" and crossing.upright([1, 10]).name == "log"
    assert crossing.upright([0, 1, 10]) == crossing.Scale("symlog", 1) and crossing.upright([]).name == "linear"


def test_two_numbers_make_small_multiples(load, swept):
    points = [{"side": side, "depth": depth} for side in (16, 32, 64) for depth in (1, 2, 4)]
    rows = [row for name in "ab" for row in swept(name, points, lambda side, depth: 1e-6 * side**2 * depth)]
    panels = sweep.panels(load(rows))
    assert [(panel.axis.name, panel.label) for panel in panels] == [
        *(("pixels", f"depth {depth}") for depth in (1, 2, 4)),
        *(("depth", f"{side} × {side} pixels") for side in (16, 32, 64)),
    ]
    assert all([line.label for line in panel.lines] == ["a", "b"] for panel in panels)


def test_a_sweep_one_at_a_time_has_a_panel_for_each_number(load, swept):
    """The point in the middle is in every panel; a method is a line."""
    points = [{"side": 32, "depth": 2, "lights": 3} | more for more in (
        {}, {"side": 16}, {"side": 64}, {"depth": 0}, {"depth": 8}, {"lights": 12})]  # fmt: skip
    rows = []
    for kind in ("float64", "float32"):
        mine = [point | {"precision": kind} for point in points]
        made = swept("cpp", mine, lambda side, depth, lights, precision: 1e-6 * side**2 * (depth + lights))
        rows += [row | {"lights": row["point"]["lights"]} for row in made]
    panels = sweep.panels(load(rows))
    assert [panel.axis.name for panel in panels] == ["pixels", "depth", "lights"]
    assert panels[0].label == "depth 2, 3 lights"
    assert [[line.label for line in panel.lines] for panel in panels] == [["cpp, float64", "cpp, float32"]] * 3
    assert [panel.values for panel in panels] == [[16**2, 32**2, 64**2], [0, 2, 8], [3, 12]]


def test_a_line_is_named_by_methods_that_are_not_the_default(load, swept):
    kinds = {"walk": ("least", "stack"), "sampler": (None, "jittered"), "vector": ("off", "on")}
    rows = []
    for name, (_, other) in kinds.items():
        for side in (16, 32):
            plain = {key: values[0] for key, values in kinds.items()} | {"side": side}
            rows += swept("cpp", [plain | {name: other}], lambda side, **_: 1e-6 * side**2)
    labels = [line.label for line in the(load(rows)).lines]
    assert labels == ["cpp, walk stack", "cpp, sampler jittered", "cpp, in lanes"]


def test_lines_of_one_point_are_drawn_only_where_there_are_no_others(load, swept):
    rows = swept("cpp", sides(), lambda side: C * side**2) + swept("python", sides([16]), lambda side: C * side**2)
    panel = the(load(rows))
    assert [line.label for line in panel.lines] == ["cpp", "python"]
    assert [line.label for line in sweep_figure.lines(panel, TIME)] == ["cpp"]


LONG = "number {} of many walks whose names are so long that a legend has no room for two"


def test_many_panels_and_lines_fit_a_page(load, swept):
    rows = []
    for depth in range(20):
        for walk in (
            "least",
            *(
                f"{number} of many walks whose names are so long that a legend has no room for two"
                for number in range(15)
            ),
        ):
            points = [{"side": side, "depth": depth, "walk": walk} for side in (16, 32)]
            rows += swept("cpp", points, lambda side, **_: 1e-6 * side**2)
    loaded = load(rows)
    panels = sweep_figure.shown(sweep.panels(loaded))
    figure = sweep_figure.draw(loaded, panels, TIME, {})
    assert len(panels) == sweep_figure.MOST and figure.get_size_inches()[1] <= 12


def test_sizes_of_a_generated_scene_are_its_objects(load, swept):
    rows = swept("cpp", [{"size": size} for size in (1, 2, 3)], lambda size: 10.0**size)
    for row in rows:
        row["shapes"] = {"sphere": 9 ** row["point"]["size"], "polygon": 1}
    panel = the(load(rows))
    assert panel.axis.name == "objects" and panel.values == [10, 82, 730]


@pytest.mark.parametrize(
    "points",
    [
        [{}], [{"precision": "float64"}, {"precision": "float32"}], [{"seed": 1}, {"seed": 2}],
        [{"shadows": True}, {"shadows": False}], [{"region": "all"}, {"region": "one pixel"}], [{"depth": 3}],
        [{"case": "1"}, {"case": "2"}], [{"processes": 5}, {"processes": 6}],
    ],
)  # fmt: skip
def test_no_chart_where_no_number_varies(load, swept, tmp_path, points):
    loaded = load(swept("cpp", points, lambda **_: 1.0))
    assert sweep.panels(loaded) == [] and sweep_figure.write(loaded, tmp_path) == ""
    assert not list(tmp_path.glob("sweeps*"))


def test_no_chart_of_sizes_whose_region_has_the_same_pixels(load, swept):
    rows = swept("cpp", sides((16, 32)), lambda side: 1.0)
    for row in rows:
        row["parameters"] |= {"region": "0,0,8,8"}
    assert sweep.panels(load(rows)) == []


def rows_of(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_the_csv_has_what_is_drawn(load, crossing_lines, bad, tmp_path, drawn):
    size = {"parameters": crossing_lines[0]["parameters"]}
    loaded = load([*crossing_lines, bad("numba-cuda", "unavailable", "no device", point={"side": 16}, **size)])
    text = sweep_figure.write(loaded, tmp_path)
    assert "- numba-cuda (1 cell): unavailable: no device" in text
    assert "(1) numba overtakes cpp at about" in text.replace("\\", "")
    (axes,) = drawn["sweeps-time"].axes
    lines = [line for line in axes.lines if line.get_marker() == "o" and len(line.get_xdata()) > 1]
    assert axes.get_ylabel() == "steady frame (ms)"
    told = [row for row in rows_of(tmp_path / "sweeps.csv") if row["quantity"] == "time" and row["value"] != "NaN"]
    csv_points = {(float(row["x"]), round(1e3 * float(row["value"]), 9)) for row in told}
    assert csv_points == {(float(x), round(y, 9)) for line in lines for x, y in line.get_xydata()}
    assert len(told) == 2 * len(SIDES) and all(float(row["low"]) < float(row["value"]) for row in told)
    lost = [row for row in rows_of(tmp_path / "sweeps.csv") if row["line"] == "numba-cuda"]
    assert {row["quantity"] for row in lost} == {"time", "error", "memory", "rays"} and all(row["note"] for row in lost)
    (mark,) = [line for line in axes.lines if line.get_markersize() == 8]
    (row,) = rows_of(tmp_path / "sweeps-crossings.csv")
    assert mark.get_xydata()[0] == pytest.approx([float(row["x"]), 1e3 * float(row["y"])])


def test_bands_are_the_intervals(load, crossing_lines, tmp_path, drawn):
    sweep_figure.write(load(crossing_lines), tmp_path)
    numba, _ = drawn["sweeps-time"].axes[0].collections
    corners = numba.get_paths()[0].vertices
    ends = {tuple(corner) for corner in corners.round(6)}
    assert {(64.0**2, round(1e3 * share * (A + B * 64**2), 6)) for share in (0.98, 1.02)} <= ends


def test_a_quantity_that_does_not_vary_is_a_sentence(load, crossing_lines, tmp_path, drawn):
    text = sweep_figure.write(load(crossing_lines), tmp_path)
    assert set(drawn) == {"sweeps-time", "sweeps-memory"} or set(drawn) == {"sweeps-time"}
    assert "The error (RMSE, linear RGB) is 0.0625 everywhere." in text
    assert "The number of rays of a frame is 20 everywhere." in text


def test_what_has_no_value_says_why(load, crossing_lines, tmp_path, drawn):
    for row in crossing_lines:
        row["error"] = {"unavailable": "no truth was asked for"}
    text = sweep_figure.write(load(crossing_lines), tmp_path)
    assert "The error (RMSE, linear RGB) is unavailable: no truth was asked for." in text


@pytest.mark.parametrize(("power", "slopes"), [(1, ["slope 1"]), (2, ["slope 1", "slope 2"]), (0.1, [])])
def test_guides_have_their_slope(load, swept, tmp_path, drawn, power, slopes):
    sides = [{"side": side} for side in (10, 100, 1000)]
    rows = swept("a", sides, lambda side: 1e-6 * side ** (2 * power))
    rows += swept("b", sides, lambda side: 1e-2 * side ** (2 * power))
    sweep_figure.write(load(rows), tmp_path)
    figure = drawn["sweeps-time"]
    told = [text.get_text() for text in figure.legends[0].get_texts()]
    assert told == ["a", "b", *slopes]
    for line in figure.axes[0].lines:
        for slope in (1, 2):
            if line.get_color() == sweep_figure.GUIDES[slope]["color"]:
                (x0, y0), (x1, y1) = line.get_xydata()
                assert math.log(y1 / y0) / math.log(x1 / x0) == pytest.approx(slope)


def test_one_renderer_and_two_numbers_make_a_heat_map(load, swept, tmp_path, drawn):
    points = [{"side": side, "depth": depth} for side in (16, 32) for depth in (1, 2, 4)]
    sweep_figure.write(load(swept("cpp", points, lambda side, depth: side**2 * depth / 256)), tmp_path)
    axes = drawn["sweeps-map-0"].axes[0]
    told = {text.get_position(): text.get_text().split("\n")[0] for text in axes.texts}
    assert told == {(0, 0): "1.00", (0, 1): "2.00", (0, 2): "4.00", (1, 0): "4.00", (1, 1): "8.00", (1, 2): "16.0"}
    rows = [row for name in "ab" for row in swept(name, points, lambda side, depth: 1.0 * side * depth)]
    drawn.clear()
    sweep_figure.write(load(rows, name="two"), tmp_path)
    assert not any("map" in name for name in drawn), "two renderers are small multiples"


def test_a_simulator_is_drawn_only_where_it_is_alone_and_with_a_mark(load, swept, simulated, tmp_path, drawn):
    sim = {"unranked": simulated()["unranked"], "device": simulated()["device"]}
    rows = swept("numba-cuda", sides(), lambda side: C * side**2, **sim)
    alone = load(rows, name="alone")
    assert the(alone).mark == "simulated: times mean nothing"
    sweep_figure.write(alone, tmp_path)
    assert the(alone).mark in [text.get_text() for text in drawn["sweeps-time"].axes[0].texts]
    both = load(rows + swept("cpp", sides(), lambda side: A + B * side**2), name="both")
    assert [line.label for line in the(both).lines] == ["cpp"] and the(both).mark == ""


@pytest.mark.parametrize("draw", range(5))
def test_numbers_of_crossings_that_lie_close_do_not_lie_on_each_other(draw):
    print(seeds.again("tests/reports/scaling/test_sweep.py"))
    rng = np.random.default_rng(seeds.numbers("crossings", draw))
    clusters = np.array([(0, 0), (0.5, 1), (1, 0)]) + rng.uniform(-0.15, 0.15, (3, 2))
    places = clusters.repeat(3, axis=0) + rng.normal(0, 0.02, (9, 2))
    with style.styled():
        figure, axes = plt.subplots(figsize=(3, 2.5), layout="constrained")
        axes.set(xlim=(-0.2, 1.2), ylim=(-0.2, 1.2))
        figure.draw_without_rendering()
        sweep_figure._mark(axes, [(number, *place) for number, place in enumerate(places, 8)])
        assert faults(figure) == []
    plt.close(figure)


def test_2000_points_are_thinned_in_the_figure_and_whole_in_the_csv(load, swept, tmp_path, drawn):
    """20 depths of 100 sizes: 20 panels of sizes and 100 of depths, of which 12 are drawn."""
    points = [{"side": side, "depth": depth} for side in range(10, 110) for depth in range(20)]
    rows = swept("cpp", points, lambda side, depth: 1e-6 * side**2 * (1 + depth))
    text = sweep_figure.write(load([row for row in rows if row["repetition"] == 0]), tmp_path)
    assert "Shown are 12 of 120 panels" in text
    assert len(drawn["sweeps-time"].axes) == 12
    names = [axes.get_xlabel() for axes in drawn["sweeps-time"].axes]
    assert names.count("pixels") == names.count("depth") == 6
    told = [row for row in rows_of(tmp_path / "sweeps.csv") if row["quantity"] == "time"]
    assert len(told) == 2 * 2000
    ticks = [label.get_text() for label in drawn["sweeps-map-0"].axes[0].get_xticklabels()]
    assert len(ticks) == heat_map.MOST[0] and (ticks[0], ticks[-1]) == ("100", "11,881")
