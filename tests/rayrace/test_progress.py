"""What a run shows while it goes: one line with the standings on a terminal, plain lines elsewhere."""

import io
import re
import statistics
import threading
from types import SimpleNamespace

import numpy as np
import pytest

from rayrace import progress

AGREEMENT = {"reference": "numpy", "max_outside": 2e-14, "max_inside": 1e-3, "mask_fraction": 0.02, "wrong": None}
ERROR = {"against": "scene", "depth": 16, "change": 1e-6, "max": 1.25, "rmse": 0.011, "bad_pixels": 0.0033}
RECORD = {
    "status": "ok", "reason": "", "repetition": 0, "pass": "timed", "unranked": None, "wall_s": 2.0,
    "frames_s": [0.5, 0.25, 0.25], "agreement": AGREEMENT, "error": ERROR, "stability": None,
    "cpu": {"user_s": 1.5, "system_s": 0.4}, "memory": {"peak_bytes": 10_200_000},
}  # fmt: skip


def cell(variant, work=1, refused=None, frames=2, **point):
    return SimpleNamespace(
        key=f"{variant}{point}", label=", ".join([variant, "[comparison]", *map(str, point.values())]), point=point,
        entry=SimpleNamespace(name=variant), scene="scenes/comparison.txt", refused=refused, stressed=None, work=work,
        parameters=SimpleNamespace(frames=frames),
    )  # fmt: skip


def took(*later):
    return RECORD | {"frames_s": [9.0, *later]}


CPP, NUMBA, NUMPY = map(cell, ("cpp", "numba", "numpy"))


class Terminal(io.StringIO):
    def __init__(self, is_one):
        super().__init__()
        self.is_one = is_one

    def isatty(self):
        return self.is_one


@pytest.fixture
def shown(monkeypatch):
    """shown(terminal?, *told): the lines that standard error gets of these repetitions: (cell, record or None, ..)."""

    def show(is_one, *told, columns=160, earlier=()):
        monkeypatch.setattr(progress.sys, "stderr", Terminal(is_one))
        monkeypatch.setenv("TERM", "xterm")
        monkeypatch.setenv("COLUMNS", str(columns))
        threads = threading.active_count()
        with progress.progress([CPP, NUMBA, NUMPY]) as heard:
            heard.kept(list(earlier))
            assert threading.active_count() == threads  # none that draws while a renderer is measured
            for what, record, *more in told:
                heard.tell(what, record, *more) if record else heard.begins(what, *more)
        text = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", progress.sys.stderr.getvalue())  # without colours
        return [line.rstrip() for line in re.split("[\r\n]", text) if line.strip()]

    return show


def test_a_terminal_has_one_line_with_what_runs_and_the_standings(shown):
    lines = shown(
        True,
        (NUMBA, None, 0, 12, None),
        (NUMBA, took(0.5, 0.5), 1, 12, None),
        (CPP, None, 1, 12, 90.0),
        (CPP, took(0.25, 0.25), 2, 12, 80.0),
        (NUMPY, None, 2, 12, 80.0),
    )
    assert lines[0] == "━━━━━━━━━━━━ 0/12  numba"
    assert lines[2] == "━━━━━━━━━━━━ 1/12, 90 s left  cpp"  # one alone has no standing
    assert lines[4] == "━━━━━━━━━━━━ 2/12, 80 s left  numpy  so far cpp 250 ms, numba 2.00 ×"


def test_the_rows_of_a_resumed_run_count_in_the_standings(shown):
    kept = [took(time, time) | {"cell": what.key} for what, time in ((CPP, 0.25), (NUMBA, 0.5), (NUMBA, 0.7))]
    kept.append(took(0.1, 0.1) | {"cell": "of a renderer that is asked no more"})
    lines = shown(True, (NUMPY, None, 3, 12, None), earlier=kept)
    assert lines[0] == "━━━━━━━━━━━━ 3/12  numpy  so far cpp 250 ms, numba 2.40 ×"


def test_the_line_is_no_wider_than_the_terminal(shown):
    told = [(what, took(0.25, 0.25), 1, 12, 90.0) for what in (CPP, NUMBA, NUMPY)]
    lines = shown(True, *told, columns=50)
    assert max(map(len, lines)) == 50 and lines[-1].endswith("…") and "so far cpp 2" in lines[-1]


def test_what_goes_wrong_is_told_once_above_the_line(shown):
    failed = RECORD | {"status": "failed", "reason": "exit 1: [no] scene", "cpu": None, "memory": None}
    lines = shown(True, (CPP, failed, 1, 12, None), (CPP, failed | {"repetition": 1}, 2, 12, None))
    assert [line for line in lines if "failed" in line] == ["[1/12] cpp, [comparison]: failed: exit 1: [no] scene"]


def test_the_standings_are_medians_of_what_counts():
    cells = [CPP, NUMBA]
    rng, standings, times = np.random.default_rng(1), progress.Standings(cells), {}
    for _ in range(50):
        for what, level in zip(cells, (1.0, 3.0), strict=True):
            frames = (level * rng.uniform(0.5, 2, 3)).tolist()
            standings.add(what, took(*frames))
            times.setdefault(what.key, []).append(statistics.median(frames))
    for wrong in ({"pass": "pair"}, {"status": "failed"}, {"unranked": "its marks contradict the clock"}):
        standings.add(CPP, took(0.001, 0.001) | wrong)
    cpp, numba = map(statistics.median, times.values())
    assert str(standings) == f"cpp {cpp:.2f} s, numba {numba / cpp:.2f} ×"


def test_the_standings_are_of_the_place_with_the_most_variants_and_the_most_work():
    def place(**point):
        return [cell(name, **point) for name in ("cpp", "numba")]

    small, large, alone = place(work=1, depth=1), place(work=9, depth=9), [cell("cpp", 99, depth=99)]
    refused = [cell(name, 50, depth=50, refused="no CUDA device" * (name == "numba")) for name in ("cpp", "numba")]
    still = [cell(name, 60, frames=0, depth=60) for name in ("cpp", "numba")]
    for one in refused:
        one.refused = one.refused or None
    standings = progress.Standings([*small, *large, *alone, *refused, *still])
    assert list(standings.names) == [one.key for one in large]
    for one in (*small, *large):
        standings.add(one, took(*[one.work + (one.entry.name == "numba")] * 3))
    assert str(standings) == "cpp 9.00 s, numba 1.11 ×"
    assert str(progress.Standings(still)) == str(progress.Standings([])) == ""


def test_a_cell_is_told_by_what_varies():
    cells = [cell(name, depth=depth, precision="float64") for name in ("cpp", "numba") for depth in (1, 2)]
    assert list(progress.places(cells).values()) == ["depth 1", "depth 2"] * 2
    other = cell("cpp", depth=1, precision="float64", samples=4)
    other.scene = "scenes/b.txt"
    assert progress.places([*cells, other])[other.key] == "b, depth 1, samples 4"


def test_elsewhere_each_is_a_line(shown):
    assert shown(False, (CPP, None, 2, 12, 90.0), (CPP, RECORD, 3, 12, 90.0)) == [
        "[3/12, 90 s left] cpp, [comparison]: first 500 ms, 250 ms a frame, RMSE 0.011, largest error 1.25, "
        "0.33 % of pixels beyond 1/255, agreement ✓ outside a mask of 2.0 % of the pixels"
    ]


def test_a_count_is_told_without_times(shown):
    counts = {"instructions": 594_012.0, "rays": 402, "tool": "valgrind"}
    told = RECORD | {"pass": "count", "counts": counts, "frames_s": None}
    missing = told | {"counts": None, "status": "unavailable", "reason": "no program valgrind"}
    assert shown(False, (CPP, told, 3, 12, None), (CPP, missing, 4, 12, None)) == [
        "[3/12] cpp, [comparison], count: 594000 instructions a frame, 1480 a ray, by valgrind",
        "[4/12] cpp, [comparison], count: no program valgrind",
    ]
