"""Two runs compared: every verdict, and what must be known before a ratio is read. Ratios can be checked by hand."""

import itertools
import json
import math
import re

import command_line
import numpy as np
import pytest

from harness.errors import UserError
from reports.compare import compare, drift, gate
from reports.compare import text as compare_text

TIMES = (1.0, 1.01, 1.02, 1.03, 1.04)  # s, of five processes
STILL = "still"  # a variant that is the same in both runs, and tells that the machine did not drift
PICTURE = np.linspace(0, 1, 48).reshape(4, 4, 3)


@pytest.fixture
def cell(record):
    """Records of a cell: one a process, whose steady frames take the given times."""

    def make(variant, times=TIMES, factor=1.0, **changes):
        return [record(variant, n, (9.0, factor * t, factor * t), **changes) for n, t in enumerate(times)]

    return make


@pytest.fixture
def compared(make_run, cell):
    """A function that compares runs of two lists of records; facts of each run may be given.

    All renderers of the second run are new versions. still: seconds a frame that a variant which has not changed takes
    in the first and in the second run.
    """

    fresh = itertools.count()

    def make(records_a, records_b, facts_a=None, facts_b=None, still=(1.0, 1.0)):
        number, records_b = next(fresh), [record | {"renderer_version": "w"} for record in records_b]
        first, second = ([*cell(STILL, (time,) * 5)] if time else [] for time in still)
        a = make_run(records_a + first, f"a{number}", **(facts_a or {}))
        return compare.compare(a, make_run(records_b + second, f"b{number}", **(facts_b or {})))

    return make


def verdicts(comparison):
    found = {row.name.split(",")[0]: row.verdict for row in comparison.rows}
    return {variant: verdict for variant, verdict in found.items() if variant != STILL}


def paired(cell, apart, factor=1.0):
    """Of the A/A pair of cpp, whose second processes take `apart` times as long as the first: records, facts."""
    again = cell("cpp", factor=apart * factor, **{"pass": "pair", "picture": None, "series": None})
    return again, {"pair": {"cell": "key-cpp", "label": "cpp"}}


def test_faster_slower_not_resolved(compared, cell):
    found = compared(
        cell("cpp") + cell("numba") + cell("numpy") + cell("python"),
        cell("cpp", factor=1.2) + cell("numba", factor=0.8) + cell("numpy", TIMES[::-1]) + cell("rust"),
    )
    expected = {"cpp": "slower", "numba": "faster", "numpy": "not resolved"}
    assert verdicts(found) == {**expected, "python": "only in A", "rust": "only in B"}
    slower = found.rows[0]
    assert (slower.a.value, slower.b.value) == (1.02, pytest.approx(1.2 * 1.02))
    assert slower.ratio.value == pytest.approx(1.2) and 1.1 < slower.ratio.low < 1.2 < slower.ratio.high < 1.3
    assert found.counts == {"slower": 1, "faster": 1, "not resolved": 2, "only in A": 1, "only in B": 1}


@pytest.mark.parametrize("noisy", ["a", "b"])
def test_the_larger_noise_floor_counts(compared, cell, noisy):
    """The pair of one run differs by 30 %, that of the other by 1 %: 20 % are not resolved, 50 % are."""
    apart = {"a": 1.01, "b": 1.01, noisy: 1.3}
    first, second = paired(cell, apart["a"]), paired(cell, apart["b"], 1.2)
    found = compared(
        cell("cpp") + cell("numba") + first[0],
        cell("cpp", factor=1.2) + cell("numba", factor=1.5) + second[0],
        first[1], second[1],
    )  # fmt: skip
    assert verdicts(found) == {"cpp": "not resolved", "numba": "slower"}
    assert found.floor == pytest.approx(0.3)
    assert "30 %" in compare_text.heading(found)[-2] and "the larger one is used" in compare_text.heading(found)[-2]


def test_without_a_noise_floor_the_interval_decides_and_says_so(compared, cell):
    facts = {"pair": {"unavailable": "its noise floor needs 5 processes"}}
    found = compared(cell("cpp"), cell("cpp", factor=1.02), facts, {})
    assert found.floor is None
    line = compare_text.heading(found)[-2]
    assert "A unavailable: its noise floor needs 5 processes; B unavailable: " in line
    assert "only the intervals decide" in line
    found = compared(cell("cpp") + paired(cell, 1.1)[0], cell("cpp", factor=1.2), paired(cell, 1.1)[1])
    assert found.floor == pytest.approx(0.1) and found.floors[1].value is None


def masked(which):
    agreement = {
        "reference": "judge", "reference_file": "pictures/r.reference.npy", "mask_file": f"pictures/{which}.mask.npy",
        "wrong": None, "max_outside": 2e-15, "max_inside": None, "rmse": 0.0, "bad_pixels": 0.0, "mask_fraction": 0.25,
        "tolerance": 1e-9,
    }  # fmt: skip
    return {"agreement": agreement, "picture": {"file": f"pictures/{which}.npy"}}


def test_a_faster_renderer_with_another_picture_is_no_win(make_run, cell):
    """Off by 0.5, 0.25 and 0.125 in one channel of a pixel each, and by 0.001 in a fourth; of the first three the first
    is in A's mask and the second in B's.
    """
    other, mask_a, mask_b = PICTURE.copy(), np.zeros((4, 4), bool), np.zeros((4, 4), bool)
    other[0, 0, 0] += 0.5
    other[0, 1, 1] += 0.25
    other[0, 2, 2] -= 0.125
    other[3, 3, 0] -= 0.001
    mask_a[0, 0] = mask_b[0, 1] = True
    still, files = cell(STILL, (1.0,) * 5), {"pictures/b.npy": other, "pictures/b.mask.npy": mask_b}
    a = make_run([*cell("cpp", **masked("a")), *still], "a", {"pictures/a.npy": PICTURE, "pictures/a.mask.npy": mask_a})
    b = make_run([*cell("cpp", factor=0.5, renderer_version="w", **masked("b")), *still], "b", files)
    found = compare.compare(a, b)
    row = found.rows[0]
    assert (row.verdict, row.time) == ("picture changed", "faster")
    assert found.counts == {"picture changed": 1, "not resolved": 1}
    assert (row.picture.pixels, row.picture.differing, row.picture.beyond, row.picture.beyond_outside) == (16, 4, 3, 1)
    assert row.picture.largest == pytest.approx(0.5)
    assert row.picture.rmse == pytest.approx(math.sqrt((0.25 + 0.0625 + 0.015625 + 1e-6) / 48))
    line = compare_text.line_of(row)
    assert line.startswith("picture changed (faster): cpp, comparison: 1.02 s -> 0.51") and "B / A = 0.5" in line
    assert line.endswith(
        "picture: 4 of 16 pixels differ, by 0.5 at most (RMSE 0.083), 3 by more than 1/255 (outside both masks: 1)"
    )
    (b / "pictures" / "b.mask.npy").unlink()
    row = compare.compare(a, b).rows[0]
    assert row.verdict == "picture changed" and row.picture.largest is None
    assert "the difference is unavailable: " in compare_text.line_of(row)


def test_what_is_not_comparable_and_why(compared, cell, bad):
    ok = cell("cpp")[0]["parameters"]
    changes = {
        "failed": ({}, [bad("failed", "failed", "exit 1: it broke")], "in B: failed: exit 1: it broke"),
        "exhibit": ({"unranked": "exhibit: why"}, None, "in A: exhibit: why; in B: exhibit: why"),
        "scene": ({"scene_version": "1"}, cell("scene", scene_version="2"), "the content of the scene changed"),
        "depth": ({}, cell("depth", parameters=ok | {"depth": 5}), "another picture was asked for: depth 3 -> 5"),
        "few": ({}, cell("few", TIMES[:4]), "no interval from 4 processes"),
    }
    found = compared(
        [record for name, (same, _, _) in changes.items() for record in cell(name, **same)] + cell("cpp"),
        [record for name, (same, b, _) in changes.items() for record in b or cell(name, **same)] + cell("cpp"),
    )
    rows = {row.name.split(",")[0]: row for row in found.rows}
    for name, (_, _, reason) in changes.items():
        assert (rows[name].verdict, rows[name].reason) == ("not comparable", reason), name
        assert reason in compare_text.line_of(rows[name])
    assert rows["few"].ratio.value == pytest.approx(1.015 / 1.02) and rows["few"].ratio.low is None
    assert found.counts == {"not resolved": 2, "not comparable": 5}


def test_one_frame_has_no_steady_time_but_a_picture(compared, record):
    found = compared([record("cpp", frames=[1.0])], [record("cpp", frames=[0.5])])
    assert verdicts(found) == {"cpp": "not comparable"} and "no steady" in found.rows[0].reason
    assert found.rows[0].picture.same


@pytest.mark.parametrize(
    ("off", "place", "changed"), [(1e-12, (1, 1), False), (1e-8, (1, 1), True), (0.5, (0, 0), False)]
)
def test_a_picture_is_another_where_the_judge_would_say_so(make_run, cell, off, place, changed):
    """The tolerance is 1e-9, and the first pixel is in the mask."""
    other, mask = PICTURE.copy(), np.zeros((4, 4), bool)
    other[place] += off
    mask[0, 0] = True
    a = make_run(cell("cpp", **masked("a")), "a", {"pictures/a.npy": PICTURE, "pictures/a.mask.npy": mask})
    b = make_run(cell("cpp", factor=0.5, **masked("b")), "b", {"pictures/b.npy": other, "pictures/b.mask.npy": mask})
    (row,) = compare.compare(a, b).rows
    assert row.verdict == ("picture changed" if changed else "not resolved") and not row.picture.same
    assert "1 of 16 pixels differ" in compare_text.line_of(row)


def test_what_broke_does_not_pass_a_gate(make_run, cell, bad):
    a = make_run(cell("cpp") + cell("numba"), "a")
    b = make_run([*cell("cpp"), bad("numba", "failed", "exit 1: it broke")], "b")
    for runs, code in (((a, b), 1), ((b, a), 0), ((b, b), 0)):
        done = command_line.rayrace("compare", *runs, "--fail-slower", "50", code=code)
        assert ("no longer ok: numba" in done.stderr) == (code == 1)


def test_what_differs_between_the_runs(make_run, cell):
    a = make_run(cell("cpp") + cell("numba"), "a")
    facts = json.loads((a / "run.json").read_text())
    environment = facts["environment"] | {"cpu": "another", "packages": {"numpy": "3"}, "commit": "def"}
    faster = cell("cpp", parameters=cell("cpp")[0]["parameters"] | {"threads": 2}, renderer_version="w")
    b = make_run(faster + cell("numba"), "b", environment=environment, order="sequential")
    found = compare.compare(a, b)
    assert found.machine == ["cpu: a processor -> another"]
    assert found.others == [
        "packages.numpy: 2 -> 3", "commit: abc -> def", "order: unknown -> sequential", "renderer of cpp: v -> w",
        "cpp: threads: 1 -> 2",
    ]  # fmt: skip
    text = compare_text.heading(found)
    assert any(line.startswith("WARNING: the machines differ") for line in text)
    assert {row.verdict for row in found.rows} == {"not resolved"}
    same = compare.compare(a, a)
    assert same.machine == same.others == [] and "WARNING" not in "".join(compare_text.heading(same))


def test_the_command_line(make_run, cell, tmp_path):
    still, new = cell(STILL, (1.0,) * 5), {"renderer_version": "w"}
    a = make_run(cell("cpp") + cell("numba") + still, "a")
    b = make_run(cell("cpp", factor=1.2, **new) + cell("numba", factor=0.5, **new) + still, "b")
    done = command_line.rayrace("compare", a, b)
    lines = done.stdout.splitlines()
    assert lines[-4].startswith("slower: cpp, comparison: 1.02 s -> 1.22 s, B / A = 1.2")
    assert lines[-3].startswith("faster: numba, comparison: ") and lines[-1] == "1 slower, 1 faster, 1 not resolved"
    told = json.loads(command_line.rayrace("compare", a, b, "--json").stdout)
    assert told["counts"]["slower"] == 1 and told["cells"][0]["ratio"]["value"] == pytest.approx(1.2)
    assert told["cells"][0]["verdict"] == "slower" and told["floor"] is None and told["drift"]["value"] == 0
    done = command_line.rayrace("compare", a, b, "--fail-slower", "10", code=1)
    assert done.stderr == "slower by more than 10 %: cpp, comparison\n"
    assert done.stdout.splitlines()[-1] == "gate: fail: slower by more than 10 %: cpp, comparison"
    assert not command_line.rayrace("compare", a, b, "--fail-slower", "25").stderr
    assert not command_line.rayrace("compare", b, b, "--fail-slower", "0").stderr


def test_a_cell_that_did_not_change_is_neither_faster_nor_slower(make_run, cell):
    """The same renderer takes 20 % longer: that is the machine, whatever the intervals are."""
    a, b = make_run(cell("cpp"), "a"), make_run(cell("cpp", factor=1.2), "b")
    found = compare.compare(a, b)
    assert verdicts(found) == {"cpp": "not resolved"} and found.rows[0].ratio.low > 1.1
    assert found.drift.value > 0.2 and found.drift.source.endswith("by 1 cell that did not change")
    assert not command_line.rayrace("compare", a, b, "--fail-slower", "0", code=0).stderr


@pytest.mark.parametrize(
    "drift, verdict", [(1.0, "slower"), (1.05, "slower"), (1.2, "not resolved"), (0.8, "not resolved")]
)
def test_a_change_counts_beyond_the_drift(compared, cell, drift, verdict):
    """The interval of the cell that changed is from 1.15 to 1.25, or so."""
    found = compared(cell("cpp"), cell("cpp", factor=1.2), still=(1.0, drift))
    assert verdicts(found) == {"cpp": verdict}
    assert found.drift.value == pytest.approx(max(drift, 1 / drift) - 1)
    if verdict == "slower":
        low = 100 * (found.rows[0].ratio.low / (1 + found.drift.value) - 1)
        high = 100 * (found.rows[0].ratio.high * (1 + found.drift.value) - 1)
        limits = low - 0.1, low + 0.1, high - 0.1, high + 0.1
        told = [gate.of_comparison(found, percent).verdict for percent in limits]
        assert told == [gate.FAIL, gate.UNKNOWN, gate.UNKNOWN, gate.PASS]


def test_without_a_drift_nothing_is_resolved_and_no_gate_passes(make_run, cell):
    a, b = make_run(cell("cpp"), "a"), make_run(cell("cpp", factor=1.5, renderer_version="w"), "b")
    found = compare.compare(a, b)
    assert verdicts(found) == {"cpp": "not resolved"} and found.drift.value is None
    assert "rayrace run EXPERIMENT --against COMMIT" in compare_text.heading(found)[-1]
    assert "--against" in command_line.rayrace("compare", a, b, "--fail-slower", "5", code=2).stderr


def test_another_machine_has_no_drift(make_run, cell):
    environment = json.loads((make_run(cell("cpp"), "a") / "run.json").read_text())["environment"]
    b = make_run(cell("cpp", factor=2.0), "b", environment=environment | {"packages": {"numpy": "3"}})
    found = compare.compare(b.parent / "a", b)
    assert verdicts(found) == {"cpp": "not resolved"} and not found.rows[0].unchanged
    assert found.drift.source == "unknown: machine or software changed (packages.numpy: 2 -> 3)"


@pytest.mark.parametrize("count, told", [(drift.LEAST_RUNS - 2, None), (drift.LEAST_RUNS - 1, 0.1)])
def test_the_drift_of_earlier_runs(make_run, cell, count, told):
    """Runs of the version of A lie beside it, up to 10 % apart; one of another renderer does not count."""
    for number in range(count):
        make_run(cell("cpp", (1 + 0.1 * number / (count - 1),) * 5), f"earlier{number}")
    make_run(cell("cpp", (9.0,) * 5, renderer_version="x"), "other")
    a = make_run(cell("cpp", (1.05,) * 5), "a")
    b = make_run(cell("cpp", (1.05 * 1.15,) * 5, renderer_version="w"), "b")
    found = compare.compare(a, b)
    assert found.drift.value == (told and pytest.approx(told))
    assert verdicts(found) == {"cpp": "slower" if told else "not resolved"}


def test_wrong_use(make_run, cell, tmp_path):
    a, few = make_run(cell("cpp"), "a"), make_run(cell("cpp", TIMES[:2]), "few")
    assert "not a run" in command_line.rayrace("compare", a, tmp_path, code=2).stderr
    with pytest.raises(UserError, match="no cell has the same variant, scene and swept values"):
        compare.compare(a, make_run(cell("rust"), "rust"))
    assert gate.of_comparison(compare.compare(a, few), 5).verdict == gate.UNKNOWN


@pytest.mark.parametrize("width", [80, 160])
def test_the_table_on_a_terminal(compared, cell, bad, monkeypatch, capsys, width):
    """It fits, and what is long stands below it."""
    sweep = {"point": {"total_threads": 4096, "block_width": 16, "scene_memory": "constant"}}
    reason = "exit 1: a [long] story " + 20 * "of words "
    found = compared(
        cell("cpp", **sweep) + cell("python") + cell("numpy"),
        [*cell("cpp", factor=1.2, **sweep), bad("numpy", "failed", reason)],
    )
    monkeypatch.setenv("COLUMNS", str(width))
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    compare_text.show(found)
    out = re.sub("\x1b.*?m", "", capsys.readouterr().out)
    out = out[out.index("┏") :]
    assert "│ slower" in out and "│ only in A" in out and "│ 1.22" in out and "1.20 [" in out
    assert "numpy, comparison: in B: failed: exit 1: a [long] story of words" in out
    assert max(map(len, out.splitlines())) <= width


VALGRIND = {
    "tool": "valgrind", "version": "3.19.0", "width": 64, "height": 48, "rays": 4000, "instructions": 8e6,
    "spread": 1e-4, "smaller": "Valgrind is slow", "options": ["-mno-avx512f"], "environment": {},
}  # fmt: skip


@pytest.fixture
def counted(cell, bad):
    """A function that makes the records of a cell, and of its count, which differs from VALGRIND in some values."""

    def make(variant, reason="", **changes):
        told = {"counts": None if reason else VALGRIND | changes, "pass": "count"}
        return [*cell(variant), bad(variant, "unavailable" if reason else "ok", reason, **told)]

    return make


def test_more_instructions_are_more_by_a_hundredth(make_run, counted):
    a = make_run(counted("cpp") + counted("numba"), "a")
    b = make_run(counted("cpp", instructions=8.088e6) + counted("numba", instructions=7.9e6), "b")
    found = compare.compare(a, b)
    assert [row.counts.ratio for row in found.rows] == pytest.approx([1.011, 0.9875])
    assert "instructions 8e+06 -> 8.088e+06, B / A = 1.0110" in compare_text.line_of(found.rows[0])
    assert json.loads(compare_text.as_json(found))["cells"][0]["counts"]["b"] == 8.088e6
    done = command_line.rayrace("compare", a, b, "--fail-more-instructions", "1", code=1)
    assert done.stderr == "more instructions, by more than 1 %: cpp, comparison\n"
    for runs, percent in (((a, b), "1.2"), ((b, a), "2"), ((b, b), "0")):
        assert not command_line.rayrace("compare", *runs, "--fail-more-instructions", percent).stderr


@pytest.mark.parametrize(
    "changes, why",
    [
        ({"tool": "perf"}, "counted in another way: tool valgrind -> perf"),
        ({"version": "3.20"}, "counted in another way: version 3.19.0 -> 3.20"),
        ({"width": 32}, "counted in another way: width 64 -> 32"),
        ({"reason": "no program valgrind"}, "in B: no program valgrind"),
    ],
)
def test_a_gate_needs_counts_of_one_kind(make_run, cell, counted, changes, why):
    a, b = make_run(counted("cpp"), "a"), make_run(counted("cpp", **changes), "b")
    assert compare.compare(a, b).rows[0].counts.text == f"instructions not compared: {why}"
    found = gate.of_instructions(compare.compare(a, b), 1)
    assert found.verdict == gate.UNKNOWN and why in found.why


def test_a_gate_needs_counts(make_run, cell):
    plain = make_run(cell("cpp"), "plain")
    assert compare.compare(plain, plain).rows[0].counts is None
    done = command_line.rayrace("compare", plain, plain, "--fail-more-instructions", "1", code=2)
    assert "none of the runs counted any" in done.stdout.splitlines()[-1] and "measure.count=true" in done.stdout
