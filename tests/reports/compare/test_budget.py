"""Runs held to a budget of instructions."""

import json
from pathlib import Path

import pytest
from compilers import needs_compiler

from harness.errors import UserError
from harness.system import counters
from reports import exporters
from reports.compare import budget, gate
from reports.run import results

COUNTS = {
    "tool": "valgrind", "version": "3.19.0", "width": 64, "height": 48, "rays": 4000, "instructions": 8e6,
    "spread": 1e-4, "smaller": "Valgrind is slow", "options": ["-mno-avx512f"], "environment": {},
}  # fmt: skip


@pytest.fixture
def counted(make_run, record, bad):
    """A function that makes a run with counts of some variants, or the reasons why they have none."""

    def make(name, **variants):
        rows = []
        for variant, counts in variants.items():
            reason = counts if isinstance(counts, str) else ""
            told = {"pass": "count", "counts": None if reason else COUNTS | counts}
            rows += [record(variant, 0), bad(variant, "unavailable" if reason else "ok", reason, **told)]
        return make_run(rows, name)

    return make


@pytest.fixture
def kept(counted, tmp_path):
    """The budget of cpp and numba."""
    exporters.write(counted("before", cpp={}, numba={}), "budget", tmp_path / "budget.json")
    return budget.read(tmp_path / "budget.json")


def held(run, kept):
    return {row.name.partition(",")[0]: row for row in budget.hold(results.load(run), kept)}


def test_more_by_more_than_its_per_cent_is_over(counted, kept):
    found = held(counted("now", cpp={"instructions": 8.079e6}, numba={"instructions": 8.081e6}), kept)
    assert [row.over for row in found.values()] == [False, True]
    assert found["numba"].text == "numba, comparison: instructions 8e+06 -> 8.081e+06, run / budget = 1.0101"
    assert not held(counted("less", cpp={"instructions": 1.0}, numba={}), kept)["cpp"].over


def test_a_cell_that_is_no_longer_counted_is_over_and_others_are_told(counted, kept):
    found = held(counted("now", cpp={}, numba="no tool", rust={}), kept)
    assert {name: row.over for name, row in found.items()} == {"cpp": False, "numba": True, "rust": False}
    assert "in the run: no tool" in found["numba"].text and "the budget does not have it" in found["rust"].text
    found = held(counted("fewer", cpp={}), kept)
    assert not found["numba"].over and "the run does not have it" in found["numba"].text


def test_counts_of_another_tool_are_no_verdict(counted, kept):
    run = counted("now", cpp={"version": "3.20", "instructions": 9e9}, numba={"version": "3.20"})
    held_to = gate.of_budget(budget.hold(results.load(run), kept), kept.percent)
    assert held_to.verdict == gate.UNKNOWN and "version 3.19.0 -> 3.20" in gate.line([held_to])
    assert "write a new budget" in gate.line([held_to])


def test_the_gate_of_a_budget(counted, kept):
    for name, cpp, verdict, line in (
        ("same", {}, gate.PASS, "gate: pass: no cell takes over 1 % more instructions than its budget"),
        ("more", {"instructions": 9e6}, gate.FAIL, "gate: fail: over the budget, by more than 1 %: cpp, comparison: "),
        ("other", {"version": "3.20"}, gate.UNKNOWN, "gate: cannot tell: cpp, comparison: instructions not compared: "),
    ):
        run = results.load(counted(name, cpp=cpp))  # numba takes no part: that is no failure
        held_to = gate.of(run, {"slower_percent": None, "budget": kept.model_dump()})
        assert gate.verdict(held_to) == verdict and gate.line(held_to).startswith(line)
    apart = gate.of_budget(budget.hold(results.load(counted("apart", rust={})), kept), 1)
    assert apart.verdict == gate.UNKNOWN and "nothing could be compared" in apart.why


@pytest.mark.parametrize(
    "text, why",
    [
        ("", "it is no budget"),
        ("[]", "valid dictionary"),
        ('{"budget": 2, "percent": 1, "cells": {}}', "budget: "),
        ('{"budget": 1, "percent": -1, "cells": {}}', "percent: "),
        ('{"budget": 1, "percent": 1, "cells": {"a": {"instructions": "many"}}}', "cells.a.instructions: "),
    ],
)
def test_a_file_that_is_none(tmp_path, text, why):
    (tmp_path / "b.json").write_text(text)
    with pytest.raises(UserError, match=why):
        budget.read(tmp_path / "b.json")
    with pytest.raises(UserError, match=r"none\.json"):
        budget.read(tmp_path / "none.json")


@pytest.mark.slow
@needs_compiler("c++")
def test_a_run_is_held_to_it(experiment, rayrace, tmp_path):
    """What a run took is its budget; a run that takes ten times as much is over it."""
    if isinstance(why := counters.find(), str):
        pytest.skip(why)
    scene = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\nBACKGROUND (0.2,0.5,0.7)\n"
    file, kept = experiment(["cpp"], "[measure]\ncount = true\n", scene=scene), tmp_path / "budget.json"
    rayrace("run", file, "--out", tmp_path / "a", code=0)
    rayrace("export", tmp_path / "a", "--format", "budget", "-o", kept, code=0)
    done = rayrace("run", file, "--out", tmp_path / "b", "--budget", kept, code=0)
    *_, count, verdict = done.stdout.splitlines()
    assert "run / budget = " in count and verdict.startswith("gate: pass: no cell takes over 1 % more")
    told = json.loads(kept.read_text())
    for line in told["cells"].values():
        line["instructions"] /= 10
    kept.write_text(json.dumps(told))
    done = rayrace("run", file, "--resume", tmp_path / "b", "--budget", kept, code=1)
    assert "over the budget, by more than 1 %: cpp, scene: instructions" in done.stderr
    assert done.stdout.splitlines()[-1].startswith("gate: fail: over the budget")
    text = Path(rayrace("report", tmp_path / "b", code=0).stdout.strip()).with_suffix(".md").read_text("utf-8")
    assert text.index("Gate: fail: over the budget") < 400
    done = rayrace("run", file, "--set", "measure.count=false", "--budget", kept, code=2)
    assert "the experiment counts no instructions" in done.stderr
