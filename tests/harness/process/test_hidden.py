"""Where references and the key of their checksums are stands in no environment that a renderer can read."""

import json
import os
import subprocess
import sys

import pytest

from harness.process import launcher, process

TRY = """import json, os, sys
def read(path):
    try:
        return open(path, "rb").read().decode(errors="replace")
    except OSError as error:
        return error.strerror
told = {path: read(path) for path in sys.argv[1:]}
told["parent"] = read(f"/proc/{os.getppid()}/environ")
told["own"] = "".join(f"{name}={value}" for name, value in os.environ.items())
open("made", "w").write("x")
told["made"] = read("made")
print(json.dumps(told))
"""


@pytest.fixture(scope="module")
def landlock():
    code = f"import sys; sys.path.insert(0, {os.path.dirname(launcher.__file__)!r}); import launcher; "
    done = subprocess.run([sys.executable, "-c", code + "print(launcher.confine())"], capture_output=True)
    if done.stdout.strip() != b"True":
        pytest.skip("this kernel has no Landlock (Linux 5.19)")


@pytest.fixture
def tried(tmp_path):
    """tried(path, ..): what a renderer reads there."""

    def tried(*paths):
        folder = tmp_path / "job" / "neutral"
        folder.mkdir(parents=True, exist_ok=True)
        command = [sys.executable, "-c", TRY, *map(str, paths)]
        outcome = process.run(command, folder, tmp_path / "stdout", tmp_path / "stderr", 60)
        assert outcome.code == 0, (tmp_path / "stderr").read_text()
        return json.loads((tmp_path / "stdout").read_text())

    return tried


def test_other_processes(tried, tmp_path, landlock):
    """Their memory and environment are out of reach; files are not, those that are made later included."""
    (tmp_path / "x").write_text("content")
    memory, environment = (f"/proc/{os.getpid()}/{name}" for name in ("mem", "environ"))
    told = tried(tmp_path / "x", memory, environment)
    assert told[f"{tmp_path}/x"] == "content" and told["made"] == "x"
    assert told[memory] == "Permission denied"
    assert told[environment] == "Permission denied" or os.geteuid() == 0  # Linux lets root read any (CAP_PERFMON)


def test_no_environment_says_where_they_are(tried, tmp_path, monkeypatch):
    monkeypatch.setenv("RAYRACE_CACHE", str(tmp_path / "a-cache"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "a-state"))
    told = tried()
    for place in ("a-cache", "a-state"):
        assert place not in told["own"] and place not in told["parent"]
    assert "PATH=" in told["parent"]
