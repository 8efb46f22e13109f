"""What a run shows while it goes: a bar with the last process on a terminal, lines elsewhere."""

import io
import re
from types import SimpleNamespace

import pytest

from rayrace import terminal

CELL = SimpleNamespace(label="cpp, [comparison]")
AGREEMENT = {"reference": "numpy", "max_outside": 2e-14, "max_inside": 1e-3, "mask_fraction": 0.02, "wrong": None}
ERROR = {"against": "scene", "depth": 16, "change": 1e-6, "max": 1.25, "rmse": 0.011, "bad_pixels": 0.0033}
RECORD = {
    "status": "ok", "reason": "", "repetition": 0, "pass": "timed", "unranked": None, "wall_s": 2.0,
    "frames_s": [0.5, 0.25, 0.25], "agreement": AGREEMENT, "error": ERROR, "stability": None,
    "cpu": {"user_s": 1.5, "system_s": 0.4}, "memory": {"peak_bytes": 10_200_000},
}  # fmt: skip


class Terminal(io.StringIO):
    def __init__(self, is_one):
        super().__init__()
        self.is_one = is_one

    def isatty(self):
        return self.is_one


@pytest.fixture
def shown(monkeypatch):
    """shown(terminal?, *told): what standard error gets when these repetitions have ended."""

    def show(is_one, *told):
        monkeypatch.setattr(terminal.sys, "stderr", Terminal(is_one))
        monkeypatch.setenv("TERM", "xterm")
        monkeypatch.setenv("COLUMNS", "160")
        with terminal.progress() as tell:
            for line in told:
                tell(*line)
        return re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", terminal.sys.stderr.getvalue())  # without colours

    return show


def test_a_terminal_has_a_bar_with_the_last_process(shown):
    text = shown(True, (CELL, RECORD, 3, 12, 90.0))
    for part in ("cpp, [comparison]", "95% of a core, 10.2 MB", "3/12", "90 s left"):
        assert part in text, text


def test_what_is_not_known_is_left_out(shown):
    failed = RECORD | {"status": "failed", "reason": "exit 1: [no] scene", "cpu": None, "memory": None}
    text = shown(True, (CELL, failed, 1, 12, None))
    assert "core" not in text and "MB" not in text and "failed: exit 1: [no] scene" in text


def test_elsewhere_each_is_a_line(shown):
    assert shown(False, (CELL, RECORD, 3, 12, 90.0)) == (
        "[3/12, 90 s left] cpp, [comparison]: first 0.5 s, 0.25 s a frame, RMSE 0.011, largest error 1.25, "
        "0.33 % of pixels beyond 1/255, agreement ✓ outside a mask of 2 % of the pixels\n"
    )
