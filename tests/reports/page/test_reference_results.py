"""The reference results: small, of named machines, and enough for every table and figure of the study but a GPU's."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import command_line
import numpy as np
import pytest
from PIL import Image

from harness.store import packed, store
from reports.run import study

REPOSITORY = Path(__file__).parents[3]
FOLDER = REPOSITORY / "results" / "reference"
RUNS = sorted(FOLDER.glob("*/*.tar.xz"))
LIMIT = 40_000_000  # bytes of all files together
FIGURES = "times", "accuracy", "sweeps", "gpu"  # of README and docs
FAILING = "overview", "overview-naive", "window", "huge-sphere", "drift", "slabs", "table"  # in docs/stability
OUR_PATHS = re.compile(r'"/(?!(?:usr|sys|proc|dev|etc)/)[^"/]+/[^"]*"')  # not the system's


def test_the_folder_is_small():
    assert RUNS and sum(path.stat().st_size for path in FOLDER.rglob("*") if path.is_file()) <= LIMIT


@pytest.mark.parametrize("run", RUNS, ids=lambda path: f"{path.parent.name}-{packed.name(path)}")
def test_a_run_is_whole_and_says_where_it_is_from(run):
    with packed.opened(run) as folder:
        facts, records = store.read(folder)
        text = (folder / "run.json").read_text("utf-8")
        assert facts["ended"] and len(records) >= sum(1 for _ in facts["cells"])
        assert facts["environment"]["commit"] and "dirty" not in facts["environment"]["commit"]
        assert f"experiments/{packed.name(run)}.toml" in facts["command"]
        assert not OUR_PATHS.findall(text)
    assert f"| {run.parent.name} |" in (FOLDER / "README.md").read_text("utf-8")


@pytest.mark.parametrize("machine", sorted({path.parent for path in RUNS}), ids=lambda path: path.name)
def test_all_runs_of_a_machine_are_of_one_processor(machine):
    found = set()
    for run in sorted(machine.glob("*.tar.xz")):
        with packed.opened(run) as folder:
            found.add(store.read(folder)[0]["environment"]["cpu"])
    assert len(found) == 1, found


@pytest.mark.nightly(
    "test_every_number_is_there_or_why_not has its sections by day; all reference results take about a minute"
)
@pytest.mark.slow
def test_one_command_makes_every_table_and_figure_of_the_study(tmp_path, monkeypatch):
    """Where there is neither a compiler nor a GPU; and again they are the same."""
    monkeypatch.setenv("PATH", str(tmp_path / "nothing"))
    assert shutil.which("c++") is None
    command_line.rayrace("report", *RUNS, "-o", tmp_path / "out", timeout=1800)
    text = (tmp_path / "out" / "report.md").read_text("utf-8")
    again = text.partition("## The study again")[2]
    parts = dict(part.split("\n", 1) for part in re.split(r"^### ", again, flags=re.MULTILINE)[1:])
    bodies = {title.partition(":")[0].lower(): body for title, body in parts.items()}
    for name in study.NUMBERED:
        if name in study.ON_A_GPU:
            assert bodies[name].strip().startswith("unavailable: none of these runs has it") or "From [" in bodies[name]
        else:
            assert "From [" in bodies[name] and ("\n| " in bodies[name] or "![" in bodies[name])
    for link in re.findall(r"\]\(([^)#:]+)\)", text):
        assert (tmp_path / "out" / link).exists(), link
    assert (tmp_path / "out" / "report.html").stat().st_size < 8_000_000


@pytest.mark.slow
def test_the_pictures_of_the_pages_come_from_here(tmp_path):
    done = subprocess.run(
        [sys.executable, REPOSITORY / "docs" / "pictures.py", tmp_path], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    names = *FIGURES, *(f"stability/{name}" for name in FAILING)
    figures = {f"{name}.{kind}" for name in names for kind in ("svg", "json")}
    made = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*") if path.is_file()}
    assert made == {"comparison.png", "gallery.png", *figures}
    for name in ("comparison.png", "gallery.png"):
        made, kept = (np.asarray(Image.open(folder / name)) for folder in (tmp_path, REPOSITORY / "docs"))
        np.testing.assert_array_equal(made, kept)
    for name in (f"{name}.json" for name in names):
        made, kept = (json.loads((folder / name).read_text()) for folder in (tmp_path, REPOSITORY / "docs"))
        assert made["data_sha256"] == kept["data_sha256"], name
