"""Hostile JSON Lines of a renderer: what it said, or faults with the line, and a row that a run can keep either way."""

import copy
import json
from pathlib import Path

import hostile
import orjson
import pytest

from harness.process import process
from harness.process.repetition import Result
from harness.race import row
from harness.renderer import events
from reports.run import repetition

GOOD = [
    {"event": "phase", "name": "load", "start": 1.0, "end": 1.1},
    {"event": "frame", "index": 0, "start": 1.1, "end": 1.2, "renders": 1, "parts": {"kernel": 0.05, "download": 0.01}},
    {"event": "frame", "index": 1, "start": 1.2, "end": 1.3},
    {"event": "rays", "primary": 4, "reflected": 2, "transmitted": 0, "shadow": 8, "non_finite": 0},
    {"event": "memory", "peak_bytes": 10**7, "render_peak_bytes": None, "method": "VmHWM"},
    {
        "event": "device",
        "name": "g",
        "simulated": False,
        "compute_capability": [9, 0],
        "memory_bytes": 8e10,
        "driver": "1",
    },
    {"event": "versions", "compiler": "g++ 12", "flags": ["-O3"], "nested": {"a": [1]}},
    {
        "event": "used",
        "features": ["sphere"],
        "methods": {"precision": "float64", "compile_cache": "cold", "walk_rows": 9},
    },
    {"event": "output", "file": "image.npy", "dropped": None},
    {"event": "error", "reason": "no"},
]
GOOD[5]["memory_bytes"] = 80_000_000_000
LINES = [json.dumps(line) for line in GOOD]
PIECES = [
    *LINES,
    "\n",
    *(f'"{key}": ' for line in GOOD for key in line),
    "{",
    "}",
    "[",
    "]",
    ",",
    ":",
    "NaN",
    '"\\ud800"',
]


@pytest.fixture
def heard(place):
    """heard(content): what was said in so many bytes, and the flat row of a report that it becomes."""

    def heard(content):
        path = place / "stdout"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return hostile.outcome(lambda: _heard(path))

    return heard


def _heard(path):
    said = events.read(path)
    events.tidy(said, 0.9, 1.5)
    assert len(said.faults) <= events.FAULTS + 1
    assert all(fault.isprintable() and len(fault) < 5000 for fault in said.faults), said.faults
    outcome = process.Outcome(None, 0.9, 1.5, 0, None, False, 0.1, 0.0, 10**7, 10**6, None)
    who = dict.fromkeys(("cell", "variant", "scene", "technology"), "x")
    who |= {"repetition": 0, "point": {}, "parameters": {"kind": "image"}}
    told = {"status": "ok", "reason": "", "picture": None, "agreement": None, "error": None, "build": None}
    record = {**who, **told, **row.measured(Result("ok", "", outcome, said), Path("/nowhere"))}
    line = json.dumps(record, allow_nan=False)
    repetition.row(orjson.loads(line))
    return said


def test_cases(fuzz, heard):
    def once(random):
        if random.randint(0, 1):  # lines that are JSON, of values that are not expected
            lines = [json.dumps(hostile.bent(random, line)) for line in random.sample(copy.deepcopy(GOOD), 3)]
            heard("\n".join(lines))
        else:
            some = [random.choice(LINES) for _ in range(3)]
            heard(hostile.mutated(random, ["\n".join(some) + "\n"], PIECES))

    fuzz("lines of a renderer", once)


def test_the_corpus_is_good(heard):
    assert heard("\n".join(LINES)).faults == []


DEEP = 100_000
USED = '{"event": "used", "features": [], "methods": {}, "x": '
BAD = {
    "NUL bytes": b"\0" * 1000,
    "UTF-16": "\n".join(LINES).encode("utf-16"),
    "half a letter": LINES[0].encode() + b"\xc3",
    "nested lists": "[" * DEEP,
    "nested tables": '{"event":' * DEEP,
    "nested lists in a table": USED + "[" * 990 + "]" * 990 + "}",
    "nested as deep as is read alone": USED + "[" * 1022 + "]" * 1022 + "}",
    "half a pair": USED + '"\\ud800"}',
    "half a pair as a key": '{"event": "versions", "\\udfff": 1}',
    "a number of 5000 digits": USED + "1" * 5000 + "}",
    "no number": USED + "NaN}",
    "infinity": USED + "1e999}",
    "a list": "[]",
    "a text": '"event"',
    "null": "null",
    "no event": "{}",
    "an event of another kind": '{"event": {}}',
    "methods that are a list": '{"event": "used", "features": [], "methods": []}'.replace("[]}", "[1]}"),
    "a method that is a table": '{"event": "used", "features": [], "methods": {"compile_cache": {}}}',
    "a stamp of 1e308": '{"event": "frame", "index": 0, "start": 1e308, "end": 1e309}',
    "a frame from the past": '{"event": "frame", "index": 0, "start": -1e308, "end": 1e308}',
    "10^18 rays": '{"event": "rays", "primary": 1e18, "reflected": 0, "transmitted": 0, "shadow": 0, "non_finite": 0}',
    "2^63 bytes": '{"event": "memory", "peak_bytes": 9223372036854775808}',
    "parts that are a list": '{"event": "frame", "index": 0, "start": 1, "end": 1.1, "parts": [1]}',
    "100,000 lines of nothing": "x\n" * 100_000,
    "one line of a megabyte": "x" * 10**6,
    "a name of a megabyte": '{"event": "phase", "name": "' + "x" * 10**6 + '", "start": 2, "end": 1}',
    "escapes for a terminal": "\x1b[2J",
}


@pytest.mark.parametrize("name", BAD)
def test_bad(heard, name):
    assert heard(BAD[name]).faults


@pytest.mark.parametrize(
    "reason", ["\x1b[2J", "\ud800", "\0", "a\nb\u2028c", "\u202etxt", "x" * 10**6, "<b>", None, {}, []]
)
def test_reasons(heard, reason):
    """The words of a renderer reach people: on one line, and in so many letters."""
    told = heard(json.dumps({"event": "error", "reason": reason}))
    assert "\n" not in told.error and len(told.error) <= events.WORDS + 4
    told.error.encode()
