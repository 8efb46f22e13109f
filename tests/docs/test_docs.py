"""What the documentation tells to type does what it says."""

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"


def blocks(page, language=""):
    """The blocks of code of a page in this language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", (DOCS / page).read_text("utf-8"), re.DOTALL | re.MULTILINE)


@pytest.mark.slow
def test_the_smallest_renderer_keeps_the_contract(tmp_path, rayrace):
    (manifest,), (program,) = (blocks("adding-a-renderer.md", language) for language in ("toml", "python"))
    (tmp_path / "flat").mkdir()
    (tmp_path / "flat" / "renderer.toml").write_text(manifest)
    (tmp_path / "flat" / "flat.py").write_text(program)
    done = rayrace("check", tmp_path / "flat", code=0)
    assert done.stdout.endswith("all checks passed\n")


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
