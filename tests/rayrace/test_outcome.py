"""What a run says at its end: the ranking, what each variant would buy, the sentence; on a terminal and elsewhere."""

import copy
import fcntl
import os
import pty
import re
import struct
import subprocess
import sys
import termios
from pathlib import Path

import pytest
import stored_run

from harness.store import store
from rayrace import outcome, terminal

PROGRAM = Path(sys.executable).with_name("rayrace")
LEVELS = {"python": 6.0, "numpy": 0.5, "numba": 0.2, "cpp": 0.2}  # s a frame
COMPILE = {"numba": 3.0}


def made(levels=LEVELS, processes=6, frames=4, **changes):
    """The rows of a run in which each variant takes so long, in every round; cpp has a build of 6.5 s."""
    (row, *_), rows = stored_run.rows(), []
    for number in range(processes):
        for variant, level in levels.items():
            told = copy.deepcopy(row) | {"variant": variant, "renderer": variant, "cell": f"key-{variant}"}
            wave = 1 + 0.01 * (number % 3)
            told |= {"repetition": number, "frames_s": [2 * level] + [level * wave] * frames, "warnings": []}
            cold = "cold" if number == 0 else "warm"
            told["used"]["methods"]["compile_cache"] = cold if variant in COMPILE else None
            told["phases"] = [["start", 0.0, 0.1], ["render", 0.1, 1.9], ["exit", 1.9, 2.0]]
            if variant in COMPILE:
                told["phases"].insert(1, ["compile", 0.1, 0.1 + COMPILE[variant]])
            told["build"] = row["build"] if variant == "cpp" else None
            told["lines"] = 100 * len(variant)
            rows.append(told | changes)
    return rows


@pytest.fixture
def printed(tmp_path, capsys, monkeypatch):
    """printed(rows, columns): the lines that are printed at the end of a run with these rows."""

    def show(rows, columns=160):
        facts = stored_run.facts() | {"pair": {"unavailable": "none"}}
        cells = {
            row["cell"]: {**facts["cells"][0], **{name: row[name] for name in facts["cells"][0] if name in row}}
            for row in rows
        }
        stored_run.write(tmp_path / "run", facts | {"cells": list(cells.values())}, rows)
        monkeypatch.setattr(terminal.console, "width", columns)
        outcome.show(tmp_path / "run", store.read(tmp_path / "run")[1])
        return capsys.readouterr().out.splitlines()

    return show


def cells(lines, head):
    """The rows of the table whose header has the word `head`: the words of its columns."""
    at = next(number for number, line in enumerate(lines) if head in line)
    found = []
    for line in lines[at + 2 :]:
        if not line.strip():
            break
        found.append(re.split(r"  +", line.strip()))
    return found


def test_the_ranking_has_the_fastest_first_with_error_and_agreement(printed):
    lines = printed(made())
    assert cells(lines, "steady frame") == [
        ["numba", "202 [200, 204] ms", "1", "0.02", "✓"],
        ["cpp", "202 [200, 204] ms", "1.0, not resolved", "0.02", "✓"],
        ["numpy", "505 [500, 510] ms", "2.5", "0.02", "✓"],
        ["python", "6.06 [6.00, 6.12] s", "30", "0.02", "✓"],
    ]
    assert lines[-1].startswith("numba and cpp are equally fast")


def test_what_it_would_buy_in_place_of_python(printed):
    """cpp: 6.5 + 0.4 + 0.202 (n - 1) < 12 + 6.06 (n - 1) from the first frame on. numba compiles for 3 s."""
    table = cells(printed(made()), "speed-up")
    assert {row[0]: row[1:] for row in table} == {
        "numba": ["30.0 ×", "3.00 s", "at frame 1", "500", "2.00 MB"],
        "cpp": ["30.0 ×", "6.50 s", "at frame 1", "300", "2.00 MB"],
        "numpy": ["12.0 ×", "none", "at frame 1", "500", "2.00 MB"],
        "python": ["none", "600", "2.00 MB"],
    }


def test_it_pays_later_where_frames_are_short(printed):
    """Of a tenth of the time: cpp 6.5 + 0.04 + 0.0202 (n - 1), python 1.2 + 0.606 (n - 1): n > 10.1."""
    table = {
        row[0]: row for row in cells(printed(made({name: level / 10 for name, level in LEVELS.items()})), "speed-up")
    }
    assert table["cpp"][3] == "at frame 11"


def test_what_is_slower_never_pays(printed):
    table = {row[0]: row for row in cells(printed(made({"python": 0.5, "numpy": 0.6})), "speed-up")}
    assert table["numpy"][1:4] == ["0.833 ×", "none", "never"]


def test_without_python_the_slowest_is_what_it_is_compared_with(printed):
    lines = printed(made({"numpy": 0.5, "cpp": 0.2, "numba": 0.7}))
    assert any(line.startswith("compared with numba,") for line in lines)
    assert cells(lines, "speed-up")[1][3] == "at frame 1"  # numpy compiles nothing
    lines = printed(made({"numba": 0.7, "cpp": 0.2, "numpy": 0.9}))
    assert {row[0]: row[3] for row in cells(lines, "speed-up") if len(row) > 4}["numba"] == "at frame 14"


def test_few_processes_have_no_interval_and_resolve_nothing(printed):
    lines = printed(made(processes=2))
    assert cells(lines, "steady frame")[3] == ["python", "6.03 s", "30", "0.02", "✓"]
    assert "not resolved" not in "".join(lines[:-1]) and lines[-1].endswith("5 are needed.")


def test_what_is_not_ranked_has_its_reason(printed):
    rows = made({"cpp": 0.2, "numpy": 0.5})
    drifting = [[9.0, *(0.3 - 0.005 * n for n in range(30))]] * 6
    numba = [row | {"frames_s": frames} for row, frames in zip(made({"numba": 1.0}), drifting, strict=True)]
    lines = printed([*rows, *numba])
    assert "numba: not ranked: no steady state: the frames of 6 processes became 36 % faster" in lines


@pytest.mark.parametrize("columns", [80, 160])
def test_it_is_no_wider_than_the_terminal(printed, columns):
    lines = printed(made(), columns)
    assert max(map(len, lines[:-1])) <= columns
    assert all(word in "".join(lines) for word in ("not resolved", "equally fast", "frame 1"))


@pytest.mark.parametrize("rows", [[], made({"cpp": 0.2})])
def test_of_less_than_two_cells_there_is_nothing_to_rank(printed, rows):
    assert printed(rows or made({"cpp": 0.2}, status="failed", reason="exit 1")) == []


def test_pictures_alone_are_ranked_by_their_first_frames(printed):
    lines = printed(made({"cpp": 0.2, "numpy": 0.5}, frames=0))
    found = [row[:3] for row in cells(lines, "first frame")]
    assert found == [["cpp", "400 ms, all equal", "1"], ["numpy", "1.00 s, all equal", "2.5"]]
    assert "speed-up" not in "".join(lines) and "first frame" in lines[-1]


@pytest.mark.slow
def test_a_real_run_in_a_terminal(environment, experiment, tmp_path):
    """One line that changes while it runs, then the tables; nothing is wider than the 80 columns but the sentence."""
    file = experiment(["python", "numpy"], processes=2, frames=3)
    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 50, 80, 0, 0))
    env = {name: value for name, value in environment.items() if name not in ("COLUMNS", "NO_COLOR")}
    process = subprocess.Popen(
        [PROGRAM, "run", file, "--out", tmp_path / "run"],
        stdin=slave, stdout=slave, stderr=slave, env={**env, "TERM": "xterm"}, start_new_session=True,
    )  # fmt: skip
    os.close(slave)
    said = b""
    try:
        while found := os.read(master, 2**16):
            said += found
    except OSError:  # its end
        pass
    assert process.wait(60) == 0
    text = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", said.decode())
    before, _, after = text.partition("4 ok")
    assert re.search(r"━ 3/4.*  (python|numpy)  so far (python|numpy) .*, (python|numpy) \d", before)
    assert "\n" not in before.strip() and "speed-up" in after and after.rstrip().endswith(str(tmp_path / "run"))
    *tables, _, _ = after.rstrip().splitlines()
    assert max(map(len, tables)) <= 80
