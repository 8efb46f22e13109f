"""Where hierarchies pay: frames, builds and crossings that can be checked by hand."""

import csv
from types import SimpleNamespace

import pytest
import report_tables
from drawn_files import drawn_files

from reports.run import results
from reports.run.cell import Missing
from reports.scaling import hierarchy
from reports.scaling.hierarchy import BreakEven

SCENE = "generated/balls.txt"
NONE = {10: 0.1, 40: 0.4, 160: 1.6}  # s a frame: 0.01 s an object
BVH = {10: 0.2, 40: 0.2, 160: 0.2, 640: 0.2}  # crosses at 20
BUILD = {10: 0.05, 40: 0.1, 160: 0.4, 640: 1.6}


@pytest.fixture
def told(record):
    """A function that gives rounds of 5 processes of both ways; times are s of a frame, builds s, by objects."""

    def make(variant="cpp", none=NONE, bvh=BVH, build=BUILD, scene=SCENE, **changes):
        rows = []
        for accel, times in (("none", none), ("bvh", bvh)):
            for (count, seconds), number in ((pair, n) for pair in times.items() for n in range(5)):
                phases = [["start", 0.0, 0.1], ["load", 0.1, 0.2]]
                if accel == "bvh" and build:
                    phases.append(["build", 0.2, 0.2 + build[count] * (0.9 + 0.05 * number)])
                more = {
                    "cell": f"{variant}-{accel}-{count}-{scene}", "scene": scene, "phases": phases, "series": None,
                    "point": {"size": count, "accel": accel}, "shapes": {"sphere": count - 1, "box": 1}, "lights": 3,
                    "parameters": {**record(variant)["parameters"], "accel": accel},
                    "picture": {"file": f"pictures/{variant}-{accel}-{count}.npy"},
                }  # fmt: skip
                rows.append(
                    record(variant, number, frames=[seconds * (0.98 + 0.01 * number)] * 3, **{**more, **changes})
                )
        return rows

    return make


def the(loaded):
    (line,) = hierarchy.lines_of(loaded)
    return line


def test_numbers_by_hand(load, told):
    line = the(load(told()))
    assert (line.scene, line.variant, line.label) == (SCENE, "cpp", "cpp")
    assert [point.objects for point in line.points] == [10, 40, 160, 640]
    ten, forty, many, most = line.points
    assert (forty.frames["none"].value, forty.frames["bvh"].value) == pytest.approx((0.4, 0.2))
    assert forty.built.value == pytest.approx(0.1) and forty.built.low == pytest.approx(0.09)
    assert forty.ratio.value == pytest.approx(2)
    assert hierarchy.pays_after(forty) == pytest.approx(0.5) and hierarchy.pays_after(many) == pytest.approx(2 / 7)
    assert "never: a frame is not faster" in str(hierarchy.pays_after(ten))
    assert "not in the run" in str(most.frames["none"]) and isinstance(hierarchy.pays_after(most), Missing)


def test_what_is_not_resolved_does_not_pay(load, told):
    """A median that is faster, with rounds on both sides of 1."""
    rows = told()
    for row in rows:
        if row["point"] == {"size": 40, "accel": "none"} and row["repetition"] == 4:
            row["frames_s"] = [0.1] * 3
    point = the(load(rows)).points[1]
    assert point.ratio.low < 1 < point.ratio.value
    assert "not resolved: whether a frame is faster" in str(hierarchy.pays_after(point))


def test_where_they_cross(load, told):
    """Straight lines in log-log: 0.1 n/10 without, 0.2 with."""
    crossing = hierarchy.break_even(the(load(told())))
    assert (crossing.objects, crossing.seconds, crossing.between) == (pytest.approx(20), pytest.approx(0.2), (10, 40))


def line_of(*times):
    """A line of (objects, s without, s with) alone."""
    points = []
    for count, none, bvh in times:
        both = None if None in (none, bvh) else (none, bvh)
        frames = {"none": Missing("it broke") if none is None else none, "bvh": bvh}
        ratio = SimpleNamespace(value=none / bvh) if both else None
        points.append(SimpleNamespace(objects=count, both=lambda both=both: both, frames=frames, ratio=ratio))
    return SimpleNamespace(points=points)


@pytest.mark.parametrize(
    ("times", "reason"),
    [
        ([(4, 1, 2), (8, None, 2)], "1 size with both times, 2 are needed: it broke"),
        ([], "0 sizes with both times, 2 are needed: not in the run"),
        ([(4, 1, 2), (8, 2, 3)], "do not cross: it is not faster at 8 objects"),
        ([(4, 2, 1), (8, 2, 2)], "do not cross: it is not faster at 8 objects"),
        ([(4, 2, 1), (8, 4, 2)], "do not cross: it is the faster method from 4 objects on"),
    ],
)
def test_where_they_do_not_cross(times, reason):
    found = hierarchy.break_even(line_of(*times))
    assert isinstance(found, Missing) and reason in str(found) and str(found).startswith("unavailable")


@pytest.mark.parametrize(
    ("times", "expected"),
    [
        ([(4, 1, 2), (16, 4, 2)], (8, (4, 16))),
        ([(4, 2, 2), (16, 8, 2)], (4, (4, 16))),  # as fast at 4, and faster above
        ([(1, 1, 2), (2, 3, 2), (4, 1, 2), (16, 4, 2)], (8, (4, 16))),  # the last of several
        ([(4, 1, 2), (8, None, 2), (16, 4, 2)], (8, (4, 16))),  # over a size that lacks one
    ],
)
def test_crossings(times, expected):
    found = hierarchy.break_even(line_of(*times))
    assert isinstance(found, BreakEven)
    assert (found.objects, found.between) == (pytest.approx(expected[0]), expected[1])


def test_lines_are_kept_apart(load, told):
    on = {**told()[0]["parameters"], "vector": "on"}
    rows = [*told(), *told("numba"), *told(scene="generated/icosphere.txt")]
    for accel in ("none", "bvh"):
        for row in told("cpp", none=NONE if accel == "none" else {}, bvh=BVH if accel == "bvh" else {}):
            row |= {"cell": row["cell"] + "-on", "point": {**row["point"], "vector": "on"}}
            rows.append(row | {"parameters": {**on, "accel": accel}})
    found = hierarchy.lines_of(load(rows))
    assert [(line.scene, line.label) for line in found] == [
        (SCENE, "cpp"), (SCENE, "cpp, vector = on"), (SCENE, "numba"), ("generated/icosphere.txt", "cpp"),
    ]  # fmt: skip
    assert {len(line.points) for line in found} == {4}


def test_what_is_missing_has_its_reason(load, told, bad):
    line = the(load(told(build=None)))
    assert str(line.points[1].built) == "unavailable: it reports no phase build"
    assert "no phase build" in str(hierarchy.pays_after(line.points[1]))
    rows = told()
    broken = [row for row in rows if row["point"] == {"size": 40, "accel": "bvh"}]
    for row in broken:
        keep = ("cell", "scene", "point", "parameters", "shapes", "lights")
        row |= bad("cpp", "failed", "it broke", row["repetition"], **{key: row[key] for key in keep})
    line = the(load(rows, name="again"))
    forty = line.points[1]
    for value in (forty.frames["bvh"], forty.built, forty.ratio):
        assert isinstance(value, Missing) and "it broke" in str(value)
    assert hierarchy.break_even(line).between == (10, 160)


def test_nothing_where_it_was_not_varied(make_run, record, told, tmp_path):
    for name, rows in (
        ("plain", [record("cpp")]),
        ("one way", told(none={})),
        ("one size", told(none={10: 0.1}, bvh={10: 0.2})),
    ):
        assert hierarchy.write(results.load(make_run(rows, name=name)), tmp_path) == ""


def test_in_the_report(section, told, tmp_path):
    rows = [*told(), *told("numba", none={10: 1.0, 40: 4.0}, bvh={10: 0.5, 40: 0.5})]
    text, figures = section(rows, hierarchy.TITLE)
    table, crossings = report_tables.tables(text.replace("\\", ""))
    assert [(row["renderer"], row["faster from"].partition(" on")[0], row["measured at"]) for row in crossings] == [
        ("cpp", "20.0 objects", "10 and 40 objects"),
        ("numba", "unavailable: they do not cross: it is the faster method from 10 objects", "unavailable"),
    ]
    row = next(row for row in table if (row["renderer"], row["objects"]) == ("cpp", "40"))
    assert [row[name] for name in ("frame, none", "frame, bvh", "none ÷ bvh")] == [
        "400 [392, 408] ms", "200 [196, 204] ms", "2.00, all equal",
    ]  # fmt: skip
    (axes,) = figures["hierarchy"].axes
    assert [axis.get_major_formatter()(100, None) for axis in (axes.xaxis, axes.yaxis)] == ["100", "100"]
    stars = [line for line in axes.lines if line.get_marker() == "*"]
    assert [(star.get_xdata()[0], star.get_ydata()[0]) for star in stars] == [(pytest.approx(20), pytest.approx(200))]
    curves = {(line.get_linestyle(), len(line.get_xdata())) for line in axes.lines if line.get_linewidth() == 1.2}
    assert curves == {("--", 3), ("-", 4), ("--", 2), ("-", 2)}
    with open(tmp_path / "hierarchy-break-even.csv", newline="") as file:
        first, second = csv.DictReader(file)
    assert float(first["break_even_objects"]) == pytest.approx(20) and first["note"] == ""
    assert second["break_even_objects"] == "NaN" and "do not cross" in second["note"]
    with open(tmp_path / "hierarchy-0-balls.csv", newline="") as file:
        told = {(row["variant"], row["point"], row["quantity"]): row for row in csv.DictReader(file)}
    assert float(told["cpp", "size = 160, accel = bvh", "frames_until_it_pays"]["value"]) == pytest.approx(2 / 7)
    assert float(told["cpp", "size = 640, accel = bvh", "build"]["value"]) == pytest.approx(1.6)
    assert told["cpp", "size = 640, accel = bvh", "frame_none"]["note"] == "unavailable: not in the run"


def test_same_run_same_bytes(make_run, told, tmp_path):
    folder = make_run([*told(), *told("numba")])
    files = []
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        hierarchy.write(results.load(folder), tmp_path / name)
        files.append({path.name: path.read_bytes() for path in sorted((tmp_path / name).iterdir())})
    assert files[0] == files[1]
    tables = {"hierarchy-0-balls.csv", "hierarchy-0-balls.tex", "hierarchy-break-even.csv"}
    assert set(files[0]) == tables | set(drawn_files("hierarchy"))
