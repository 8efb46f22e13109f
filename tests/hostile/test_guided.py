"""Hostile input that a fuzzer finds which sees what code it reaches (tests/support/guided.py)."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import hostile
import pytest

GUIDED = Path(__file__).parents[1] / "support" / "guided.py"
KINDS = "scene text", "NFF", "RAYS.csv", "renderer.toml", "experiment", "lines of a renderer", "stored runs"


@pytest.mark.nightly("it needs atheris, which CI does not install; CI draws cases at random (test_cases)")
@pytest.mark.parametrize("kind", KINDS)
def test_guided(kind, tmp_path, record_property):
    if importlib.util.find_spec("atheris") is None:
        pytest.skip("no atheris here (pip install -e '.[fuzz]')")
    done = subprocess.run(
        [sys.executable, GUIDED, kind, str(hostile.CASES)],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, (GUIDED.parents[2], *sys.path[:1])))},
        capture_output=True,
        text=True,
        errors="replace",
    )
    assert done.returncode == 0, done.stderr[-5000:]
    record_property("hostile", (f"{kind}, guided", hostile.CASES))
