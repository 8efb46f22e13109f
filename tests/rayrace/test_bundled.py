"""Bundled experiments and scenes are found by name, and copied whole to be edited."""

import json
import os
import random
from pathlib import Path

import pytest

from harness.errors import UserError
from harness.experiment import experiment
from harness.plan import plan
from rayrace import bundled


@pytest.mark.parametrize("name", bundled.names())
def test_a_copy_is_complete(name, known, tmp_path, monkeypatch):
    """Planned from another folder, the copy gives the cells of the original."""
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(tmp_path / "empty")
    bundled.copy(name, tmp_path / "mine")
    files = [tmp_path / "mine" / f"{name}.toml", bundled.experiment(Path(name))]
    mine, theirs = (plan.make(experiment.load(file), file, known).cells for file in files)
    assert mine and [cell.key for cell in mine] == [cell.key for cell in theirs]


def test_a_copy_by_the_command_line(rayrace, tmp_path):
    name = random.choice(list(bundled.names()))
    print(name)
    rayrace("experiments", name, "-o", tmp_path / "mine", code=0)
    (tmp_path / "empty").mkdir()
    words = ("--dry-run", "--json")
    mine = rayrace("run", tmp_path / "mine" / f"{name}.toml", *words, cwd=tmp_path / "empty", code=0).stdout
    theirs = rayrace("run", name, *words, cwd=tmp_path / "empty", code=0).stdout
    mine = mine.replace(str(tmp_path / "mine"), str(bundled.experiment(Path(name)).parent))  # warnings name files
    assert json.loads(mine)["cells"] and json.loads(mine) == json.loads(theirs)


def test_a_copy_overwrites_nothing(rayrace, tmp_path):
    rayrace("experiments", "smoke", cwd=tmp_path, code=0)
    rayrace("experiments", "smoke", cwd=tmp_path, code=0)  # the same content
    scene = tmp_path / "scenes" / "local.txt"
    scene.write_text(scene.read_text() + "# mine\n")
    (tmp_path / "smoke.toml").unlink()
    done = rayrace("experiments", "smoke", cwd=tmp_path, code=2)
    assert "scenes/local.txt: exists already, with other content" in done.stderr
    assert scene.read_text().endswith("# mine\n") and not (tmp_path / "smoke.toml").exists()


def test_a_bundled_experiment_runs_by_name(rayrace, tmp_path):
    """Into results/ of the current folder."""
    one = ("--set", "processes=1", "--set", 'renderers=["python"]', "--set", "image.width=8", "--set", "image.height=8")
    done = rayrace("run", "smoke", *one, cwd=tmp_path, code=0)
    (folder,) = (tmp_path / "results").iterdir()
    assert folder.name.endswith("-smoke") and str(folder.relative_to(tmp_path)) in done.stdout
    rayrace("render", "local", "-r", "python", "--width", 4, "--height", 4, "-o", "a.png", cwd=tmp_path, code=0)
    assert (tmp_path / "a.png").stat().st_size > 50


def test_a_file_comes_before_a_bundled_name(rayrace, tmp_path):
    (tmp_path / "smoke.toml").write_text('title = "mine"\nscenes = ["a.txt"]\nrenderers = ["python"]\n')
    (tmp_path / "a.txt").write_text("CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\n")
    told = json.loads(rayrace("run", "smoke.toml", "--dry-run", "--json", cwd=tmp_path, code=0).stdout)
    assert len(told["cells"]) == 1


@pytest.mark.parametrize("command", [("run",), ("render",), ("trace",), ("experiments",)])
def test_an_unknown_name_is_told_the_nearest(command, rayrace, tmp_path):
    seed = int.from_bytes(os.urandom(4))
    print(f"seed {seed}")
    draw = random.Random(seed)
    known = list(bundled.names()) if command[0] in ("run", "experiments") else ["comparison", "soft-and-glossy"]
    name = draw.choice([name for name in known if len(name) > 5])
    place = draw.randrange(1, len(name) - 1)
    wrong = name[:place] + name[place + 1 :]
    (tmp_path / "rays.csv").write_text("ox,oy,oz,dx,dy,dz\n")
    more = ("rays.csv",) if command[0] == "trace" else ()
    done = rayrace(*command, wrong, *more, cwd=tmp_path, code=2)
    assert f"{wrong}: no such file, and no bundled" in done.stderr
    assert "did you mean" in done.stderr or "bundled: " in done.stderr


def test_the_list_names_all(rayrace):
    told = json.loads(rayrace("experiments", "--json", code=0).stdout)
    assert told == bundled.names() and told["comparison"] == "The study's comparison"
    text = rayrace("experiments", code=0).stdout
    assert all(name in text for name in told)


def test_a_name_of_two_scenes_is_refused():
    with pytest.raises(UserError, match=r"glossy: several bundled scenes .* give gallery/glossy or sampling/glossy$"):
        bundled.scene(Path("glossy"))
    for name in ("gallery/glossy", "gallery/glossy.txt", "scenes/gallery/glossy.txt"):
        assert bundled.scene(Path(name)) == bundled.folder() / "scenes" / "gallery" / "glossy.txt"
    assert bundled.scene(Path("comparison")) == bundled.scene(Path("comparison.txt"))
    with pytest.raises(UserError, match="no bundled scene of that name; did you mean glossy"):
        bundled.scene(Path("elsewhere/glosy"))
