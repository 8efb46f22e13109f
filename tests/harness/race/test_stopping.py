"""A harness that is stopped takes the renderer under way with it and leaves the finished rows."""

import os
import pwd
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

GOOD = ("bad-nothing", "bad-obedient", "bad-blind", "bad-random")


def processes(*words):
    """Ids of the processes that have these words in their command."""
    found = []
    for place in Path("/proc").glob("[0-9]*"):
        try:
            command = (place / "cmdline").read_bytes().decode(errors="replace")
            if all(word in command for word in words):
                found.append(int(place.name))
        except OSError:
            pass
    return found


def wait_until(is_true, seconds=60):
    until = time.monotonic() + seconds
    while not is_true():
        assert time.monotonic() < until, "it never came true"
        time.sleep(0.02)


def hear_ctrl_c():
    """A shell starts what it runs in the background with SIGINT ignored, and so would this suite start its children."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@pytest.fixture
def started(experiment, bad_folder, environment, tmp_path):
    """A run that hangs in its last cell, that cell's renderer being under way; its folder."""
    folder = bad_folder(*GOOD, "bad-hang-child", name="stopped")
    file = experiment((*GOOD, "bad-hang-child"), 'seed = 4\ntimeout = "5 min"\n')
    program = Path(sys.executable).with_name("rayrace")
    command = [program, "run", file, "--out", tmp_path / "run", "--renderer", folder, "--set", "image.depth=2"]
    with open(tmp_path / "said", "w") as said:
        harness = subprocess.Popen(
            command, env=environment, stdout=said, stderr=said, start_new_session=True, preexec_fn=hear_ctrl_c
        )
    lines = tmp_path / "run" / "repetitions.jsonl"
    try:
        wait_until(lambda: len(processes(f"{folder}/main.py", "--variant=bad-hang-child")) >= 2)
        yield harness, folder, lines
    finally:
        if harness.poll() is None:
            harness.kill()
            harness.wait()
        for pid in processes(f"{folder}/main.py"):
            os.kill(pid, signal.SIGKILL)


def read_rows(rows, lines):
    found = rows(lines.parent)
    assert len(lines.read_text().splitlines()) == sum(map(len, found.values())) > 0
    assert all(row["status"] == "ok" for some in found.values() for row in some)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_stopped(number, started, rows):
    harness, folder, lines = started
    helpers = processes("harness.process.measurer") + processes("launcher.py")
    own = [pid for pid in helpers if parent(pid) == harness.pid]
    assert len(own) == 2
    os.kill(harness.pid, number)
    harness.wait(timeout=60)
    assert harness.returncode == (130 if number == signal.SIGINT else -number)
    if number == signal.SIGINT:
        said = (lines.parents[1] / "said").read_text()
        kept = f"{len(lines.read_text().splitlines())} of 5 repetitions are kept in {lines.parent}"
        options = ["--set", "image.depth=2", "--renderer", folder, "--resume", lines.parent]
        words = ["rayrace", "run", lines.parents[1] / "experiment.toml", *options]
        assert said.splitlines()[-1] == f"stopped; {kept}; go on with: {shlex.join(map(str, words))}"
        assert "Traceback" not in said
    wait_until(lambda: not processes(f"{folder}/main.py"))
    wait_until(lambda: not any(os.path.exists(f"/proc/{pid}") for pid in own))
    read_rows(rows, lines)


def parent(pid):
    """None if it has ended: other tests have processes too."""
    try:
        return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])
    except OSError:
        return None


HOLDER = """import pathlib, sys
from harness.race import host
from harness.store import alone
folder = pathlib.Path(sys.argv[1])
folder.mkdir()
with alone.only_one(folder), host.ThisHost().exclusive():
    print("held", flush=True)
    sys.stdin.read()
"""


JOB = "-r", "python", "--width", "4", "--height", "4"
WAITING = {
    "run": ("run", "e.toml", "--out", "run"),
    "needs": ("needs", "scene.txt", *JOB, "--processes", "1"),
    "max-error": ("render", "scene.txt", "--max-error", "0.5", *JOB),
}


@pytest.fixture
def start_waiting(environment, tmp_path):
    """Starts a process that measures, in a folder, and another command of rayrace, which waits for it.

    Returns both, and the line that the latter says.
    """
    begun = []

    def start(measuring, command="run"):
        (tmp_path / "scene.txt").write_text("CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\n")
        (tmp_path / "e.toml").write_text('title = "t"\nscenes = ["scene.txt"]\nrenderers = ["python"]\nprocesses = 1\n'
                                         "[image]\nwidth = 4\nheight = 4\n")  # fmt: skip
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        holder = subprocess.Popen([sys.executable, "-c", HOLDER, measuring], env=environment, **pipes)
        begun.append(holder)
        assert holder.stdout.readline() == "held\n"
        words = [Path(sys.executable).with_name("rayrace"), *WAITING[command]]
        waiting = subprocess.Popen(
            words, env=environment, cwd=tmp_path, stderr=subprocess.PIPE, text=True, preexec_fn=hear_ctrl_c
        )
        begun.append(waiting)
        return holder, waiting, waiting.stderr.readline()

    yield start
    for process in begun:  # a holder left behind would keep all later tests waiting
        process.kill()
        process.communicate()


@pytest.mark.parametrize("command", WAITING)
def test_the_lock_of_measuring(start_waiting, tmp_path, command):
    """While one rayrace measures, another one that times anything waits, and says for which."""
    holder, waiting, said = start_waiting(tmp_path / "a folder", command)
    user = pwd.getpwuid(os.getuid()).pw_name
    who = f"process {holder.pid} of {user}, {tmp_path / 'a folder'}"
    assert said == f"another rayrace is measuring on this machine, {who}; waiting for it to end\n"
    assert not (tmp_path / "run" / "run.json").exists() and not (tmp_path / "picture.png").exists()
    holder.communicate()
    waiting.communicate(timeout=300)
    assert waiting.returncode == 0


def test_a_command_that_measures_without_a_run_is_named(environment, tmp_path):
    """Of two commands at once the second waits for the first, and says which that is."""
    (tmp_path / "scene.txt").write_text("CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\n")
    long, begun = ("needs", "scene.txt", *JOB, "--processes", "1000"), []

    def start(*words):
        command = [Path(sys.executable).with_name("rayrace"), *words]
        pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
        begun.append(subprocess.Popen(command, env=environment, cwd=tmp_path, text=True, **pipes))
        return begun[-1]

    lock = f"@rayrace-measuring{environment['RAYRACE_LOCK']}"
    try:
        first = start(*long)
        wait_until(lambda: lock in Path("/proc/net/unix").read_text(), 300)
        second = start(*WAITING["max-error"])
        user = pwd.getpwuid(os.getuid()).pw_name
        who = f"process {first.pid} of {user}, rayrace {shlex.join(long)}"
        said = second.stderr.readline()
        assert said == f"another rayrace is measuring on this machine, {who}; waiting for it to end\n"
        assert second.poll() is None
        first.kill()
        second.communicate(timeout=300)
        assert second.returncode == 0
    finally:
        for process in begun:
            process.kill()


def test_ctrl_c_while_waiting_claims_no_run(start_waiting, tmp_path):
    _, waiting, _ = start_waiting(tmp_path / "other")
    waiting.send_signal(signal.SIGINT)
    _, said = waiting.communicate(timeout=60)
    assert said.splitlines()[0] == "stopped; nothing was measured" and "--resume" not in said and "run:" not in said
    assert waiting.returncode == 130 and not (tmp_path / "run").exists()


DROPPED = """import os, signal
from harness.race import stopping
class Dying:
    def __del__(self):
        os.kill(os.getpid(), signal.%s)
        for _ in range(1000): pass
stopping.heed()
Dying()
try:
    stopping.heed_again()
except BaseException as error:
    print(type(error).__name__, error)
stopping.heed_again()
print("on")
"""


@pytest.mark.parametrize(("name", "told"), [("SIGTERM", "Stopped SIGTERM"), ("SIGINT", "KeyboardInterrupt ")])
def test_a_signal_in_a_destructor_is_heeded_later(name, told):
    """Python drops what is raised there."""
    done = subprocess.run(
        [sys.executable, "-c", DROPPED % name], capture_output=True, text=True, timeout=60, preexec_fn=hear_ctrl_c
    )
    assert done.stdout.splitlines() == [told, "on"] and "Exception ignored" in done.stderr, done.stderr
