"""[[stress]]: rows of the catalogue as cells, judged by their own truth."""

import json

import numpy as np
import pytest

from harness import stress
from harness.errors import UserError
from harness.experiment import experiment as experiments
from harness.plan import plan
from harness.renderer.parameters import Parameters
from harness.stress.job import Stressed
from harness.stress.row import Finding, Row

BASE = 'title = "t"\nrenderers = ["python", "cpp"]\nprocesses = 1\nframes = 1\nseed = 5\n'
FAR = '[[stress]]\nrow = "far-picture"\nlevels = [10, 1e4]\n[stress.sweep]\nsphere = ["textbook", "robust"]\n'


@pytest.fixture
def make(write, known):
    def make(more):
        file = write("experiment.toml", BASE + more)
        return plan.make(experiments.load(file), file, known)

    return make


def test_every_level_with_every_method(make):
    made = make(FAR)
    points = {tuple(cell.point.items()) for cell in made.cells}
    assert points == {
        (("stress", "far-picture"), ("level", level), ("sphere", sphere))
        for level in (10.0, 1e4)
        for sphere in ("textbook", "robust")
    }
    assert len(made.cells) == 8 and len({cell.key for cell in made.cells}) == 8
    assert all(cell.parameters.width == cell.stressed.trial.parameters["width"] for cell in made.cells)


def test_a_level_has_the_same_numbers_in_any_list_and_for_any_renderer(make):
    both, one = make(FAR), make(FAR.replace("[10, 1e4]", "[1e4]"))
    versions = {cell.scene_version for cell in both.cells if cell.point["level"] == 1e4}
    assert versions == {cell.scene_version for cell in one.cells} and len(versions) == 1


def test_the_seed_makes_other_numbers():
    row = stress.rows()["far-picture"]
    versions = {Stressed(row, 100.0, "float64", seed).flat("linear")[0] for seed in (5, 5, 6)}
    assert len(versions) == 2


def test_where_knows_row_and_level(make):
    made = make("where = [\"stress != 'far-picture' or level < 100\"]\n" + FAR)
    assert {cell.point["level"] for cell in made.cells} == {10.0}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[[stress]]\nrow = "no-such"\n', 'no row "no-such"'),
        ('[[stress]]\nrow = "far-picture"\n[stress.sweep]\nsphere = ["square"]\n', "Input should be 'robust'"),
        ('[[stress]]\nrow = "far-picture"\n[stress.sweep]\nspheres = ["robust"]\n', "no such parameter"),
        ('[[stress]]\nrow = "far-picture"\nlevels = []\n', "levels"),
        ('scenes = ["a.txt"]\n[[stress]]\nrow = "far-picture"\n', "expected one of the three"),
    ],
)
def test_faults(make, text, message):
    with pytest.raises(UserError, match=r"experiment\.toml") as fault:
        make(text)
    assert message in str(fault.value)


def test_a_run_stores_what_each_answer_is_worth(rayrace, write, tmp_path, known):
    """Through the command line: the textbook's picture of a far sphere is wrong, the robust one right."""
    name = next(name for name in ("cpp", "python") if not known[name].unavailable)
    precision = "float32" if name == "cpp" else "float64"
    file = write("experiment.toml", BASE.replace('["python", "cpp"]', f'["{name}"]') + FAR)
    rayrace("run", file, "--set", f"image.precision={precision}", "--out", tmp_path / "run")
    facts = json.loads((tmp_path / "run" / "run.json").read_text())
    assert facts["stability"]["far-picture"]["code"] == "S1"
    rows = [json.loads(line) for line in (tmp_path / "run" / "repetitions.jsonl").read_text().splitlines()]
    assert len(rows) == 4 and all(row["status"] == "ok" for row in rows)
    assert all(row["unranked"].startswith("exhibit: put under stress") and row["agreement"] is None for row in rows)
    points = {cell["cell"]: cell["point"] for cell in facts["cells"]}
    failures = {
        (points[row["cell"]]["sphere"], points[row["cell"]]["level"]): row["stability"]["failures"] for row in rows
    }
    assert failures["robust", 10.0] == failures["robust", 1e4] == failures["textbook", 10.0] == 0
    assert name == "python" or failures["textbook", 1e4] > 1000


def test_a_finding_without_errors_has_none():
    assert Finding(10, 3).record() == {
        "count": 10, "failures": 3, "error_median": None, "error_p99": None, "error_max": None,
    }  # fmt: skip
    told = Finding(3, 0, np.array([3.0, 1.0, 2.0])).record()
    assert (told["error_median"], told["error_max"]) == (2.0, 3.0)


@pytest.mark.parametrize("row", stress.rows().values(), ids=lambda row: row.name)
@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_every_row_is_whole(row: Row, precision):
    """Its numbers are of the precision, it tells what it is, and theory answers for each level."""
    assert row.code[0] == "S" and row.title and row.stress and row.failure and row.levels
    assert row.aligned == "" or row.aligned in stress.rows()
    assert row.method == "" or hasattr(Parameters, row.method)
    for level in (row.levels[0], row.levels[-1]):
        made = Stressed(row, level, precision, 11)
        _, arrays = made.flat("linear")
        for name in ("camera", "spheres", "boxes", "polygon_vertices", "ellipsoids", "mesh_vertices", "rays"):
            array = arrays.get(name, np.zeros(0))
            assert np.isfinite(array).all()
            if precision == "float32":
                assert np.array_equal(array, array.astype(np.float32)), f"{row.name}: {name} is rounded once more"
        told = Parameters(precision=precision).values()
        for value in (row.expected(level, 2.0**-24, told), row.limit(2.0**-24, told)):
            assert value is None or value >= 0
