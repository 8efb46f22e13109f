"""A lock of a file: it ends with its process, whatever is left of it, and a file system without locks is named."""

import errno
import os
import signal
import subprocess
import sys

import pytest

from harness.errors import UserError
from harness.renderer import builder
from harness.store import alone
from harness.system import lock

HOLD = """import sys
from harness.system import lock
with lock.of_file(sys.argv[1]):
    print("held", flush=True)
    sys.stdin.read()
"""


def test_a_killed_holder_blocks_nobody(tmp_path):
    file = tmp_path / "lock"
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with subprocess.Popen([sys.executable, "-c", HOLD, file], **pipes) as holder:
        assert holder.stdout.readline() == "held\n"
        with pytest.raises(lock.Busy), lock.of_file(file):
            pass
        holder.kill()
        holder.wait()
    with lock.of_file(file):
        assert file.exists()


def test_a_holder_that_removes_the_file(tmp_path):
    """Who waits for its lock then locks the file that others would find, not the one that is gone."""
    file, real = tmp_path / "lock", lock.take
    with pytest.MonkeyPatch.context() as patch:
        removed = []

        def take(descriptor, path, wait):
            if not removed:
                removed.append(path.unlink())
            real(descriptor, path, wait)

        patch.setattr(lock, "take", take)
        with lock.of_file(file):
            patch.undo()
            with pytest.raises(lock.Busy), lock.of_file(file):
                pass


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP])
def test_a_file_system_without_locks(number, tmp_path, monkeypatch):
    """It is told with the file and the remedy; a file that is there blocks nobody."""

    def flock(*_):
        raise OSError(number, os.strerror(number))

    monkeypatch.setenv("RAYRACE_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(lock.fcntl, "flock", flock)
    with pytest.raises(UserError) as caught, alone.only_one(tmp_path):
        pass
    why = f"its file system has no locks ({os.strerror(number)})"
    assert str(caught.value) == f"{tmp_path / '.lock'}: {why}; {alone.REMEDY}"
    with pytest.raises(builder.BuildError) as caught:
        builder.make("x", "", tmp_path, "sh", ("{compiler}", "-c", "true"))
    assert why in str(caught.value) and str(caught.value).endswith("RAYRACE_CACHE names another folder")
    monkeypatch.undo()
    with alone.only_one(tmp_path):
        pass


def test_a_signal_ends_the_wait(tmp_path):
    with lock.of_file(tmp_path / "lock"):
        words = [sys.executable, "-c", HOLD.replace("sys.argv[1])", "sys.argv[1], wait=True)"), tmp_path / "lock"]
        with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as waiting:
            with pytest.raises(subprocess.TimeoutExpired):
                waiting.wait(0.5)
            waiting.send_signal(signal.SIGTERM)
            assert waiting.wait(60) == -signal.SIGTERM
