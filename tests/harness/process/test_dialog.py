"""The question for the places of later frames is answered once, and what had been said by then is remembered."""

import os
from pathlib import Path

import pytest

from harness.process import dialog
from harness.process.dialog import Answer, Dialog

FRAME = '{"event": "frame", "index": 0, "start": 1.0, "end": 2.0, "checksums": "00c0ffee"}\n'
FIRST = {"index": 0, "start": 1.0, "end": 2.0, "parts": None, "renders": 1, "checksums": "00c0ffee"}


@pytest.fixture
def talk(tmp_path):
    stdout = tmp_path / "stdout"
    stdout.write_text(FRAME)
    with_ends = Dialog(tmp_path / "dialog", stdout)
    yield with_ends, tmp_path / "dialog", stdout
    with_ends.close()


def ask(folder: Path) -> list[int]:
    """As a renderer asks."""
    (folder / "question").write_text("places\n")
    descriptor = os.open(folder / "answer", os.O_RDONLY | os.O_NONBLOCK)
    try:
        return [int(word) for word in os.read(descriptor, 99).split()]
    except BlockingIOError:
        return []
    finally:
        os.close(descriptor)


def test_one_answer(talk):
    answering, folder, stdout = talk
    assert ask(folder) == [] and answering.answered is None
    answering.answer()
    stdout.write_text(FRAME + FRAME)
    descriptor = os.open(folder / "answer", os.O_RDONLY | os.O_NONBLOCK)
    key = tuple(map(int, os.read(descriptor, 99).split()))
    os.close(descriptor)
    assert answering.answered.key == key and all(0 <= part < 2**32 for part in key)
    assert answering.answered.frames == [FIRST]
    ask(folder)
    answering.answer()
    assert ask(folder) == [] and answering.answered.key == key


def test_two_dialogs_have_two_keys(tmp_path):
    keys = set()
    for number in range(20):
        one = Dialog(tmp_path / str(number), tmp_path / "nothing was printed")
        one.answer()
        assert one.answered.frames == []
        keys.add(one.answered.key)
        one.close()
    assert len(keys) == 20


def later(start):
    return {**FIRST, "index": 1, "start": start, "end": start + 1}


@pytest.mark.parametrize(
    ("answer", "frames", "fault"),
    [
        (Answer(3.0, (1, 2), [FIRST]), [FIRST, later(3.0)], None),
        (None, [FIRST, later(3.0)], dialog.UNASKED),
        (Answer(3.0, (1, 2), []), [FIRST, later(3.0)], "asked for the places"),
        (Answer(3.0, (1, 2), [FIRST, later(2.0)]), [FIRST, later(2.0)], "asked for the places"),
        (Answer(3.0, (1, 2), [{**FIRST, "checksums": "00000000"}]), [FIRST, later(3.0)], "asked for the places"),
        (Answer(3.0, (1, 2), [FIRST]), [FIRST, later(2.9)], "frame 1 begins before the place of its sample was known"),
    ],
)
def test_what_is_not_kept(answer, frames, fault):
    found = dialog.fault(answer, frames)
    assert found is None if fault is None else found.startswith(fault)
