"""How the launcher looks at the limits of a renderer."""

import subprocess
import sys
import time

import pytest

from harness.process import launcher

# Burns so many seconds of CPU time for each line that comes, and says so; between lines it waits.
BURNS = """
import sys, time
for line in sys.stdin:
    end = time.process_time() + float(line)
    while time.process_time() < end:
        pass
    print("done", flush=True)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the system tells no CPU time of others")
def test_who_waits_is_not_looked_at_again(monkeypatch, tmp_path):
    """Not before it has used CPU time: what it holds and has written stays as it was."""
    root = subprocess.Popen([sys.executable, "-c", BURNS], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    monkeypatch.setattr(launcher, "family", lambda: [root.pid])
    looks = []

    class Counting(launcher.Limits):
        def written(self):
            looks.append(1)
            return super().written()

    def work(seconds):
        root.stdin.write(f"{seconds}\n")
        root.stdin.flush()
        assert root.stdout.readline() == "done\n"
        time.sleep(0.2)  # until it waits again

    try:
        work(0.0)
        limits = Counting({"disk": 10**9, "memory": 10**12}, [], [tmp_path], 0, launcher.MemoryFiles())
        for _ in range(5):
            assert limits.look(time.monotonic()) is None
        assert len(looks) == 1 and limits.due > time.monotonic()
        work(0.1)
        for _ in range(5):
            assert limits.look(time.monotonic()) is None
        assert len(looks) == 2
        (tmp_path / "large").write_bytes(b"x" * 100_000)
        limits.limits["disk"] = 50_000
        assert limits.look(time.monotonic()) is None  # by nobody of the family, as it waits
        work(0.1)
        assert limits.look(time.monotonic()) == ["disk", 102_400]
    finally:
        root.kill()
        root.communicate()


def test_processes_that_cannot_be_told_are_always_looked_at(monkeypatch):
    monkeypatch.setattr(launcher, "family", lambda: [2**22 + 1])  # no process has such a number
    assert launcher.cpu_ticks([2**22 + 1]) is None
    limits = launcher.Limits({"memory": 10**12}, [], [], 0, launcher.MemoryFiles())
    looks = []
    monkeypatch.setattr(limits, "written", lambda: looks.append(1) or [])
    for _ in range(3):
        limits.look(time.monotonic())
    assert len(looks) == 3
