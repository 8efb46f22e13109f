"""What the shell of the Python renderers prints."""

import json
from types import SimpleNamespace

import pytest

from renderers import worker


class Slow:
    """A frame() that takes so many ms by a clock of its own: the first, all others, and more at some calls."""

    def __init__(self, monkeypatch, first, later, more=()):
        self.now, self.calls, self.first, self.later, self.more = 0.0, 0, first, later, dict(more)
        monkeypatch.setattr(worker, "time", SimpleNamespace(monotonic=lambda: self.now))

    def __call__(self):
        self.now += 1e-3 * (self.more.get(self.calls, 0) + (self.later if self.calls else self.first))
        self.calls += 1
        return self.calls


def job(frames=2, least_frame=0.0):
    return SimpleNamespace(frames=frames, least_frame=least_frame)


def said(capsys, event):
    return [line for line in map(json.loads, capsys.readouterr().out.splitlines()) if line["event"] == event]


def test_parts_are_asked_for_after_each_frame(capsys):
    calls = []
    answer = worker.render(
        job(frames=2),
        lambda: calls.append("frame") or len(calls),
        parts=lambda: calls.append("parts") or {"kernel": len(calls)},
    )
    frames = said(capsys, "frame")
    assert calls == ["frame", "parts"] * 3 and answer == 5
    assert [frame["parts"] for frame in frames] == [{"kernel": 2}, {"kernel": 4}, {"kernel": 6}]


def test_a_frame_without_parts(capsys):
    worker.render(job(frames=0), lambda: None)
    assert [set(frame) for frame in said(capsys, "frame")] == [{"event", "index", "start", "end", "renders"}]


@pytest.mark.parametrize(
    ("first", "later", "frames", "renders", "calls"),
    [
        (0.3, 0.3, 3, 4, 1 + 2 + 4 + 4 + 3 * 4),
        (2.0, 0.3, 3, 4, 1 + 1 + 2 + 4 + 4 + 3 * 4),  # cold at first
        (0.4, 0.0004, 2, 4096, 1 + 8190 + 4096 + 2 * 4096),
        (0.5, 0.5, 1, 2, 1 + 2 + 2 + 2),
        (1.5, 1.5, 3, 1, 1 + 1 + 3),  # long enough, which one more render tells
        (15.0, 2.0, 3, 1, 1 + 3),  # without a look
        (0.3, 0.3, 0, None, 1),
    ],
)
def test_a_short_frame_is_a_batch(monkeypatch, capsys, first, later, frames, renders, calls):
    slow = Slow(monkeypatch, first, later)
    assert worker.render(job(frames, least_frame=1e-3), slow) == calls == slow.calls
    told = said(capsys, "frame")
    assert [frame["renders"] for frame in told] == [1, *[renders] * frames]
    for frame in told[1:]:
        assert frame["end"] - frame["start"] == pytest.approx(1e-3 * later * renders)


def test_no_batches_unless_asked_for(monkeypatch, capsys):
    assert worker.render(job(5), Slow(monkeypatch, 0.3, 0.3)) == 6
    assert {frame["renders"] for frame in said(capsys, "frame")} == {1}


@pytest.mark.parametrize("call", [1, 2, 3, 4])
def test_an_interruption_makes_no_batch_look_long(monkeypatch, capsys, call):
    worker.render(job(2, least_frame=1e-3), Slow(monkeypatch, 0.3, 0.3, {call: 30.0}))
    assert [frame["renders"] for frame in said(capsys, "frame")] == [1, 4, 4]


def test_parts_are_of_one_render(monkeypatch, capsys):
    slow, asked = Slow(monkeypatch, 0.3, 0.3), [0]

    def parts():
        asked.append(slow.calls)
        return {"kernel": 2.0 * (asked[-1] - asked[-2])}

    worker.render(job(3, least_frame=1e-3), slow, parts)
    assert [frame["parts"] for frame in said(capsys, "frame")] == [{"kernel": 2.0}] * 4


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


def test_flag_of_batches():
    assert worker.Job(["--job=j", "--out=o"]).least_frame == 0
    assert worker.Job(["--job=j", "--out=o", "--least_frame=0.001"]).least_frame == 1e-3
