import json
import re

import pytest
import stored_run

from harness.errors import UserError
from harness.store import alone, schema, store

pytestmark = pytest.mark.alone


@pytest.fixture
def run(tmp_path):
    """A run of three rows, closed."""
    run = store.Run(tmp_path / "run")
    run.describe(title="t")
    for number in range(3):
        run.append({"cell": "c", "repetition": number, "text": "a line\n and \u2028 another"})
    run.close()
    return tmp_path / "run"


def test_what_was_written_is_read(run):
    facts, records = store.read(run)
    assert facts == {"format": store.FORMAT, "title": "t"}
    assert [record["repetition"] for record in records] == [0, 1, 2]
    assert records[0]["text"] == "a line\n and \u2028 another"


def test_lines_are_appended_and_there_at_once(run):
    before = (run / "repetitions.jsonl").read_bytes()
    more = store.Run(run)
    more.append({"repetition": 3})
    assert (run / "repetitions.jsonl").read_bytes() == before + b'{"repetition": 3}\n'
    assert len(store.read(run)[1]) == 4
    more.close()


def test_what_run_json_says_of_a_cell_is_not_written_again(tmp_path):
    run = store.Run(tmp_path)
    run.describe(cells=[{"cell": "c", "scene": "s", "point": {"depth": 1}}])
    records = [
        {"cell": "c", "scene": "s", "point": {"depth": 1}, "repetition": 0},
        {"cell": "c", "scene": "another", "point": None, "repetition": 1},
        {"cell": "d", "scene": "s", "repetition": 2},
    ]
    for record in records:
        run.append(record)
    run.close()
    assert (tmp_path / "repetitions.jsonl").read_text().splitlines()[0] == '{"cell": "c", "repetition": 0}'
    assert store.read(tmp_path)[1] == records


def test_a_last_line_that_was_cut_off_is_not_believed(run):
    path = run / "repetitions.jsonl"
    whole = path.read_bytes()
    last = whole.rstrip(b"\n").rindex(b"\n") + 1
    for length in range(last, len(whole)):
        path.write_bytes(whole[:length])
        assert len(store.read(run)[1]) == 2


@pytest.mark.parametrize("damage", [b'{"cell": "c", "repe', b"\x00\x00\x00", b"", b"5", b"[1]"])
def test_a_damaged_line_in_the_middle(run, damage):
    path = run / "repetitions.jsonl"
    lines = path.read_bytes().splitlines()
    lines[1] = damage
    path.write_bytes(b"\n".join(lines) + b"\n")
    with pytest.raises(UserError, match=r"repetitions.jsonl:2: a damaged line"):
        store.read(run)


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("run.json", None, "not a run: .*No such file.*; a run is a folder that `rayrace run` wrote"),
        ("run.json", "{", "not a run"),
        ("run.json", "[]", "run.json: expected format 1"),
        ("run.json", '{"format": 2}', "run.json: expected format 1"),
        ("run.json", '{"format": 1, "cells": [{"cell": "a"}, {"variant": "b"}]}', "cells.1.cell is missing"),
        ("repetitions.jsonl", None, "not a run"),
    ],
)
def test_no_run(run, name, text, message):
    (run / name).unlink() if text is None else (run / name).write_text(text)
    with pytest.raises(UserError, match=message):
        store.read(run)


@pytest.mark.parametrize(
    ("where", "lacks", "message"),
    [
        (lambda facts, rows: facts, "started", "started is missing"),
        (lambda facts, rows: facts["experiment"], "image", r"experiment\.image is missing"),
        (lambda facts, rows: facts["environment"]["cores"], "logical", r"environment\.cores\.logical is missing"),
        (lambda facts, rows: facts["cells"][1], "parameters", r"cells\.1\.parameters is missing"),
        (lambda facts, rows: facts["pair"], "label", r"pair\.label is missing"),
        (lambda facts, rows: rows[1], "wall_s", r"repetition \d of \w+: wall_s is missing"),
    ],
)
def test_a_report_needs_every_key(tmp_path, where, lacks, message):
    facts, rows = stored_run.facts(), stored_run.rows()
    schema.complete(facts, rows, tmp_path)
    del where(facts, rows)[lacks]
    with pytest.raises(UserError, match=message):
        schema.complete(facts, rows, tmp_path)


def test_a_run_is_of_one_process_at_a_time(tmp_path):
    busy = pytest.raises(UserError, match="another rayrace is at work on this run")
    with alone.only_one(tmp_path), busy, alone.only_one(tmp_path):
        pass
    with alone.only_one(tmp_path):
        pass


def test_a_number_that_json_has_not_is_refused(tmp_path):
    run = store.Run(tmp_path)
    with pytest.raises(ValueError):
        run.append({"wall_s": float("nan")})
    run.close()
    assert (tmp_path / "repetitions.jsonl").read_text() == ""


def test_write_whole_is_all_or_nothing(tmp_path, monkeypatch):
    path = tmp_path / "run.json"
    store.write_whole(path, "old")
    monkeypatch.setattr("os.fsync", lambda _: (_ for _ in ()).throw(OSError(28, "No space left on device")))
    with pytest.raises(OSError):
        store.write_whole(path, "new")
    assert path.read_text() == "old"


def test_write_whole_replaces(tmp_path):
    path = tmp_path / "run.json"
    for text in ("old and long", "new"):
        store.write_whole(path, text)
        assert path.read_text() == text
    assert [file.name for file in tmp_path.iterdir()] == ["run.json"]


def test_every_row_of_the_docstring_is_in_a_record(rayrace, experiment, tmp_path):
    rayrace("run", experiment(["python"]), "--out", tmp_path / "run", code=0)
    (line,) = (tmp_path / "run" / "repetitions.jsonl").read_text().splitlines()
    record = json.loads(line)
    assert set(record) <= set(re.findall(r"\w+", store.__doc__))
    assert set(record["memory"]) <= set(re.findall(r"\w+", store.__doc__))
    for name in (
        "wall_s",
        "phases",
        "frames_s",
        "cpu",
        "memory",
        "rays",
        "used",
        "versions",
        "picture",
        "agreement",
        "measurer",
    ):
        assert record[name], name
    assert record["status"] == "ok" and record["reason"] == "" and record["build"] is None
    folder = tmp_path / "run"
    cell = record["cell"]
    for file in (f"pictures/{cell}.npy", f"series/{cell}-0.csv", f"logs/{cell}-0.stdout", f"logs/{cell}-0.stderr"):
        assert (folder / file).is_file()
