"""The lock of the machine, of all users and temporary folders: who waits hears for whom, and nothing stale blocks."""

import contextlib
import errno
import os
import pwd
import secrets
import select
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from harness.race import host
from harness.system import machine_lock

MEASURE = """import encodings.unicode_escape, os, sys
from harness.race import host
if user := int(sys.argv[1]):  # not sooner, as another user may read neither this interpreter nor our modules
    os.setgroups([])
    os.setresgid(user, user, user)
    os.setresuid(user, user, user)
    os.umask(0o077)
with host.host_lock(lambda text: print(text, file=sys.stderr, flush=True)):
    print("held", flush=True)
    sys.stdin.read()
"""
ROOT = Path(__file__).parents[3]
SECOND = 65534  # a user who is on every system, as nobody


@pytest.fixture(params=["abstract socket", "file"])
def measure(request, tmp_path):
    """measure(user, folder): a process that takes the lock of this test's machine, by either way."""
    name = f"-{secrets.token_hex(8)}"
    begun, program = [], MEASURE
    if request.param == "file":
        program = f"from harness.system import machine_lock\nmachine_lock._has_names = lambda: False\n{MEASURE}"
    elif not machine_lock._has_names():
        pytest.skip("this system has no abstract sockets")

    def start(user=0, folder=tmp_path):
        known = {**os.environ, "TMPDIR": str(folder), "PYTHONPATH": str(ROOT), "RAYRACE_LOCK": name}
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "bufsize": 0}
        words = [sys.executable, "-P", "-c", program, str(user)]
        begun.append(subprocess.Popen(words, cwd="/", env=known, **pipes))
        return begun[-1]

    start.file = Path(f"/tmp/rayrace-measuring{name}.lock")
    yield start
    for process in begun:
        process.kill()
        process.communicate()
    start.file.unlink(missing_ok=True)


def line(file, seconds=60.0):
    """The next line of a process; "" if it does not come."""
    return file.readline().decode() if select.select([file], [], [], seconds)[0] else ""


def name_of(user):
    with contextlib.suppress(KeyError):
        return pwd.getpwuid(user).pw_name
    return f"user {user}"


def told(process, user):
    return f"another rayrace is measuring on this machine, process {process.pid} of {name_of(user)}, "


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can start the process of a second user")
@pytest.mark.parametrize("users", [(0, SECOND), (SECOND, 0)], ids=["root first", "the other first"])
def test_two_users_with_two_temporary_folders(measure, tmp_path, users):
    """The second waits for the first, and names it; when the first is killed, the second has the lock."""
    (tmp_path / "other").mkdir()
    first, second = measure(users[0]), None
    assert line(first.stdout) == "held\n"
    second = measure(users[1], tmp_path / "other")
    said = line(second.stderr)
    assert said.startswith(told(first, users[0])) and said.endswith("; waiting for it to end\n"), said
    assert f"{sys.executable} -P -c" in said
    assert line(second.stdout, 1.0) == "" and second.poll() is None
    first.kill()
    assert line(second.stdout) == "held\n"


def test_who_waits_hears_of_each_holder(measure):
    """And of none twice; it takes no processor time meanwhile."""
    first = measure()
    assert line(first.stdout) == "held\n"
    others = [measure(), measure()]
    for other in others:
        assert line(other.stderr).startswith(told(first, os.getuid()))
    before = [cpu(other.pid) for other in others]
    time.sleep(2.5)
    assert [cpu(other.pid) - used <= 0.02 for other, used in zip(others, before, strict=True)] == [True, True]
    first.communicate(b"")
    ready = select.select([other.stdout for other in others], [], [], 60)[0]
    ahead, behind = others if others[0].stdout in ready else reversed(others)
    assert line(ahead.stdout) == "held\n"
    assert line(behind.stderr).startswith(told(ahead, os.getuid()))
    ahead.communicate(b"")
    assert line(behind.stdout) == "held\n"


def cpu(pid):
    user, system = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


@pytest.mark.parametrize("content", ["", "1 0\n", "rubbish"])
def test_what_others_left_blocks_nobody(content, measure, tmp_path):
    """Neither an empty file, as the lock of an older version, nor one with the number of a process that is there."""
    for place in (tmp_path / "rayrace-measuring.lock", measure.file):
        place.write_text(content)
    process = measure()
    assert line(process.stdout) == "held\n"


def test_a_holder_who_does_not_say_who_it_is(monkeypatch):
    """A name that is taken and not listened to, as by another program."""
    if not machine_lock._has_names():
        pytest.skip("this system has no abstract sockets")
    monkeypatch.setattr(machine_lock, "ADDRESS", f"\0test-{secrets.token_hex(8)}")
    monkeypatch.setattr(machine_lock, "AGAIN", 0.001)
    heard = []
    with socket.socket(socket.AF_UNIX) as other:
        other.bind(machine_lock.ADDRESS)

        def busy(holder):
            heard.append(host._who(holder))
            other.close()

        with machine_lock.locked(busy):
            pass
    assert heard == ["a process whose number the system does not tell"]


def test_a_process_that_may_have_no_socket(monkeypatch, tmp_path):
    """It locks the file."""

    def refuse(*_):
        raise OSError(errno.EPERM, os.strerror(errno.EPERM))

    monkeypatch.setattr(machine_lock.socket, "socket", refuse)
    monkeypatch.setattr(machine_lock, "FILE", tmp_path / "lock")
    with machine_lock.locked():
        assert (tmp_path / "lock").read_text() == f"{os.getpid()} {os.getuid()}\n"
    with machine_lock.locked():  # the file that is left blocks nobody
        pass
