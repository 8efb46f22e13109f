"""Compiles and runs cpp_glass.cpp: the optics of renderers/cpp, function by function, against closed forms."""

import subprocess
from pathlib import Path

import pytest

from harness.renderer.builder import find_compiler

HERE = Path(__file__).parent


@pytest.mark.skipif(find_compiler("c++") is None, reason="no C++ compiler")
def test_glass(tmp_path):
    flags = ["-std=c++20", "-O1", "-ffp-contract=off", "-pthread", "-Wall", "-Wextra", "-Werror"]
    sources = ["-I", HERE.parents[1] / "renderers" / "cpp", HERE / "cpp_glass.cpp", "-o", tmp_path / "glass"]
    subprocess.run([find_compiler("c++"), *flags, *sources], check=True)
    done = subprocess.run([tmp_path / "glass"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout
