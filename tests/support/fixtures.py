"""Fixtures that run the real command line, and experiments for it. No run of a test waits for another that measures."""

import os
import re
import secrets
import shutil
from pathlib import Path

import pytest
from forking import Commands

from harness.experiment import experiment as experiments
from harness.plan import plan
from harness.renderer import manifest, registry
from harness.renderer.registry import Entry, Renderer
from harness.store import store
from harness.system import cuda

BAD = Path(__file__).parents[1] / "harness" / "bad_renderers"

# Nothing to hit: every pixel is the background, so a renderer of a few lines can be right, or wrong by exactly so much.
EMPTY_SCENE = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\nBACKGROUND (0.2,0.5,0.7)\n"
SPHERE_SCENE = EMPTY_SCENE + "LIGHT (4,5,6) (1,1,1) 0\nSPHERE (0,0,-1) 0.8 (0.7,0.5,0.3) 0.4 20 (0,0,0) 1e6 1\n"


def a_copy(known, name, folder, file, old, new):
    """The variant `name` of a renderer in a folder of its own, with other text in a file."""
    renderer = known[name].renderer
    shutil.copytree(renderer.folder, folder, ignore=shutil.ignore_patterns("__pycache__"))
    told = (folder / file).read_text()
    assert told.count(old) == 1
    (folder / file).write_text(told.replace(old, new))
    made = manifest.load(folder)
    return Entry(Renderer(folder, made), next(one for one in made.variant if one.name == name))


@pytest.fixture(scope="session")
def environment(tmp_path_factory):
    """Of a rayrace of its own, which waits for no other to end measuring, and whose output Python buffers as usual."""
    ours = registry.SEARCH_PATH, cuda.SIMULATOR, "PYTHONUNBUFFERED"
    kept = {name: value for name, value in os.environ.items() if name not in ours}
    return {**kept, "TMPDIR": str(tmp_path_factory.mktemp("tmp")), "RAYRACE_LOCK": f"-{secrets.token_hex(8)}"}


@pytest.fixture(scope="session")
def rayrace(environment):
    """Run the real command line: rayrace("list", cwd=.., env={..}) is a CompletedProcess. It may show no traceback."""
    commands = Commands(environment)

    def run(*words, cwd=None, env=None, timeout=300, code=None):
        done = commands.run(words, cwd, {**environment, **(env or {})}, timeout)
        assert "Traceback" not in done.stdout + done.stderr, done.stderr
        if code is not None:
            assert done.returncode == code, done.stdout + done.stderr
        return done

    return run


@pytest.fixture
def write(tmp_path):
    """Write a text file in the test's folder: write("a.toml", "..") is its path."""

    def write(name, text):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        return path

    return write


@pytest.fixture
def experiment(write):
    """An experiment file with a scene beside it: experiment(renderers, 'timeout = "5 s"', scene=..) is its path."""

    def make(renderers, more="", scene=EMPTY_SCENE, processes=1, frames=1, size=8):
        write("scene.txt", scene)
        names = ", ".join(f'"{name}"' for name in renderers)
        head = f'title = "a test"\nscenes = ["scene.txt"]\nrenderers = [{names}]\n'
        head += f"processes = {processes}\nframes = {frames}\n"
        tail = f"\n[image]\nwidth = {size}\nheight = {size - 1}\ndepth = 1\n"
        before, _, tables = more.partition("[")
        return write("experiment.toml", head + before + tail + (f"[{tables}" if tables else ""))

    return make


@pytest.fixture(scope="session")
def bad_folder(tmp_path_factory):
    """A folder with some variants of bad_renderers; `head` is added to the manifest before them."""

    def make(*variants, name="bad", head=""):
        folder = tmp_path_factory.mktemp(name)
        shutil.copy(BAD / "main.py", folder)
        first, *tables = (BAD / "renderer.toml").read_text().split("\n[[variant]]")
        kept = [table for table in tables if re.search(r'name\s*= "([^"]*)"', table)[1] in variants]
        assert len(kept) == len(variants)
        first = first.replace('"bad"', f'"{name}"')
        (folder / "renderer.toml").write_text("\n[[variant]]".join([first + head, *kept]))
        return folder

    return make


@pytest.fixture(scope="session")
def rows():
    """The rows of a run by variant: rows(folder)["numpy"] is a list."""

    def read(folder):
        found = {}
        for record in store.read(folder)[1]:
            found.setdefault(record["variant"], []).append(record)
        return found

    return read


@pytest.fixture
def generate(write, known):
    def make(more, renderers='["numpy"]'):
        file = write("experiment.toml", f'title = "t"\nrenderers = {renderers}\n{more}')
        return plan.make(experiments.load(file), file, known)

    return make
