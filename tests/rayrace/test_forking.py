"""The commands of tests (tests/support/forking.py) do what `rayrace` does that is started."""

import re
import subprocess

import pytest
from forking import PROGRAM, Commands

SCENE = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\nBACKGROUND (0.2,0.5,0.7)\n"


@pytest.fixture
def commands(environment):
    made = Commands(environment)
    yield made
    made.close()


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (["--version"], 0),
        (["list", "--json"], 0),
        (["render", "scene.txt", "-r", "python", "--width", "3", "--height", "2", "-o", "a.npy"], 0),
        (["run", "nothing.toml"], 2),
        (["run", "--no-such-option"], 2),
    ],
    ids=lambda value: value[0] if isinstance(value, list) else None,
)
def test_as_a_start(commands, environment, tmp_path, words, code):
    """The same output but for times, the same exit status and files."""
    ways = {
        "forked": lambda place: commands.run(words, place),
        "started": lambda place: subprocess.run(
            [PROGRAM, *words], cwd=place, env=environment, capture_output=True, text=True
        ),
    }
    outcomes = []
    for name, run in ways.items():
        place = tmp_path / name
        place.mkdir()
        (place / "scene.txt").write_text(SCENE)
        done = run(place)
        assert done.returncode == code, done.stderr
        files = {path.name: path.read_bytes() for path in place.iterdir()}
        outcomes.append((re.sub(r"[\d.e-]+ s\b", "", done.stdout), done.stderr, files))
    assert commands.process and outcomes[0] == outcomes[1]


def test_other_variables_need_a_start(commands, environment, tmp_path):
    assert commands.run(["--version"], tmp_path, {**environment, "LANG": "C"}).returncode == 0
    assert commands.process is None
    path = str(tmp_path / "nowhere")
    done = commands.run(["list"], tmp_path, {**environment, "RAYRACE_RENDERERS": path})
    assert commands.process is not None and done.returncode == 2 and path in done.stderr


def test_a_command_that_takes_too_long(commands, tmp_path):
    """It is ended, and the next one runs."""
    with pytest.raises(subprocess.TimeoutExpired):
        commands.run(["run", "smoke", "--out", tmp_path / "run"], tmp_path, timeout=0.5)
    assert commands.run(["--version"], tmp_path).stdout.startswith("rayrace ")
