"""Runs held to a budget of instructions."""

import json
import re

import pytest
from compilers import needs_compiler

from harness.errors import UserError
from harness.system import counters
from reports import exporters
from reports.compare import budget
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
    with pytest.raises(UserError, match=re.escape("version 3.19.0 -> 3.20")):
        budget.hold(results.load(run), kept)


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
    assert "run / budget = " in rayrace("run", file, "--out", tmp_path / "b", "--budget", kept, code=0).stdout
    told = json.loads(kept.read_text())
    for line in told["cells"].values():
        line["instructions"] /= 10
    kept.write_text(json.dumps(told))
    done = rayrace("run", file, "--resume", tmp_path / "b", "--budget", kept, code=1)
    assert "over the budget, by more than 1 %: cpp, scene: instructions" in done.stderr
    done = rayrace("run", file, "--set", "measure.count=false", "--budget", kept, code=2)
    assert "the experiment counts no instructions" in done.stderr
