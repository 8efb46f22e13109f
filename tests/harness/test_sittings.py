"""A test run that goes on where an earlier one ended (tests/support/sittings.py)."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

SUPPORT = Path(__file__).parents[1] / "support"
CONFTEST = """
import sittings

def pytest_configure(config):
    config.pluginmanager.register(sittings.Sittings(config))
"""
TESTS = """
import os
import pytest

@pytest.fixture
def late():
    yield
    assert "FAULT" not in os.environ

def test_good(): pass
def test_bad(): assert "FAULT" not in os.environ
def test_ends_badly(late): pass
def test_skipped(): pytest.skip("not here")
@pytest.mark.parametrize("word", ["a b", "\\n"])
def test_words(word): pass
"""


@pytest.mark.parametrize("processes", [0, 2])
def test_what_passed_is_left_out(tmp_path, processes):
    (tmp_path / "conftest.py").write_text(CONFTEST)
    (tmp_path / "test_it.py").write_text(TESTS)
    (tmp_path / "pytest.ini").write_text("[pytest]\n")

    def run(*words, code=0, **more):
        told = {**os.environ, "PYTHONPATH": str(SUPPORT), "RAYRACE_PASSED": "passed", "RAYRACE_SEED": "one", **more}
        told.pop("PYTEST_ADDOPTS", None)
        words = [sys.executable, "-m", "pytest", "-q", "-n", str(processes), "test_it.py", *words]
        done = subprocess.run(words, cwd=tmp_path, env=told, capture_output=True, text=True)
        assert done.returncode == code, done.stdout
        return done.stdout

    assert "1 failed, 4 passed, 1 skipped, 1 error" in run(FAULT="yes", code=1)
    kept = (tmp_path / "passed").read_text().splitlines()
    assert kept[0] == "one" and sorted(kept[1:]) == [
        r"test_it.py::test_good", r"test_it.py::test_words[\n]", "test_it.py::test_words[a b]",
    ]  # fmt: skip
    assert "2 passed, 1 skipped" in run()
    assert "\n1 skipped" in run()
    run("-k", "test_words")  # all of which had passed
    assert len((tmp_path / "passed").read_text().splitlines()) == 6
    refused = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "test_it.py"], cwd=tmp_path, capture_output=True, text=True,
        env={**os.environ, "PYTHONPATH": str(SUPPORT), "RAYRACE_PASSED": "passed", "RAYRACE_SEED": "two"},
    )  # fmt: skip
    assert refused.returncode and "these tests passed on one, and this is two" in refused.stderr
