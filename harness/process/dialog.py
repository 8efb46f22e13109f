"""Answers a renderer that asks where the samples of its later frames are (FRM-1), once it has said its first frame.

Until then nobody knows the key that the places follow from, so no picture of a later frame can be made before.
"""

import contextlib
import os
import secrets
import time
from dataclasses import dataclass
from pathlib import Path

from harness.renderer import events

UNASKED = "did not ask for the places of the samples of its later frames (FRM-1)"


@dataclass(frozen=True)
class Answer:
    """What a renderer was answered. given: when, s on the monotonic clock; key: of places.place; frames: those that it
    had said by then."""

    given: float
    key: tuple[int, int]
    frames: list[dict]


class Dialog:
    """Two pipes by name in a new folder, `question` and `answer`. stdout: what the renderer prints. Close it."""

    def __init__(self, folder: Path, stdout: Path):
        self.stdout, self.answered = stdout, None
        folder.mkdir()
        self._ends = []
        for name in ("question", "answer"):
            os.mkfifo(folder / name)
            # Both ends of each, so that nobody's opening waits for another's.
            self._ends.append(os.open(folder / name, os.O_RDWR | os.O_NONBLOCK))

    def fileno(self) -> int:
        """Of the end that questions come from, for select."""
        return self._ends[0]

    def answer(self) -> None:
        """Reads a question, and answers the first one."""
        with contextlib.suppress(BlockingIOError):
            os.read(self._ends[0], 4096)
        if self.answered:
            return
        frames = events.read(self.stdout).frames if self.stdout.is_file() else []
        key = secrets.randbits(32), secrets.randbits(32)
        self.answered = Answer(time.monotonic(), key, frames)
        os.write(self._ends[1], "{} {}\n".format(*key).encode())

    def close(self) -> None:
        for end in self._ends:
            os.close(end)


def fault(answer: Answer | None, frames: list[dict]) -> str | None:
    """None, or how a renderer with later frames did not keep to FRM-1. frames: those that it has said at the end."""
    if answer is None:
        return UNASKED
    if answer.frames != frames[:1]:
        return "asked for the places of the samples of its later frames before it said frame 0, or said others then"
    _, *later = frames
    early = next((frame["index"] for frame in later if frame["start"] < answer.given), None)
    return None if early is None else f"frame {early} begins before the place of its sample was known (FRM-1)"
