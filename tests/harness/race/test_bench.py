"""Rows of repetitions that others killed: nobody takes them for measured, and they are run again."""

import json
import shutil
from dataclasses import replace
from types import SimpleNamespace

import pytest
import zoo

from harness.process import process, repetition
from harness.race.audit import WATCHES, Audit
from harness.store import merge, record, store


def result(status="ok", unwatched=None):
    outcome = process.could_not_start("")
    return repetition.Result(status, unwatched or "", replace(outcome, failed=None, unwatched=unwatched))


LOST = "failed", process.KILLED


@pytest.mark.parametrize(
    ("told", "runs", "status"),
    [
        ([("ok",)], 1, "ok"),
        ([LOST, ("ok",)], 2, "ok"),
        ([LOST, LOST, ("failed",)], 3, "failed"),
        ([LOST] * 9, WATCHES, "failed"),
        ([("failed",), ("ok",)], 1, "failed"),
    ],
)
def test_a_repetition_whose_measurer_was_killed_is_begun_again(told, runs, status):
    """With a word about it; the last of several tries that all were killed is a failed row with the reason."""
    results = [result(*each) for each in told]
    begun = []

    def run(*job, **options):
        begun.append(options)
        return results[len(begun) - 1]

    audit = Audit(SimpleNamespace(run=run), 0.05)
    found, warnings = audit._watched("job", series="s.csv")
    assert (len(begun), found.status) == (runs, status) and found is results[runs - 1]
    assert begun == [{"series": "s.csv", "interval": 0.05}] * runs
    unwatched = found.outcome.unwatched
    assert warnings == ([] if unwatched else [f"it was repeated: {process.KILLED}"] * (runs - 1))


def test_rows_that_others_killed_are_run_again(rayrace, experiment, tmp_path):
    """By --resume: of the renderer and of the measurer, whoever killed them. The others stay as they are."""
    names = [zoo.GOOD, "zoo-kill-group", "zoo-kill-measurer", "zoo-memory"]
    limits = "".join(f"{key} = {value!r}\n" for key, value in zoo.LIMITS.items()).replace("'", '"')
    file = experiment(names, f'timeout = "{zoo.AMPLE} s"\n[limits]\n{limits}')
    words = ["run", file, "--renderer", zoo.folder(tmp_path / "animals")]
    lines = tmp_path / "run" / "repetitions.jsonl"

    def rows():
        found = {row["variant"]: row for row in store.read(tmp_path / "run")[1]}
        assert len(found) == len(store.read(tmp_path / "run")[1]) == 4
        return found

    rayrace(*words, "--out", tmp_path / "run", code=1)
    first, kept = rows(), lines.read_bytes()
    assert first["zoo-kill-group"]["reason"] == repetition.BY_OTHERS and first["zoo-kill-group"]["status"] == "killed"
    assert (first["zoo-kill-measurer"]["status"], first["zoo-kill-measurer"]["reason"]) == LOST
    assert "the limit is" in first["zoo-memory"]["reason"]
    rayrace(*words, "--resume", tmp_path / "run", code=1)
    again = rows()
    assert lines.read_bytes().startswith(kept) and lines.read_bytes().count(b"\n") == 6
    for name, row in again.items():
        assert (row["started"] != first[name]["started"]) == name.startswith("zoo-kill"), name
    shutil.copytree(tmp_path / "run", tmp_path / "copy")
    said = json.loads(rayrace("status", tmp_path / "copy", "--json", code=0).stdout)
    assert said["done"] == 4 and sum(said["statuses"].values()) == 4


def row(status, reason, number=0, **more):
    facts = {"cell": "c", "variant": "v", "scene": "s", "point": {}, "repetition": number, "pass": "timed"}
    return {**facts, "status": status, "reason": reason, **more}


def test_which_of_two_rows_is_valid():
    killed, lost = row("killed", repetition.BY_OTHERS), row("failed", process.IN_A_DRIVER, 1)
    limit, fine = row("killed", "used 2 GB of memory, the limit is 1 GB", 2), row("ok", "")
    assert list(map(record.killed_by_others, (killed, lost, limit, fine))) == [True, True, False, False]
    assert record.valid([killed, lost, limit, fine]) == [lost, limit, fine]
    assert record.valid([fine, killed]) == [fine, killed]  # it has not been run again
    assert list(merge.standing([killed, fine]).values()) == [fine]
    assert list(merge.standing([fine, killed]).values()) == [fine]
