"""`rayrace run --against`: another version of a renderer, in a folder or at a commit, beside the one that is here."""

import json
import shutil
from pathlib import Path

import pytest
from repositories import git

ROOT = Path(__file__).parents[2]
SCENE = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\nBACKGROUND (0.2,0.5,0.7)\n"
PAINT = "self.background = read.vector"


@pytest.fixture
def tree(tmp_path):
    """A checkout with a renderer in Python, a package, whose variant is called mine."""
    tree = tmp_path / "tree"
    skip = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "renderers" / "python", tree / "renderers" / "python", ignore=skip)
    for name in ("__init__.py", "worker.py"):
        shutil.copy(ROOT / "renderers" / name, tree / "renderers")
    manifest = tree / "renderers" / "python" / "renderer.toml"
    first, *tables = manifest.read_text().split("\n[[variant]]")
    one = tables[0].replace('"python"', '"mine"', 1)
    manifest.write_text(first.replace('name        = "python"', 'name        = "mine"') + "\n[[variant]]" + one)
    return tree


def spoil(tree):
    """From now on its backgrounds are wrong."""
    file = tree / "renderers" / "python" / "scene.py"
    assert PAINT in file.read_text()
    file.write_text(file.read_text().replace(PAINT, "self.background = (0.5, 0.5, 0.5) or read.vector"))


def test_the_sources_of_a_commit_run_beside_those_of_today(tree, rayrace, experiment, rows, tmp_path):
    """What runs is each version's own code: the committed one paints a wrong background."""
    spoil(tree)
    git(tree, "init", "-q")
    git(tree, "add", ".")
    git(tree, "commit", "-qm", "wrong")
    commit = git(tree, "rev-parse", "HEAD").strip()
    shutil.copy(ROOT / "renderers" / "python" / "scene.py", tree / "renderers" / "python" / "scene.py")
    before = git(tree, "status", "--porcelain=v2", "-uno")
    file, other = experiment(["mine"], scene=SCENE, processes=2), f"mine@{commit[:9]}"
    words = "run", file, "--renderer", tree / "renderers" / "python", "--out", tmp_path / "run"
    done = rayrace(*words, "--against", "HEAD", "--report", code=1)
    found = rows(tmp_path / "run")
    assert {name: {row["status"] for row in mine} for name, mine in found.items()} == {
        "mine": {"ok"}, other: {"wrong picture"},
    }  # fmt: skip
    told = json.loads((tmp_path / "run" / "run.json").read_text())
    assert told["against"] == [{"variant": "mine", "other": other}]
    assert f"this version: mine, scene: not comparable: {other}: wrong picture" in done.stdout
    assert "## This version against another" in (tmp_path / "run" / "report" / "report.md").read_text()
    assert git(tree, "status", "--porcelain=v2", "-uno") == before
    again = rayrace("run", file, *words[2:4], "--against", "HEAD", "--resume", tmp_path / "run", code=1)
    assert f"this version: mine, scene: not comparable: {other}" in again.stdout
    assert len(rows(tmp_path / "run")[other]) == 2


@pytest.mark.parametrize("place", ["renderers/python", "renderers", "."])
def test_the_sources_of_a_folder(tree, rayrace, experiment, rows, tmp_path, place):
    old = shutil.copytree(tree, tmp_path / "before")
    spoil(tree)
    file = experiment(["mine"], scene=SCENE)
    words = "--renderer", tree / "renderers" / "python", "--against", old / place, "--out", tmp_path / "run"
    rayrace("run", file, *words, code=1)
    found = rows(tmp_path / "run")
    assert {name: mine[0]["status"] for name, mine in found.items()} == {"mine": "wrong picture", "mine@old": "ok"}


def test_the_same_sources_are_told(tree, rayrace, experiment, tmp_path):
    words = "--renderer", tree / "renderers" / "python", "--against", tree, "--dry-run"
    done = rayrace("run", experiment(["mine"], scene=SCENE), *words, code=0)
    assert "warning: mine has the same sources as mine@old\n" in done.stderr
    assert "mine@old" in done.stdout


@pytest.mark.parametrize(
    "words, message",
    [
        (("--against", "nowhere"), "--against nowhere: no such folder, and {tree}/renderers/python is in no git"),
        (("--against", "."), "--against .: no renderer in it has the variant mine"),
        (("--fail-slower", "5"), "--fail-slower: only with --against"),
        (("--against", "{tree}", "--executor", "slurm"), "--against: of a run here"),
    ],
)
def test_wrong_use(tree, rayrace, experiment, tmp_path, words, message):
    words = [word.format(tree=tree) for word in words]
    file = experiment(["mine"], scene=SCENE)
    renderer = tree / "renderers" / "python"
    cwd = tmp_path / "empty"
    cwd.mkdir()
    done = rayrace("run", file, "--renderer", renderer, *words, cwd=cwd, code=2)
    assert f"error: {message.format(tree=tree)}" in done.stderr


def test_a_commit_that_is_not_there(tree, rayrace, experiment):
    git(tree, "init", "-q")
    words = "--renderer", tree / "renderers" / "python", "--against"
    file = experiment(["mine"], scene=SCENE)
    done = rayrace("run", file, *words, "v9", code=2)
    assert f"error: --against v9: no such folder, and no commit of the repository in {tree}" in done.stderr
    (tree / "README").write_text("none yet")
    git(tree, "add", "README")
    git(tree, "commit", "-qm", "no renderer")
    done = rayrace("run", file, *words, "HEAD", code=2)
    assert "has no variant mine in" in done.stderr
