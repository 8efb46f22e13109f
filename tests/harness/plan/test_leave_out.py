"""[leave_out] of an experiment: which cells there are, what they are judged by, and that they run like any other."""

import contextlib
import sys

import numpy as np
import pytest

from harness.cluster import batch
from harness.errors import UserError
from harness.experiment import experiment as experiments
from harness.judge import judge
from harness.plan import plan, resume
from harness.plan.predict import Predictor
from harness.race import race
from harness.race.host import ThisHost
from harness.reduction.leave_out import KINDS, leave_outs
from harness.renderer.parameters import Parameters
from harness.scene.text import read
from harness.store import store

# The second light is black.
SCENE = """CAMERA (0,0,0) (1,0,0) (0,0.75,0) 4
AMBIENT (0.2,0.2,0.2)
LIGHT (3.1,4.2,6.3) (0.8,0.7,0.9) 0
LIGHT (2,3,5) (0,0,0) 0
POLYGON 4 (-9,-9,-3) (9,-9,-3.1) (9,9,-3.2) (-9,9,-3.1) (0.5,0.6,0.4) 0 10 (0,0,0) 1e6 1
SPHERE (-0.4,0.1,-1) 0.5 (0.2,0.2,0.2) 0.7 20 (0,0,0) 1e6 1
"""
SOME = '[leave_out]\nwhat = ["lights", "objects", "depth"]\n'
NAMES = ["nothing", "depth 1 to 0", "light 1", "light 2", "the polygon of line 5", "the sphere of line 6"]


@pytest.fixture
def make(write, known):
    """A function that plans an experiment on SCENE: the experiment and the plan."""

    def make(more=SOME, renderers=("python", "numpy"), scene=SCENE, first=""):
        write("scene.txt", scene)
        head = f'title = "t"\nscenes = ["scene.txt"]\nrenderers = {list(renderers)}\nprocesses = 1\nframes = 1\n{first}'
        file = write("experiment.toml", f"{head}[image]\nwidth = 14\nheight = 13\ndepth = 1\n{more}")
        asked = experiments.load(file)
        return asked, plan.make(asked, file, known)

    return make


def test_every_thing_of_the_kinds_is_left_out_in_turn(make):
    _, made = make()
    assert [cell.point["without"] for cell in made.cells] == [name for name in NAMES for _ in range(2)]
    assert len({cell.key for cell in made.cells}) == len(made.cells)
    proofs = {cell.point["without"]: cell.facts()["without"]["proof"] for cell in made.cells if cell.without}
    assert [name for name, proof in proofs.items() if proof] == ["light 2"]
    assert "without" not in made.cells[0].facts()


def test_where_can_choose_single_things(make):
    _, made = make(first="where = [\"without in ('nothing', 'light 2')\"]\n")
    assert {cell.point["without"] for cell in made.cells} == {"nothing", "light 2"}


def test_all_share_the_truth_of_the_whole_scene_and_one_job_of_a_cluster(make):
    _, made = make("[sweep]\ndepth = [0, 1]\n" + SOME)
    assert len(made.truths_of(made.cells)) == 1
    batches = batch.make(made, "auto", 1, 60.0, Predictor())
    assert [{cell.point["depth"] for cell in one.cells} for one in batches] == [{0}, {1}]
    for one in batches:
        again = batch.restored(one.record(), made)
        whole = again.cells[0]
        alone = batch.Batch((again.cells[-1],), None, "").of(made)
        assert whole.scene_version in alone.arrays


def test_a_point_that_is_the_same_job_as_a_leave_out_is_a_cell_of_its_own(make):
    _, made = make("[sweep]\ndepth = [0, 1]\n" + SOME, ("numpy",))
    same = [cell for cell in made.cells if cell.parameters.depth == 0 and len(cell.facts()["needs"]) > 3]
    whole = [cell for cell in same if cell.point["without"] == "nothing"]
    shallow = [cell for cell in same if cell.point["without"] == "depth 1 to 0"]
    assert whole[0].parameters == shallow[0].parameters and whole[0].key != shallow[0].key


@pytest.mark.parametrize(
    ("more", "line", "why"),
    [
        ('[leave_out]\nwhat = ["light"]\n', 11, 'nothing|no kind of thing is called "light"; did you mean "lights"?'),
        ("[leave_out]\nwhat = []\n", 11, "List should have at least 1 item"),
        ('[[points]]\nrays = 5\n[leave_out]\nwhat = "all"\n', 12, "not with rays, whose first hits are no picture"),
    ],
)
def test_a_wrong_table_is_told_with_its_line(make, more, line, why):
    with pytest.raises(UserError) as told:
        make(more)
    assert f"experiment.toml:{line}: leave_out" in str(told.value) and why.split("|")[-1] in str(told.value)


def test_not_under_stress(write):
    head = 'title = "t"\nrenderers = ["numpy"]\n[leave_out]\nwhat = "all"\n'
    with pytest.raises(UserError, match=r"e\.toml:3: leave_out: not with \[\[stress\]\]"):
        experiments.load(write("e.toml", head + '[[stress]]\nrow = "acne"\n'))


@pytest.fixture
def quick(known):
    """Renderers that compile nothing: one judges the other."""
    return {name: known[name] for name in ("numpy", "python")}


class Here(ThisHost):
    """Keeps references in a folder of the test, and waits for no other run: no time is asserted."""

    references = None

    def __init__(self, folder):
        self.references = folder

    def exclusive(self):
        return contextlib.nullcontext()


def test_a_run_judges_smaller_models_by_twins_and_by_the_truth_of_the_whole(make, quick, tmp_path):
    asked, made = make("[reference]\nspots = 0\n" + SOME, ("numpy",))
    folder, host = tmp_path / "run", Here(tmp_path / "kept")
    race.run(asked, made, quick, folder, host=host)
    _, rows = store.read(folder)
    rows = {row["point"]["without"]: row for row in rows}
    assert set(rows) == set(NAMES) and {row["status"] for row in rows.values()} == {"ok"}
    assert not any(row["agreement"]["wrong"] for row in rows.values())
    assert len({row["error"]["truth_file"] for row in rows.values()}) == 1
    assert len({row["agreement"]["reference_file"] for row in rows.values()}) == 5  # a black light changes nothing
    assert rows["light 1"]["without"] == {"kind": "lights", "proof": ""}
    assert rows["light 2"]["without"]["proof"] == "its colour is black" and rows["nothing"].get("without") is None
    whole = rows["nothing"]["error"]
    truth, noise = (np.load(folder / whole[name]) for name in ("truth_file", "standard_error_file"))
    for row in rows.values():
        error = judge.errors(np.load(folder / row["picture"]["file"]), truth, noise, None)
        assert row["error"]["rmse"] == error["rmse"]
    assert rows["light 2"]["error"]["rmse"] == whole["rmse"] < rows["the sphere of line 6"]["error"]["rmse"]
    # Resumed, nothing is left to do.
    resume.check(folder, made)
    assert len(race.run(asked, made, quick, folder, host=host, resumed=True)) == len(NAMES)


def test_what_cannot_be_made_here_is_a_row_with_the_reason(make, quick, tmp_path, monkeypatch, write):
    monkeypatch.setitem(sys.modules, "fast_simplification", None)
    write("cube.obj", "".join(f"v {x} {y} {z}\n" for x in (0, 1) for y in (0, 1) for z in (0, 1)) + FACES)
    mesh = 'CAMERA (0,0,3) (1,0,0) (0,1,0) (0,0,3)\nMESH "cube.obj" (0,0,0) (0,0,0) 1\n(0.5,0.5,0.5) 0 1 (0,0,0) 1 1\n'
    asked, made = make('[leave_out]\nwhat = ["triangles"]\n', ("numpy",), mesh)
    assert len(made.cells) == 2 and made.cells[1].refused.startswith("unsupported: no fast-simplification here")
    records = race.run(asked, made, quick, tmp_path / "run", host=Here(tmp_path / "kept"))
    (row,) = [row for row in records if row["point"]["without"] != "nothing"]
    assert (row["status"], row["picture"]) == ("unsupported", None) and "pip install" in row["reason"]


FACES = "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n"


def test_every_kind_is_made_of_some_scene():
    """No kind that a user may write is one that nothing has."""
    solid = """CAMERA (0,0,0) (1,0,0) (0,1,0) 4
AIR 1.1 1 (0.9,0.8,0.9)
AMBIENT (0.1,0.1,0.1)
LIGHT (1,2,3) (1,1,1) 0.3
LIGHT (2,2,3) (1,1,1) 0
OR
  SPHERE (0,0,0) 1
  ELLIPSOID (1,2,3) (1,0,0) (0,2,0) (0,0,3)
END
(0.1,0.2,0.3) 0.5 20 (0.9,0.8,0.7) 2 1 0.2
"""
    rich = {"feelers": 2, "glossy_rays": 2, "shadows": True, "lens_radius": 0.1, "sampler": "jittered", "samples": 4}
    found = {one.kind for one in leave_outs(read(solid), Parameters(**rich))}
    assert found == set(KINDS) - {"triangles"}
    assert {one.kind for one in leave_outs(read(solid), Parameters(**rich), ["lens", "parts"])} == {"lens", "parts"}
