"""What decides which picture is right is hidden from renderers: references, the key of their checksums, the run's."""

import json
import os
import subprocess
import sys

import pytest

from harness.judge import cache
from harness.judge.cache import Kept
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
    done = subprocess.run([sys.executable, "-c", code + "print(launcher.hide(['/usr/lib']))"], capture_output=True)
    if done.stdout.strip() != b"True":
        pytest.skip("this kernel has no Landlock (Linux 5.13)")


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


def test_a_folder_that_is_hidden(tried, tmp_path, monkeypatch, landlock):
    monkeypatch.setattr(process, "HIDDEN", set())
    for name in ("place/hidden/x", "place/beside/x", "x"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("content")
    (tmp_path / "place" / "link").symlink_to(tmp_path / "place" / "hidden")
    process.hide(tmp_path / "place" / "hidden")
    process.hide(tmp_path / "absent")
    names = "place/hidden/x", "place/link/x", "place/hidden/../hidden/x", "place/beside/x", "x"
    told = tried(*(tmp_path / name for name in names))
    assert [told[f"{tmp_path}/{name}"] for name in names] == ["Permission denied"] * 3 + ["content"] * 2
    assert told["made"] == "x"


def test_references_and_their_key(tried, tmp_path, monkeypatch, landlock):
    """Also where the cache is new."""
    monkeypatch.setattr(process, "HIDDEN", set())
    monkeypatch.setenv("RAYRACE_CACHE", str(tmp_path / "cache"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    cache._secret.cache_clear()
    try:
        Kept(tmp_path / "cache" / "references").put("a" * 16, {}, {})
    finally:
        cache._secret.cache_clear()
    key, file = tmp_path / "state" / "rayrace" / "references.key", tmp_path / "cache" / "references" / f"{'a' * 16}.npz"
    assert key.stat().st_mode & 0o777 == 0o600 and file.exists()
    told = tried(key, file)
    assert told[str(key)] == told[str(file)] == "Permission denied"


def test_no_environment_says_where_they_are(tried, tmp_path, monkeypatch):
    monkeypatch.setenv("RAYRACE_CACHE", str(tmp_path / "a-cache"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "a-state"))
    told = tried()
    for place in ("a-cache", "a-state"):
        assert place not in told["own"] and place not in told["parent"]
    assert "PATH=" in told["parent"]
