"""Who holds a lock is found, and nobody is named who does not."""

import os
import subprocess
import sys

from harness.system import holder
from harness.system.lock import of_file

HOLD = """import sys
from harness.system import lock
kept = open(sys.argv[2])
with lock.of_file(sys.argv[1]):
    print("held", flush=True)
    sys.stdin.read()
"""


def test_the_process_that_holds_a_lock(tmp_path):
    lock, other = tmp_path / "x.lock", tmp_path / "other"
    assert holder.find(lock) is None
    lock.touch()
    other.touch()
    words = [sys.executable, "-c", HOLD, lock, other]
    process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "held\n"
    with open(lock):  # has it open, and does not hold it
        found = holder.find(lock)
    assert found == process.pid and {lock, other} <= set(holder.opened(found))
    assert holder.command(found).startswith(rf"{sys.executable} -c 'import sys\n")
    process.communicate()
    assert holder.find(lock) is None


def test_another_file_of_that_number(tmp_path, monkeypatch):
    """The table names devices in a way of its own on some file systems: only who has the very file open counts."""
    lock = tmp_path / "x.lock"
    with of_file(lock):
        assert holder.find(lock) is not None
        (tmp_path / "y.lock").touch()
        assert holder.find(tmp_path / "y.lock") is None


def test_a_process_of_another_user(tmp_path, monkeypatch):
    def refuse(path):
        raise PermissionError

    lock = tmp_path / "x.lock"
    with of_file(lock):
        monkeypatch.setattr(holder.os, "scandir", refuse)
        assert holder.find(lock) == os.getpid() and holder.opened(os.getpid()) == []
