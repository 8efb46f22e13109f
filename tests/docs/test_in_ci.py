"""The recipe for CI, as its page has it, on a repository with a renderer of a few lines."""

import shlex

import pytest
from pages import blocks
from repositories import git

from harness.system import counters

PAGE = "in-ci.md"
SCENE = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\nBACKGROUND (0.2,0.5,0.7)\n"
WORK = "pixels = background * ((x1 - x0) * (y1 - y0))"  # of flat.py
# The page's experiment, but for its times: pictures of a few pixels.
SMALL = "--set", "image.width=12", "--set", "image.height=9", "--set", "frames=3"
FEW = *SMALL, "--set", "processes=8"


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


def commands(word):
    """The commands of the page in the block that has a word."""
    (block,) = (block for block in blocks(PAGE) if block.startswith("rayrace run") and word in block)
    return block.splitlines()


@pytest.mark.alone
@pytest.mark.parametrize("loops, codes", [(1_000_001, (0, 2)), (3_000_000, (1,))])
def test_the_gate(tree, rayrace, loops, codes):
    """Three times the work fails it; another number of turns passes, or is not seen on a busy machine."""
    (command,) = commands("--against")
    write(tree, loops)
    done = rayrace(*command.split()[1:], *FEW, cwd=tree)
    assert done.returncode in codes, done.stdout + done.stderr
    line = done.stdout.splitlines()[-1]
    assert line.startswith({0: "gate: pass: ", 1: "gate: fail: ", 2: "gate: cannot tell: "}[done.returncode])
    assert ("slower by more than 5 %: mine, scene: slower: " in done.stderr) == (done.returncode == 1)
    text = (tree / "speed" / "report" / "report.md").read_text("utf-8").replace("\\", "")
    assert text.index("G" + line[1:]) < text.index("## This version against another")


@pytest.mark.slow
def test_the_budget(tree, rayrace):
    """What is counted twice is within its budget; twice the work is not."""
    if isinstance(why := counters.find(), str):
        pytest.skip(why)
    (count, export), (hold,) = commands("--out counted"), commands("--budget")
    write(tree, 100_000)
    rayrace(*shlex.split(count)[1:], *SMALL, cwd=tree, code=0)
    rayrace(*shlex.split(export)[1:], cwd=tree, code=0)
    for number, (loops, code) in enumerate(((100_001, 0), (200_000, 1))):
        write(tree, loops)
        words = hold.replace("--out instructions", f"--out {number}")
        done = rayrace(*shlex.split(words)[1:], *SMALL, cwd=tree, code=code)
        assert done.stdout.splitlines()[-1].startswith("gate: pass: " if code == 0 else "gate: fail: over the budget")


def test_every_service_installs_what_it_needs_and_runs_these_commands():
    (times,), (counts,) = commands("--against"), commands("--budget")
    before, after = times.split(" origin/main ")
    for block in blocks(PAGE, "yaml"):
        lines = [line.strip() for line in block.splitlines()]
        assert any("apt-get install -y valgrind" in line for line in lines)
        assert any(line.endswith('pip install "$RAYRACE"') for line in lines) and "RAYRACE: git+https://" in block
        budget, against = (line for line in lines if "rayrace run" in line)
        assert budget.endswith(counts) and before in against and against.endswith(after)


def test_the_message_is_one_that_rayrace_prints():
    from harness.statistics.statistics import Estimate
    from reports.compare import gate
    from reports.compare.versions import Held
    from reports.compare.witness import Witness

    (line,) = (block.strip() for block in blocks(PAGE) if block.startswith("gate: "))
    ratio = Estimate(1.06, 0.97, 1.178, 20)
    held = Held("mine, scene", "mine@0f3c2a914", ratio, "not resolved", "", False, witness=Witness("steady_s"))
    assert gate.line([gate.of_versions([held], 5)]) == line
