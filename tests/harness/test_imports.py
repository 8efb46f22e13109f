"""Who may import what: the contracts of pyproject.toml, and what processes really load."""

import ast
import re
import resource
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from harness.process import launcher, repetition
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten

pytestmark = pytest.mark.alone

REPOSITORY = Path(__file__).parents[2]
HEAVY = {"pandas", "matplotlib", "pydantic", "scipy", "rich", "typer", "psutil", "PIL", "harness", "reports", "rayrace"}


def imported(trace, at_least=0):
    """Top-level modules in what -X importtime printed; those that took `at_least` so many microseconds."""
    found = re.findall(r"import time: .*\| *(\d+) \| *(\w+)$", trace, re.M)
    return {name for took, name in found if int(took) >= at_least}


def test_contracts():
    done = subprocess.run(
        [Path(sys.executable).with_name("lint-imports"), "--no-cache"], cwd=REPOSITORY, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert " 0 broken" in done.stdout


# Programs of their own, whose output others read: a protocol, or the log of a job.
PROGRAMS = "process/measurer.py", "cluster/part.py", "executors/dask_task.py", "scene/generate/comparison.py"


def test_the_harness_computes_and_the_commands_print():
    found = []
    for file in sorted((REPOSITORY / "harness").rglob("*.py")):
        if file.relative_to(REPOSITORY / "harness").as_posix() in PROGRAMS:
            continue
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            name = node.func if isinstance(node, ast.Call) else None
            prints = isinstance(name, ast.Name) and name.id == "print"
            ends = isinstance(node, ast.Raise) and "SystemExit" in ast.unparse(node)
            ends |= isinstance(name, ast.Attribute) and ast.unparse(name) == "sys.exit"
            if prints or ends:
                found.append(f"{file.relative_to(REPOSITORY)}:{node.lineno}")
    assert found == []


def test_launcher_imports_only_the_standard_library():
    names = set()
    for node in ast.walk(ast.parse(Path(launcher.__file__).read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names.add("." * node.level + (node.module or ""))
    assert names and {name.split(".")[0] for name in names} <= sys.stdlib_module_names


def test_launcher_stays_small():
    """What it loads is part of the floor below every peak from wait4."""
    command = [sys.executable, "-I", "-S", "-X", "importtime", launcher.__file__, "/nowhere.json"]
    loaded = imported(subprocess.run(command, capture_output=True, text=True).stderr)
    assert not loaded & {"subprocess", "ctypes", "asyncio", "multiprocessing", "logging", "typing", "site"}


@pytest.mark.parametrize("name", ["python", "numpy", "numba"])
def test_a_measured_process_imports_its_own_technology(name, known, tmp_path):
    entry = known[name]
    if entry.unavailable:
        pytest.skip(entry.unavailable)
    python, *rest = entry.variant.command
    traced = replace(entry, variant=entry.variant.model_copy(update={"command": (python, "-X", "importtime", *rest)}))
    scene = flatten(
        text.read("CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\nSPHERE (0,0,-1) 0.8 (0.7,0.5,0.3) 0 1 (0,0,0) 1e6 1")
    )
    result = repetition.run(traced, scene, Parameters(width=4, height=4), ("sphere",), log=tmp_path / "log")
    assert result.status == "ok", result.reason
    # A module that is asked for and refused, as numba's scipy is, has a line too, of some microseconds.
    loaded = imported((tmp_path / "log.stderr").read_text(), at_least=50)
    own = entry.renderer.manifest.name
    assert not loaded & HEAVY
    wanted = {"python": set(), "numpy": {"numpy"}, "numba": {"numba", "numpy"}}[own]
    assert "renderers" in loaded and loaded & {"numpy", "numba"} == wanted


def test_help_loads_nothing_heavy():
    command = [sys.executable, "-X", "importtime", "-m", "rayrace", "--help"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0 and "Races ray tracers" in done.stdout
    assert not imported(done.stderr) & {"pandas", "matplotlib", "numba", "scipy", "numpy", "pydantic", "psutil"}


@pytest.mark.parametrize(
    "words",
    [
        ("run", "smoke", "--dry-run"),
        ("render", "local", "-r", "python", "--width", "4", "--height", "4", "-o", "a.png"),
        ("list",),
        ("experiments",),
    ],
    ids=" ".join,
)
def test_what_only_reports_need_is_loaded_by_them_alone(words, tmp_path):
    """pandas takes seconds to load, several times as long as these commands."""
    command = [sys.executable, "-X", "importtime", "-m", "rayrace", *words]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    loaded = imported(done.stderr)
    assert "harness" in loaded and not loaded & {"pandas", "matplotlib", "numba", "scipy", "pyarrow"}


def test_help_is_quick():
    """Some 0.3 s of processor time, whatever else runs; the quickest of five, with room for slower machines."""
    times = []
    for _ in range(5):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([Path(sys.executable).with_name("rayrace"), "--help"], stdout=subprocess.DEVNULL, check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        times.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    assert 0 < min(times) < 1, times
