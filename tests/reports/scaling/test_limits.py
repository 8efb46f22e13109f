"""How close to the limit: ratios, shares and efficiencies that can be checked by hand. All numbers are made up."""

import pytest
import report_tables
from drawn_files import drawn_files

from reports.run import results
from reports.run.results import Missing
from reports.scaling import limits

TESTS = 20 * 48  # of a frame: 20 rays of the made-up record, 48 spheres
TRACED = 0.75  # of a frame of POV-Ray
GAIN = 1.6  # of two threads, by the calibration
PEAK = {"float64": 1e6, "float32": 2e6, "scalar_float64": 1e5, "scalar_float32": 1e5, "bytes": 1e7}
# Of a frame, s, and the peak's speed, by cell: variant, renderer, threads, precision, vector.
CELLS = {
    ("cpp", "cpp", 1, "float64", "off"): 0.4,
    ("cpp-threads", "cpp", 2, "float64", "off"): 0.3125,
    ("cpp", "cpp", 1, "float64", "on"): 0.1,
    ("cpp", "cpp", 1, "float32", "on"): 0.05,
    ("povray", "povray", 1, "float64", "off"): 2.0,
}


def calibrated(threads, drift):
    one = {"threads": 1, **{kind: rate * drift for kind, rate in PEAK.items()}}
    both = {**{kind: rate * GAIN for kind, rate in one.items()}, "threads": 2}
    return {"one": one, "all": both if threads > 1 else one}


@pytest.fixture
def told(record):
    """A function that gives 5 rounds of CELLS on a machine whose speed differs from round to round."""

    def make(cells=CELLS, peaks=calibrated, **changes):
        rows = []
        for (variant, renderer, threads, precision, vector), seconds in cells.items():
            own = {"threads": threads, "precision": precision, "vector": vector}
            for number in range(5):
                drift = 1 + 0.1 * number
                rows.append(record(variant, number, frames=[seconds / drift] * 3) | {
                    "cell": f"{variant}-{precision}-{vector}", "renderer": renderer,
                    "point": {"precision": precision, "vector": vector},
                    "parameters": {**record(variant)["parameters"], **own},
                    "shapes": {"sphere": 48}, "used": {"features": [], "methods": {"accel": "none"}},
                    "frame_parts": [{"trace": TRACED * seconds / drift}] * 3 if variant == "povray" else None,
                    "peaks": peaks(threads, drift) if callable(peaks) else peaks, **changes,
                })  # fmt: skip
        return rows

    return make


def the(loaded):
    (group,) = limits.pictures(loaded)
    found = {(cell.variant, cell.parameters["precision"], group.vector(cell)): cell for cell in group.cells}
    return group, found


def test_ratios_by_hand(load, told):
    group, cells = the(load(told()))
    assert group.base is cells["cpp", "float64", "off"]
    assert group.over_base(group.base) == "1 (the baseline)"
    fast = group.over_base(cells["cpp", "float32", "on"])
    assert (fast.value, fast.low, fast.high, fast.processes) == pytest.approx((0.125, 0.125, 0.125, 5))
    assert group.faster_than_pov_ray(cells["cpp", "float32", "on"]).value == pytest.approx(40 * TRACED)
    assert group.faster_than_pov_ray(cells["povray", "float64", "off"]) == "1 (POV-Ray)"
    assert "povray-threads" in group.faster_than_pov_ray(cells["cpp-threads", "float64", "off"]).reason
    group, cells = the(load(told(frame_parts=None), name="untold"))
    assert group.faster_than_pov_ray(cells["cpp", "float32", "on"]) == Missing(limits.NO_TRACE)


def test_first_hits_are_beside_what_embree_searches(load, told, tmp_path):
    """Its frame takes 0.5 s, of which 0.2 s are its search."""
    hits = {("cpp", "cpp", 1, "float32", "off"): 0.4, ("embree", "embree", 1, "float32", "off"): 0.5}
    rows = told(hits)
    for row in rows:
        row["parameters"] |= {"kind": "rays", "width": 500, "height": 1, "region": "0,0,500,1"}
        if row["variant"] == "embree":
            row["frame_parts"] = [{"search": 0.4 * seconds} for seconds in row["frames_s"]]
    loaded = load(rows)
    group, cells = the(loaded)
    assert group.over_search(cells["cpp", "float32", "off"]).value == pytest.approx(2)
    assert group.over_search(cells["embree", "float32", "off"]).value == pytest.approx(2.5)
    text = limits.write(loaded, tmp_path)
    assert "time ÷ Embree's search" in text and "POV-Ray's tracing ÷ time" not in text
    group, cells = the(load(rows[:5], name="alone"))
    assert group.over_search(cells["cpp", "float32", "off"]).reason == "embree is not in the run"


def test_shares_follow_the_machine_of_each_round(load, told):
    """In a round in which the machine is 10 % faster, both are."""
    group, cells = the(load(told()))
    share = group.share(cells["cpp", "float32", "on"])
    assert (share.value, share.low, share.high) == pytest.approx([20 * TESTS / 0.05 / 2e6] * 3)
    assert group.share(cells["cpp-threads", "float64", "off"]).value == pytest.approx(20 * TESTS / 0.3125 / 1e6 / GAIN)
    rate = group.rate(cells["cpp", "float64", "on"])
    assert (rate.low, rate.value, rate.high) == pytest.approx([20 * TESTS / 0.1 * drift for drift in (1, 1.2, 1.4)])
    assert group.intensity(cells["cpp", "float32", "on"]) == pytest.approx(20 * TESTS / (16 * 12))
    assert group.intensity(cells["cpp", "float64", "on"]) == pytest.approx(20 * TESTS / (16 * 24))


COUNTED = {"sums": 5000, "products": 6000, "divisions": 700, "roots": 80, "functions": 9}


@pytest.fixture
def with_counts(told):
    """A function that gives the rows of `told`, and the count of cpp one ray after another: of operations alone, or
    with those of perf too."""

    def make(counts=None, operations=COUNTED, **changes):
        rows = told(**changes)
        first = next(row for row in rows if row["cell"] == "cpp-float64-off")
        done = {"status": "ok"} if counts else {"status": "unavailable", "reason": "no program perf"}
        return [*rows, first | {"pass": "count", "repetition": 0, "counts": counts, "operations": operations, **done}]

    return make


@pytest.mark.parametrize("changes", [{}, {"shapes": {"triangle": 320}}, {"used": {"methods": {"accel": "bvh"}}}])
def test_counted_operations_are_those_of_all_that_make_the_picture(load, with_counts, tmp_path, changes):
    loaded = load(with_counts(**changes))
    group, cells = the(loaded)
    for key, seconds in (
        (("cpp", "float64", "off"), 0.4),
        (("cpp", "float32", "on"), 0.05),
        (("povray", "float64", "off"), 2),
    ):
        assert group.rate(cells[key]).low == pytest.approx(11_780 / seconds)
    assert group.share(cells["cpp", "float32", "on"]).value == pytest.approx(11_780 / 0.05 / 2e6)
    assert "Gflop/s" in limits.write(loaded, tmp_path)


def test_operations_that_could_not_be_counted_are_those_of_tests(load, with_counts):
    group, cells = the(load(with_counts(operations={"unavailable": "failed: no"})))
    assert group.rate(cells["cpp", "float64", "off"]).low == pytest.approx(20 * TESTS / 0.4)
    group, cells = the(load(with_counts(operations=None, shapes={"box": 3}), name="boxes"))
    assert "measure.count" in group.rate(cells["cpp", "float64", "off"]).reason


def test_bytes_moved_are_misses_of_a_cache_or_the_working_set(load, with_counts):
    """The picture of 16 pixels has 384 bytes, the scene 800 in float64."""
    size = {"width": 4, "height": 4, "rays": 20, "spread": 0.0, "options": [], "environment": {}}
    perf = {"tool": "perf", "version": "6", "smaller": None, "cache_misses": 250, "instructions": 1, **size}
    group, cells = the(load(with_counts(perf, scene_bytes=800)))
    assert group.intensity(cells["cpp", "float64", "off"]) == pytest.approx(11_780 / (64 * 250))
    assert group.intensity(cells["cpp", "float32", "on"]) == pytest.approx(11_780 / (192 + 400))
    smaller = {**perf, "smaller": "Valgrind is slow"}
    group, cells = the(load(with_counts(smaller, scene_bytes=800), name="smaller"))
    assert group.intensity(cells["cpp", "float64", "off"]) == pytest.approx(11_780 / (384 + 800))


def test_efficiency_is_of_what_the_machine_gained(load, told):
    group, cells = the(load(told()))
    threads = cells["cpp-threads", "float64", "off"]
    assert group.speed_up(threads).value == pytest.approx(1.28)
    assert group.efficiency(threads).value == pytest.approx(1.28 / GAIN)
    assert group.efficiency(group.base).reason == "it has one thread"


@pytest.mark.parametrize(("used", "kind"), [("on", "float64"), ("off", "scalar_float64")])
def test_auto_is_held_against_what_it_took(load, told, tmp_path, used, kind):
    """The gain of the calibration's vectors, or of its numbers one at a time, which here is twice as large."""

    def peaks(threads, drift):
        found = calibrated(threads, drift)
        if threads > 1:
            found["all"] = {**found["all"], "scalar_float64": 2 * found["all"]["scalar_float64"]}
        return found

    own = {("cpp", "cpp", 1, "float64", "auto"): 0.4, ("cpp-threads", "cpp", 2, "float64", "auto"): 0.25}
    methods = {"accel": "none", "vector": used}
    loaded = load(told(own, peaks, used={"features": [], "methods": methods}))
    group, cells = the(loaded)
    ceiling = {"float64": GAIN, "scalar_float64": 2 * GAIN}[kind]
    assert group.efficiency(cells["cpp-threads", "float64", used]).value == pytest.approx(1.6 / ceiling)
    assert f"{used} (auto)" in limits.write(loaded, tmp_path)


def test_alone(load, told):
    group, cells = the(load(told({key: seconds for key, seconds in CELLS.items() if key[0] == "cpp-threads"})))
    (threads,) = cells.values()
    assert "readable cpp" in group.over_base(threads).reason and "one thread" in group.speed_up(threads).reason


def test_with_a_tree(load, told):
    group, _ = the(load(told(used={"features": [], "methods": {"accel": "bvh"}})))
    for value in (group.share, group.rate, group.intensity):
        assert isinstance(value(group.base), Missing) and "a tree is used" in value(group.base).reason


def test_without_a_compiler(load, told):
    group, cells = the(load(told(peaks={"unavailable": "calibration: no C++ compiler"})))
    assert group.share(group.base).reason == "calibration: no C++ compiler"
    assert group.efficiency(cells["cpp-threads", "float64", "off"]).reason == "calibration: no C++ compiler"


def test_a_part_of_the_picture_is_left_out(load, told):
    rows = told()
    for row in rows:
        row["parameters"] = {**row["parameters"], "region": "0,0,1,1"}
    assert limits.pictures(load(rows)) == []


def test_section(section, told):
    text, figures = section(told(), limits.TITLE)
    (table,) = report_tables.tables(text)
    row = next(row for row in table if (row["precision"], row["lanes"], row["threads"]) == ("float32", "on", "1"))
    assert row["renderer"] == "cpp" and row["time ÷ readable cpp"].startswith("0.125")
    figure = figures["limits-0-comparison"]
    top, below = figure.axes
    assert [label.get_text() for label in below.get_yticklabels()] == ["cpp-threads, float64"]
    assert "vectors, float32, 1 thread" in [note.get_text() for note in top.texts]
    assert "vectors, float32, 2 threads" in [note.get_text() for note in top.texts]


def test_no_section_without_peaks(section, told):
    text, figures = section(told(peaks=None), limits.TITLE)
    assert not text and not any(name.startswith("limits") for name in figures)


def test_the_same_again(make_run, told, tmp_path):
    folder = make_run(told())
    texts = []
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        limits.write(results.load(folder), tmp_path / name)
        texts.append({path.name: path.read_bytes() for path in (tmp_path / name).iterdir()})
    assert texts[0] == texts[1] and len(texts[0]) == 2 + len(drawn_files("one figure"))  # of which two are of its table
