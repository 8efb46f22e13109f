"""A run that is asked to end, once or twice, or whose terminal is closed: it takes along what it started, says how to
go on, and what had finished is there. One that nobody listens to any more goes on."""

import contextlib
import json
import os
import pty
import re
import select
import shlex
import signal
import subprocess
import sys
import time

import faulty
import pytest

from harness.process import launcher
from harness.store import store


def heeding():
    """In a child: it heeds signals also where these tests run in the background, or under nohup."""
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


@pytest.fixture
def started(environment, tmp_path):
    """started(**how): a run that has finished the first of many repetitions; its process, folder, words to resume."""
    running = []

    def start(processes=40, **how):
        file, words = faulty.tiny(tmp_path / "tiny", processes=processes)
        folder = tmp_path / "run"
        (tmp_path / "tmp").mkdir()
        process = subprocess.Popen(
            [faulty.PROGRAM, "run", file, "--out", folder, *words],
            **{
                "env": {**environment, "TMPDIR": str(tmp_path / "tmp")}, "stdin": subprocess.DEVNULL,
                "stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "start_new_session": True,
                "preexec_fn": heeding, **how,
            },
        )  # fmt: skip
        running.append(process)
        rows = folder / "repetitions.jsonl"
        faulty.wait_until(lambda: rows.exists() and rows.read_bytes().count(b"\n") >= 1)
        return process, folder, ["run", file, "--resume", folder, *words]

    yield start
    for process in running:
        with contextlib.suppress(ProcessLookupError):
            process.kill()
        process.wait()


def command(said):
    """The words of the command that goes on with a run, as it says."""
    first, *words = shlex.split(re.search("go on with: (.*)", said)[1])
    assert first == "rayrace"
    return words


def check(folder, tmp_path, rayrace, resume):
    """Nothing runs, nothing is left in the folder for temporary files, rows are whole, and it can be gone on with."""
    faulty.wait_until(lambda: not faulty.processes_of(tmp_path / "tmp" / "rayrace-", tmp_path / "tiny" / "flat"), 20)
    assert not list((tmp_path / "tmp").iterdir())
    before = store.read(folder)[1]
    assert 0 < len(before) < 80 and all(record["status"] == "ok" for record in before)
    rayrace(*resume, "--set", f"processes={len(before)}", code=0)
    assert store.read(folder)[1][: len(before)] == before
    return len(before)


@pytest.mark.slow
@pytest.mark.parametrize("times", [1, 2, 5])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal(started, rayrace, tmp_path, injected, number, times):
    """Those that come while it tidies up change nothing."""
    process, folder, resume = started()
    for _ in range(times):
        os.kill(process.pid, number)
        time.sleep(0.05)
    said = process.communicate(timeout=60)[1].decode()
    # Of two Ctrl-C the second may meet the interpreter as it ends.
    assert process.returncode in ((130, -number)[: 1 + (times > 1)] if number == signal.SIGINT else (-number,))
    assert sorted(command(said)) == sorted(map(str, resume)) and "Traceback" not in said
    injected(signal.Signals(number).name, times)
    kept = check(folder, tmp_path, rayrace, command(said))
    assert f"stopped; {kept} of 120 repetitions are kept in {folder}; " in said  # 80, and the A/A pair
    print(f"{signal.Signals(number).name} x {times}: {kept} repetitions kept, lost: 0")


def in_a_terminal():
    """A pseudo-terminal: its master, and what a child does to have it as its own."""
    master, slave = pty.openpty()

    def preexec():
        heeding()
        os.setsid()
        os.close(os.open(os.ttyname(slave), os.O_RDWR))  # the first one that a session opens becomes its own

    return master, slave, preexec


@pytest.mark.slow
def test_a_terminal_that_is_closed(started, rayrace, tmp_path, injected):
    """SIGHUP from the system; each word that it says then is an error."""
    master, slave, preexec = in_a_terminal()
    process, folder, resume = started(
        stdin=slave, stdout=slave, stderr=slave, start_new_session=False, preexec_fn=preexec
    )
    os.close(slave)
    os.close(master)
    process.wait(timeout=60)
    assert process.returncode == -signal.SIGHUP
    check(folder, tmp_path, rayrace, resume)
    injected("terminal closed")


@pytest.mark.slow
@pytest.mark.parametrize("listener", ["terminal, nohup", "pipe"])
def test_nobody_listens_any_more(started, listener, injected):
    """What it measures is worth more than what it says."""
    if listener == "pipe":
        process, folder, _ = started(processes=4)
        process.stderr.close()
    else:
        master, slave, preexec = in_a_terminal()

        def ignoring():
            preexec()
            signal.signal(signal.SIGHUP, signal.SIG_IGN)

        process, folder, _ = started(
            processes=4, stdin=slave, stdout=slave, stderr=slave, start_new_session=False, preexec_fn=ignoring
        )
        os.close(slave)
        while select.select([master], [], [], 0)[0]:
            os.read(master, 4096)
        os.close(master)
    process.wait(timeout=120)
    assert len(store.read(folder)[1]) == 8 and process.returncode == 0
    assert "ended" in json.loads((folder / "run.json").read_text())
    injected("nobody listens")


@pytest.mark.parametrize("when", ["before its first word", "after it"])
def test_a_harness_that_dies_takes_the_renderer_along(tmp_path, when, injected):
    """Also in the moment between the start of the renderer and the launcher's word of it."""
    told = {
        "command": ["/bin/sleep", "1000"], "folder": str(tmp_path), "environment": {"MARK": str(tmp_path)},
        "limits": {}, "stdout": str(tmp_path / "o"), "stderr": str(tmp_path / "e"), "timeout": 1000,
        "places": [], "confined": True,
    }  # fmt: skip
    (tmp_path / "spec.json").write_text(json.dumps(told))
    process = subprocess.Popen(
        [sys.executable, "-I", "-S", launcher.__file__, tmp_path / "spec.json"], stdin=subprocess.PIPE,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    if when == "after it":
        pid = json.loads(process.stdout.readline())["pid"]
        assert os.path.exists(f"/proc/{pid}")
    process.stdout.close()
    process.stdin.close()
    said = process.stderr.read()
    process.stderr.close()
    process.wait(timeout=20)
    assert said == b"" and not faulty.processes_of(tmp_path)
    injected("harness dies as the renderer starts")
