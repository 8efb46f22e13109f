"""What the shell of the Python renderers prints."""

import json
import os
import struct
import zlib
from pathlib import Path
from types import SimpleNamespace

import pytest

from harness.renderer import places
from renderers import worker

SPEC = Path(worker.__file__).with_name("SPEC.md").read_text("utf-8")


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


# FRM-1: the test vectors of SPEC.md.
PLACES = [
    ((0, 0), 1, 0, (0.5, 0.5), (0.5299325585365295, 0.47286444902420044)),
    ((4096, 123456789), 3, 17, (0.5, 0.5), (0.5168552547693253, 0.5258451886475086)),
    ((2**32 - 1, 2**31), 70000, 4095, (0.25, 0.75), (0.2774752601981163, 0.7143061235547066)),
]


@pytest.mark.parametrize(("key", "frame", "number", "sample", "place"), PLACES)
def test_places_of_later_frames(key, frame, number, sample, place):
    assert worker.place(key, frame, number, sample) == places.place(key, frame, number, sample) == place
    assert all(f"{value!r}" in SPEC for value in place)


class Dialog:
    """The two pipes, with an answer that waits in one; and a job whose frames are checked."""

    def __init__(self, folder, key=(7, 9), **more):
        for name in ("question", "answer"):
            os.mkfifo(folder / name)
            setattr(self, name, os.open(folder / name, os.O_RDWR | os.O_NONBLOCK))
        os.write(self.answer, "{} {}\n".format(*key).encode())
        self.job = SimpleNamespace(
            **{"frames": 2, "least_frame": 0.0, "sample": (0.5, 0.5), **more}, dialog=str(folder)
        )

    def close(self):
        os.close(self.question)
        os.close(self.answer)


@pytest.fixture
def dialog(tmp_path):
    made = []

    def make(**more):
        made.append(Dialog(tmp_path, **more))
        return made[-1]

    yield make
    for one in made:
        one.close()


def test_checked_frames_have_places_and_checksums(dialog, capsys):
    open_one = dialog()
    seen = []

    def frame(number):
        seen.append((number, open_one.job.sample))
        return f"{open_one.job.sample}".encode(), len(seen)

    first = worker.render_checked(open_one.job, frame, lambda answer: answer[0])
    assert os.read(open_one.question, 99) == b"places\n"
    wanted = [(0.5, 0.5), *(places.place((7, 9), index, 0, (0.5, 0.5)) for index in (1, 2))]
    assert seen == [(0, sample) for sample in wanted] and first == (b"(0.5, 0.5)", 1)
    assert open_one.job.sample == (0.5, 0.5)
    told = [line["checksums"] for line in said(capsys, "frame")]
    assert told == [f"{zlib.crc32(str(sample).encode()):08x}" for sample in wanted]


def test_each_render_of_a_batch_has_its_own(dialog, capsys):
    """They are of one frame, with answers that are there at once; what later calls overwrite is kept before."""
    open_one, rooms = dialog(least_frame=1e-4), []

    def frame(number):
        if number == len(rooms):
            rooms.append(bytearray(16))
        rooms[number][:] = struct.pack("dd", *open_one.job.sample)
        return rooms[number]

    first = worker.render_checked(open_one.job, frame, lambda room: room, keep=bytes)
    assert first == struct.pack("dd", 0.5, 0.5)
    _, *later = said(capsys, "frame")
    for line in later:
        wanted = [places.place((7, 9), line["index"], number, (0.5, 0.5)) for number in range(line["renders"])]
        assert line["checksums"] == "".join(f"{zlib.crc32(struct.pack('dd', *place)):08x}" for place in wanted)
    assert later[0]["renders"] > 8


@pytest.mark.parametrize(("size", "most"), [(16, worker.MOST_RENDERS), (worker.MOST_BYTES // 5, 4)])
def test_a_batch_has_an_end(dialog, capsys, size, most):
    picture = bytes(size)
    worker.render_checked(dialog(frames=1, least_frame=60.0).job, lambda _: picture, lambda answer: answer)
    assert said(capsys, "frame")[1]["renders"] == most


def test_without_a_dialog_frames_are_unchecked(capsys):
    alone = SimpleNamespace(frames=1, least_frame=0.0, sample=(0.25, 0.5), dialog="")
    assert worker.render_checked(alone, lambda number: number, None) == 0 and alone.sample == (0.25, 0.5)
    assert all("checksums" not in line for line in said(capsys, "frame"))
