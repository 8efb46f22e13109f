"""The commands of a cell: they make its picture again to the byte, and plan that cell alone."""

import hashlib
import json
import shlex

import numpy as np
import pytest

from harness.experiment import experiment
from harness.plan import plan
from harness.process import repetition
from harness.renderer import registry
from rayrace import main
from reports.run import command, results
from reports.run.cell import Missing

CAMERA = "CAMERA (0,0.1,0) (1.1,0,0) (0,0.9,0) (0.1,0.2,3)\nAMBIENT (0.1,0.1,0.1)\nBACKGROUND (0.1,0.2,0.3)\n"
MIRRORS = CAMERA + "LIGHT (2,3,4) (0.9,0.8,0.7) 0\nSPHERE (-0.3,0,-1) 0.6 (0.6,0.2,0.1) 0.6 20 (0,0,0) 9 1\n"
SOFT = MIRRORS.replace("0.7) 0\n", "0.7) 0.5\n") + "BOX (0.2,-0.5,-1) (0.5,0,0) (0,0.5,0) (0,0,0.5)\n"
SCENES = {"mirrors": MIRRORS, "soft": SOFT + "(0.2,0.6,0.3) 0.3 10 (0.9,1,0.9) 2 1\n"}
HEAD = 'title = "t"\nprocesses = 1\nframes = 0\n'
ONE, TWO = 'renderers = ["numpy"]\n', 'renderers = ["numpy", "python"]\n'
IMAGE = "[image]\nwidth = 9\nheight = 7\ndepth = 3\n"
EXPERIMENTS = {
    "scenes": ONE + 'scenes = ["scenes/mirrors.txt", "scenes/soft.txt"]\n' + IMAGE + """shadows = true
[[points]]
sampler = ["one", "jittered", "adaptive"]
samples = 2
seed = 7
[[points]]
region = [[2, 1, 6, 4]]
sphere = "textbook"
[[points]]
lens_radius = 0.1
focal_distance = 3.5
feelers = 3
glossy_rays = 2
glossy_weight = "study"
sampler = "jittered"
[[points]]
cutoff = ["2^-4", 0.013]
sample_x = 0.25
[[points]]
arithmetic = "srgb"
accel = "none"
depth = 10
""",
    "cases": ONE + IMAGE + """[[case]]
name = "it's a lens, \\"wide\\""
scene = "scenes/soft.txt"
lens_radius = 0.2
focal_distance = 3
threads = 1
[[case]]
name = "local"
scene = "scenes/mirrors.txt"
depth = 0
[sweep]
samples = [1, 2]
region = ["one pixel", "all", [0, 0, 4, 4]]
""",
    "comparison": TWO + '[generate]\nscene = "comparison"\nlights = 2\n' + IMAGE
    + "[sweep]\nobjects = [3, 5]\nside = [6, 8]\n",
    "several": ONE + '[[generate]]\nscene = "comparison"\nlights = 1\n[[generate]]\nscene = "balls"\n' + IMAGE
    + "[[points]]\nobjects = [2]\n[[points]]\nsize = [0, 1]\n",
    "balls": TWO + '[generate]\nscene = "balls"\nsize = 1\n' + IMAGE,
}  # fmt: skip


@pytest.fixture
def made(tmp_path, monkeypatch, make_run, record):
    """A function that renders every cell of an experiment: (the run, its cells with the keys of their plan)."""
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "experiments"
    (folder / "scenes").mkdir(parents=True)
    for name, text in SCENES.items():
        (folder / "scenes" / f"{name}.txt").write_text(text)

    def make(name):
        file = folder / f"{name}.toml"
        file.write_text(HEAD + EXPERIMENTS[name])
        asked = experiment.load(file)
        planned = plan.make(asked, file, registry.entries())
        told = []
        for cell in planned.cells:
            facts = cell.facts()
            arrays = planned.arrays[cell.scene_version]
            result = repetition.run(cell.entry, arrays, cell.parameters, cell.needs)
            if result.status == "unsupported":
                continue
            assert result.status == "ok", f"{cell.label}: {result.reason}\n{result.stderr}"
            digest = hashlib.sha256(np.ascontiguousarray(result.array).tobytes()).hexdigest()
            picture = {"file": f"pictures/{cell.key}.npy", "sha256": digest}
            told.append({**record(cell.entry.name), **facts, "picture": picture, "series": None})
        words = ["rayrace", "run", f"experiments/{name}.toml", "--set", "processes=2"]
        described = json.loads(json.dumps(asked.model_dump()))
        return results.load(make_run(told, name=f"run-{name}", experiment=described, command=words))

    return make


def typed(line):
    """Type a line into a shell, one command after the other."""
    for part in line.split(" && "):
        name, *words = shlex.split(part)
        assert name == "rayrace"
        main.app(words, standalone_mode=False)


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_a_cell_is_made_and_measured_again(name, made, tmp_path, capsys):
    run = made(name)
    assert len(run.cells) >= 2
    _makes_the_same_picture(run, tmp_path)
    _measures_the_cell_alone(run, capsys)


def _makes_the_same_picture(run, tmp_path):
    for cell in run.cells:
        line = command.of(run, cell)
        assert not isinstance(line, Missing), line
        (tmp_path / "picture.npy").unlink(missing_ok=True)
        typed(line)
        picture = np.load(tmp_path / "picture.npy")
        digest = hashlib.sha256(np.ascontiguousarray(picture).tobytes()).hexdigest()
        assert digest == run.record(cell)["picture"]["sha256"], line


def _measures_the_cell_alone(run, capsys):
    for cell in run.cells:
        capsys.readouterr()
        typed(command.again(run, cell) + " --dry-run --json")
        planned = json.loads(capsys.readouterr().out)
        assert [one["cell"] for one in planned["cells"]] == [run.record(cell)["cell"]]
        assert planned["repetitions"] == 2  # of --set processes=2


def test_nothing_is_named_that_is_as_by_default(load, record):
    parameters = record("")["parameters"] | {"width": 512, "height": 512, "region": "0,0,512,512", "depth": 10}
    told = record("cpp", parameters=parameters | {"shadows": 1, "cutoff": 0.0, "focal_distance": 1.0, "samples": 1})
    run = load([told], command=["rayrace", "run", "experiments/a.toml"])
    assert command.of(run, run.cells[0]) == "rayrace render experiments/scenes/comparison.txt -r cpp -o picture.npy"
    assert command.again(run, run.cells[0]) == "rayrace run experiments/a.toml --only cpp"


def test_what_cannot_be_said_has_a_reason(load, record):
    run = load([record("cpp", parameters=record("")["parameters"] | {"wobble": 3})], command=["pytest"])
    assert "no option for wobble = 3" in str(command.of(run, run.cells[0]))
    assert "`rayrace run`" in str(command.again(run, run.cells[0]))


def test_folders_of_renderers_and_odd_names_are_kept(load, record):
    words = ["rayrace", "run", "a b.toml", "--renderer", "my folder", "--only", "x", "--set", "image.depth=3"]
    run = load([record("it's", scene="a; rm.txt")], command=words)
    (cell,) = run.cells
    told = shlex.split(command.of(run, cell))
    assert told[:7] == ["rayrace", "render", "a; rm.txt", "--renderer", "my folder", "-r", "it's"]
    told = shlex.split(command.again(run, cell))
    assert told == ["rayrace", "run", "a b.toml", "--renderer", "my folder", "--only", "it's", "--set", "image.depth=3"]


def test_a_mesh_that_is_made_in_memory_has_no_scene_file(load, record):
    tables = [{"scene": name, "objects": None, "lights": None, "size": None} for name in ("balls", "icosphere")]
    asked = {"processes": 1, "frames": 2, "image": {}, "generate": tables}
    point = {"size": 1}
    told = [record("cpp", scene=f"generated/{name}.txt", point=point, series=None) for name in ("balls", "icosphere")]
    loaded = load(told, experiment=asked)
    balls, icosphere = (command.of(loaded, cell) for cell in loaded.cells)
    assert "rayrace generate balls --size 1 -o balls-size-1.nff && rayrace render balls-size-1.nff " in balls
    assert isinstance(icosphere, Missing) and "icosphere is made in memory" in str(icosphere)
