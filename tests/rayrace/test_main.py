"""Standard streams that are closed, full or not read: a command does its work, or says what is wrong."""

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = Path(sys.executable).with_name("rayrace")


def shell(environment, command):
    words = ["sh", "-c", command.replace("RAYRACE", shlex.quote(str(PROGRAM)))]
    done = subprocess.run(words, env=environment, capture_output=True, text=True, timeout=300)
    assert "Traceback" not in done.stderr and "Exception ignored" not in done.stderr, done.stderr
    return done


@pytest.mark.parametrize("closed", [">&-", "<&- >&-", ">&- 2>&-", "<&- >&- 2>&-"])
def test_closed_streams(closed, environment, tmp_path):
    """Nothing that is written to them comes into a file that got their number."""
    done = shell(environment, f"RAYRACE list {closed}")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    (tmp_path / "s.txt").write_text("CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\n")
    words = f"render {tmp_path}/s.txt -r python --width 3 --height 2"
    for name, end in (("a", closed), ("b", "")):
        done = shell(environment, f"RAYRACE {words} -o {tmp_path}/{name}.npy {end}")
        assert done.returncode == 0, done.stderr
    assert (tmp_path / "a.npy").read_bytes() == (tmp_path / "b.npy").read_bytes()


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="this system has no /dev/full")
@pytest.mark.parametrize("command", ["list", "list --json", "generate comparison"])
def test_output_that_cannot_be_written(command, environment):
    done = shell(environment, f"RAYRACE {command} > /dev/full")
    assert done.returncode == 2 and done.stderr.startswith("error: ")
    assert done.stderr.endswith(": No space left on device\n") and done.stderr.count("\n") == 1


def test_output_that_nobody_reads(environment):
    done = shell(environment, "(RAYRACE generate comparison; echo $? >&2) | true")
    assert done.stderr.splitlines() in (["0"], ["1"])  # 0 if it was read before the pipe was closed
