"""The measurer on a clock of its own: which deadlines it meets, what it writes, and its audit. Times in s."""

import json
import os
import subprocess
import sys
from types import SimpleNamespace

import pytest

from harness.process import measurer

INTERVAL = 0.5
TARGET = {"pid": 1, "launcher": 2, "spawned": 99.5}
LAST = b'{"exited": 104.25}\n'
EMPTY = [""] * len(measurer.SERIES)


class Host:
    """A clock that goes on only where the measurer waits, and where a look at the renderer takes its time.

    takes: how long each look takes; after the last one the renderer is gone. told: the time at which words come.
    """

    def __init__(self, monkeypatch, takes, told=1e9, words=LAST):
        self.now, self.takes, self.told, self.words, self.rows = 100.0, list(takes), told, words, []
        self.pids, self.resolution, self.most, self.mark, self.pss = frozenset(), 0.01, 3, 5, 7
        monkeypatch.setattr(measurer, "time", SimpleNamespace(monotonic=lambda: self.now))
        monkeypatch.setattr(measurer, "select", SimpleNamespace(select=self.wait))
        monkeypatch.setattr(measurer, "Family", lambda pid, launcher: self)

    def wait(self, read, _, __, pause):
        self.now += pause
        return (read if self.now >= self.told else []), [], []

    def sample(self, _):
        if not self.takes:
            return None
        self.now += self.takes.pop(0)
        return 0.125, 10, 20, 1, None

    def last(self):
        return 0.75 if self.takes else None

    def watch(self):
        gpu = SimpleNamespace(sample=lambda pids, now: [None] * len(EMPTY))
        rapl = SimpleNamespace(joules=lambda: 2.5)
        words = SimpleNamespace(readline=lambda: self.words)
        return measurer.watch(TARGET, INTERVAL, SimpleNamespace(writerow=self.rows.append), gpu, rapl, words)


def test_ticks_keep_to_the_deadlines_and_those_missed_are_counted(monkeypatch):
    """The third look is over at 102.25, behind the deadlines 101.5 and 102."""
    host = Host(monkeypatch, [0, 0, 1.25, 0.25, 0])
    seen = host.watch()
    assert seen.ticks == [100, 100.5, 101, 102.5, 103] and seen.missed == 2 and not seen.saw_end
    assert host.rows[0] == ["0.500000", 0.125, 10, 20, 1, "", 2.5, *EMPTY] and len(host.rows) == 5


def test_a_look_that_ends_at_a_deadline_misses_it(monkeypatch):
    seen = Host(monkeypatch, [0.5, 0]).watch()
    assert seen.ticks == [100, 101] and seen.missed == 1


def test_the_last_row_is_of_the_end(monkeypatch):
    host = Host(monkeypatch, [0] * 99, told=102)
    seen = host.watch()
    assert seen.ticks == [100, 100.5, 101, 101.5] and seen.saw_end and seen.family is host
    assert host.rows[-1] == ["4.750000", 0.75, "", "", "", "", "", *EMPTY]
    assert all(len(row) == len(measurer.COLUMNS) for row in host.rows)


def test_without_a_last_word_there_is_no_last_row(monkeypatch):
    host = Host(monkeypatch, [0] * 99, told=101, words=b"")
    assert not host.watch().saw_end and len(host.rows) == 2


def test_a_renderer_that_is_gone_already():
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    seen = measurer.watch({**TARGET, "pid": gone.pid}, INTERVAL, None, None, None, None)
    assert seen == measurer.Watch()


MAIN = """
import sys
from types import SimpleNamespace
from harness.process import measurer
ticks, families = eval(sys.argv[2]), [SimpleNamespace(resolution=0.01, most=3, mark=5, pss=7, vms=8, files_peak=0)]
measurer.watch = lambda *_: measurer.Watch(ticks, 2, bool(ticks), families[0] if ticks else None)
measurer.main(sys.argv[1], 0.5)
"""


@pytest.mark.parametrize(
    ("ticks", "audit"),
    [
        ([], (0, 2, None, None, False, None, None, None, None, None, None)),
        ([0.0, 9.0, 10.0, 14.0], (4, 2, 4.0, 9.0, True, 0.01, 3, 5, 7, 8, 0)),
        ([0.0, 4.0, 7.0, 9.0, 10.0], (5, 2, 3.0, 4.0, True, 0.01, 3, 5, 7, 8, 0)),
    ],
)
def test_the_audit(tmp_path, ticks, audit):
    series = tmp_path / "series.csv"
    command = [sys.executable, "-c", MAIN, series, repr(ticks)]
    done = subprocess.run(command, input=b"{}\n", capture_output=True, timeout=60)
    ready, told = done.stdout.splitlines()
    names = (
        *("ticks", "missed", "interval_p50_s", "interval_p99_s", "saw_end"),
        *("resolution_s", "processes", "mark_bytes", "pss_peak_bytes", "vms_peak_bytes", "files_peak_bytes"),
    )
    told = json.loads(told)
    assert ready == b"ready" and tuple(told[name] for name in names) == audit
    assert told["interval_s"] == 0.5 and 0 <= told["cpu_s"] < 60
    assert series.read_text().splitlines() == [",".join(measurer.COLUMNS)]


def test_a_harness_that_is_gone_is_told_nothing(tmp_path):
    command = [sys.executable, "-c", MAIN, tmp_path / "series.csv", "[]"]
    done = subprocess.run(command, input=b"", capture_output=True, timeout=60)
    assert done.stdout == b"ready\n" and done.returncode == 0 and not (tmp_path / "series.csv").exists()


def start(series, **how):
    command = [sys.executable, "-m", "harness.process.measurer", series, "0.5"]
    buffered = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    return subprocess.run(command, capture_output="stdout" not in how, timeout=60, env=buffered, **how)


def test_as_a_program(tmp_path):
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    done = start(tmp_path / "series.csv", input=json.dumps({**TARGET, "pid": gone.pid}).encode() + b"\n")
    audit = json.loads(done.stdout.splitlines()[1])
    assert done.returncode == 0 and audit["interval_s"] == 0.5 and audit["ticks"] == 0
    assert (tmp_path / "series.csv").read_text().splitlines() == [",".join(measurer.COLUMNS)]


def test_it_ends_quietly_if_nobody_listens(tmp_path):
    read, write = os.pipe()
    os.close(read)
    done = start(tmp_path / "series.csv", stdin=subprocess.DEVNULL, stdout=write, stderr=subprocess.PIPE)
    os.close(write)
    assert (done.returncode, done.stderr) == (1, b"")


def test_a_series_that_cannot_be_written(tmp_path):
    done = start(tmp_path / "nowhere" / "series.csv", input=b"{}\n")
    assert done.returncode == 1
    assert done.stderr.decode() == f"measurer: {tmp_path / 'nowhere' / 'series.csv'}: No such file or directory\n"
