"""What the shell of the Python renderers prints."""

import json
from types import SimpleNamespace

from renderers import worker


def said(capsys, event):
    return [line for line in map(json.loads, capsys.readouterr().out.splitlines()) if line["event"] == event]


def test_parts_are_asked_for_after_each_frame(capsys):
    calls = []
    answer = worker.render(
        SimpleNamespace(frames=2),
        lambda: calls.append("frame") or len(calls),
        parts=lambda: calls.append("parts") or {"kernel": len(calls)},
    )
    frames = said(capsys, "frame")
    assert calls == ["frame", "parts"] * 3 and answer == 5
    assert [frame["parts"] for frame in frames] == [{"kernel": 2}, {"kernel": 4}, {"kernel": 6}]


def test_a_frame_without_parts(capsys):
    worker.render(SimpleNamespace(frames=0), lambda: None)
    assert [set(frame) for frame in said(capsys, "frame")] == [{"event", "index", "start", "end"}]


def test_device(capsys):
    worker.say_device("a device", False, compute_capability=(9, 0))
    facts = {"name": "a device", "simulated": False, "compute_capability": [9, 0]}
    assert said(capsys, "device") == [{"event": "device", **facts}]


def test_flags_of_a_gpu():
    given = ["--job=j", "--out=o"]
    job = worker.Job(given)
    assert (job.scene_memory, job.block_width, job.block_height, job.total_threads, job.max_registers) == (
        *("auto", 16, 16),
        *(0, 0),
    )
    job = worker.Job([*given, "--scene_memory=shared", "--block_width=8", "--block_height=4", "--total_threads=99"])
    assert (job.scene_memory, job.block_width, job.block_height, job.total_threads) == ("shared", 8, 4, 99)
