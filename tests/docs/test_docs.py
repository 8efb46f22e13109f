"""What the documentation tells to type does what it says."""

import json
import re
import tomllib

import pytest
from compilers import compiler
from pages import DOCS, blocks

from harness.store import packed, store
from reports.run import results


@pytest.mark.slow
@pytest.mark.parametrize(("language", "file"), [("c", "flat.c"), ("python", "flat.py")])
def test_the_smallest_renderer(language, file, tmp_path, rayrace):
    """The page on adding a renderer, word for word: its files, and its commands with these files."""
    if language == "c":
        compiler("c")
    manifest = blocks("adding-a-renderer.md", "toml")[["python", "c"].index(language)]
    (program,) = blocks("adding-a-renderer.md", language)
    name = tomllib.loads(manifest)["variant"][0]["name"]
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "renderer.toml").write_text(manifest)
    (tmp_path / "mine" / file).write_text(program)
    (block,) = [text for text in blocks("adding-a-renderer.md") if text.startswith("rayrace ")]
    lines = [line.partition("#")[0].replace("FOLDER", "mine").replace("NAME", name) for line in block.splitlines()]
    check, every, few = (line.split()[1:] for line in lines)
    assert rayrace(*check, cwd=tmp_path, code=0).stdout.endswith("all checks passed\n")
    told = json.loads(rayrace(*every, "--dry-run", "--json", cwd=tmp_path, code=0).stdout)
    assert {name, "cpp", "numba"} < {cell["variant"] for cell in told["cells"]}
    rayrace(*few, cwd=tmp_path, code=0)
    (run,) = (tmp_path / "results").iterdir()
    rows = store.read(run)[1]
    assert {row["variant"] for row in rows} == {name, "python"}
    assert {row["status"] for row in rows} <= {"ok", "unsupported"}


@pytest.mark.slow
def test_the_first_experiment(tmp_path, rayrace):
    scene = next(block for block in blocks("first-experiment.md") if block.startswith("CAMERA"))
    (experiment,) = blocks("first-experiment.md", "toml")
    (tmp_path / "mine.txt").write_text(scene)
    (tmp_path / "mine.toml").write_text(experiment)
    small = ("--width", 32, "--height", 24, "--depth", 4, "--shadows")
    rayrace("render", tmp_path / "mine.txt", "-o", tmp_path / "mine.png", *small, code=0)
    few = ("--set", "processes=1", "--set", "frames=1", "--set", "image.width=16", "--set", "image.height=12")
    done = rayrace("run", tmp_path / "mine.toml", "--out", tmp_path / "run", "--report", *few, timeout=300, code=0)
    assert done.stdout.splitlines()[-1] == f"report: {tmp_path / 'run' / 'report' / 'report.html'}"
    assert (tmp_path / "run" / "report" / "report.html").stat().st_size > 1e6


@pytest.mark.parametrize("page", sorted(path.name for path in DOCS.glob("*.md")))
def test_commands_have_their_options(page, rayrace):
    """Every option that a page names is one of its command."""
    told = [line for block in blocks(page) for line in block.splitlines() if re.match(r"(\.venv/bin/)?rayrace ", line)]
    helps = {}
    for line in told:
        words = line.split("#")[0].split()
        command = words[1]
        if command not in helps:
            helps[command] = rayrace(command, "--help", code=0).stdout
        for word in words[2:]:
            if re.match(r"--?[a-z]", word):
                assert word.partition("=")[0] in helps[command], line


def test_marks_are_rare_where_little_else_runs():
    """The sentence of the page, from the runs that it names."""
    cells = processes = doubtful = 0
    for name in ("accuracy", "sweeps"):
        with packed.opened(DOCS.parent / "results" / "reference" / "epyc-2x" / f"{name}.tar.xz") as run:
            loaded = results.load(run)
        done = [told for told in loaded.records if told["status"] == "ok"]
        doubtful += sum(bool(told["warnings"]) for told in done)
        timed = [cell for cell in loaded.cells if cell.status == "ok"]
        assert not [cell for cell in timed if isinstance(cell.steady, results.Missing)]
        cells, processes = cells + len(timed), processes + len(done)
    text = " ".join((DOCS / "measuring-well.md").read_text("utf-8").split())
    assert f"of the {cells} cells of the" in text and f"{doubtful} of their {processes} processes have a doubt" in text
