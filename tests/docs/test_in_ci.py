"""The recipe for CI, as its page has it, on a repository with a renderer of a few lines."""

import pytest
from pages import blocks
from repositories import git

PAGE = "in-ci.md"
SCENE = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\nBACKGROUND (0.2,0.5,0.7)\n"
WORK = "pixels = background * ((x1 - x0) * (y1 - y0))"  # of flat.py
# The page's experiment, but for its times: pictures of a few pixels.
SMALL = "--set", "image.width=12", "--set", "image.height=9", "--set", "processes=8", "--set", "frames=3"


def write(tree, loops):
    """The renderer of the page on adding one, called mine, whose frames take so many turns of an empty loop."""
    mine = tree / "renderers" / "mine"
    mine.mkdir(parents=True, exist_ok=True)
    manifest, _ = blocks("adding-a-renderer.md", "toml")
    (program,) = blocks("adding-a-renderer.md", "python")
    assert program.count(WORK) == 1
    (mine / "renderer.toml").write_text(manifest.replace('"flat"', '"mine"'))
    (mine / "flat.py").write_text(program.replace(WORK, f"{WORK}\n    for _ in range({loops}): pass"))


@pytest.fixture
def tree(tmp_path):
    """A repository with the page's experiment, its scene and renderer; origin/main is its commit."""
    (experiment,) = blocks(PAGE, "toml")
    (tmp_path / "speed.toml").write_text(experiment)
    (tmp_path / "scene.txt").write_text(SCENE)
    write(tmp_path, 1_000_000)
    git(tmp_path, "init", "-q")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-qm", "before")
    git(tmp_path, "update-ref", "refs/remotes/origin/main", "HEAD")
    return tmp_path


@pytest.mark.alone
@pytest.mark.parametrize("loops, code", [(1_000_001, 0), (3_000_000, 1)])
def test_the_gate(tree, rayrace, loops, code):
    """Three times the work fails it; another number of turns, which nothing can tell, does not."""
    (command,) = (block for block in blocks(PAGE) if block.startswith("rayrace ") and "--against" in block)
    write(tree, loops)
    done = rayrace(*command.split()[1:], *SMALL, cwd=tree, code=code)
    told = "slower by more than 5 %: mine, scene: slower: "
    assert (told in done.stderr) == (code == 1)
    assert (tree / "speed" / "report" / "report.html").is_file()


def test_every_service_runs_that_command():
    (command,) = (block.strip() for block in blocks(PAGE) if block.startswith("rayrace ") and "--against" in block)
    before, after = command.split(" origin/main ")
    lines = [line.strip() for block in blocks(PAGE, "yaml") for line in block.splitlines() if "rayrace run" in line]
    assert len(lines) == 2 and all(before in line and line.endswith(after) for line in lines)


def test_the_message_is_one_that_rayrace_prints():
    from harness.statistics.statistics import Estimate
    from reports.compare.versions import Held, failures

    (line,) = (block.strip() for block in blocks(PAGE) if block.startswith("slower "))
    held = Held("mine, scene", "mine@0f3c2a914", Estimate(1.213, 1.187, 1.24, 20), "slower", "", False)
    assert failures([held], 5) == [line]
