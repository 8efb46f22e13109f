"""Plans of generated scenes: which counts they have, and what a scene cannot have."""

from pathlib import Path

import pytest

from harness.errors import UserError
from harness.experiment import experiment as experiments
from harness.plan import plan
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.generate.comparison import comparison


def test_generated_scenes(generate):
    made = generate('[generate]\nscene = "comparison"\nlights = 2\n[sweep]\nobjects = [0, 5, 9]\n')
    assert [(cell.objects, cell.lights, cell.point) for cell in made.cells] == [
        (count, 2, {"objects": count}) for count in (0, 5, 9)
    ]
    assert {cell.label for cell in made.cells} == {f"numpy, comparison-lights-2, objects {n}" for n in (0, 5, 9)}
    for cell in made.cells:
        arrays, alone = made.arrays[cell.scene_version], flatten(text.read(comparison(cell.objects, 2)))
        assert all((arrays[name] == alone[name]).all() for name in alone)
    assert ["sphere" in cell.needs for cell in made.cells] == [False, True, True]
    default = generate('[generate]\nscene = "comparison"\n').cells[0]
    assert (default.label, default.objects, default.lights) == ("numpy, comparison", 48, 3)
    spd = generate('[generate]\nscene = "balls"\n[[points]]\nsize = [0, 1]\n[[points]]\ndepth = 2\nsize = 1\n')
    assert [(cell.objects, cell.point) for cell in spd.cells] == [
        (2, {"size": 0, "depth": 10}), (11, {"size": 1, "depth": 10}), (11, {"size": 1, "depth": 2}),
    ]  # fmt: skip


def test_generated_scenes_beside_files(generate, write):
    """A point with a count is of the generated scene alone."""
    write("a.txt", comparison(4))
    points = "[[points]]\nsize = [0, 1]\n[[points]]\ndepth = 2\n"
    made = generate('scenes = ["a.txt"]\n[generate]\nscene = "balls"\n' + points)
    told = [(Path(cell.scene).stem, cell.objects, cell.point) for cell in made.cells]
    assert told == [
        ("a", 4, {"depth": 2}),
        ("balls", 2, {"size": 0, "depth": 10}),
        ("balls", 11, {"size": 1, "depth": 10}),
        ("balls", 7382, {"size": 4, "depth": 2}),
    ]
    with pytest.raises(UserError, match="sweep: every point sweeps a count that a does not have"):
        generate('scenes = ["a.txt"]\n[generate]\nscene = "balls"\n[sweep]\nsize = [0, 1]\n')


SEVERAL = """where = ["scene != 'balls' or size <= 1"]
[[generate]]
scene = "comparison"
lights = 2
[[generate]]
scene = "balls"
[[generate]]
scene = "icosphere"
"""


def test_several_generated_scenes(generate):
    """Each point is of the scenes that have its counts; `where` is asked before a scene is made."""
    made = generate(SEVERAL + "[[points]]\nobjects = [3, 4]\n[[points]]\nsize = [0, 1, 8]\n[sweep]\ndepth = [1, 2]\n")
    told = [(Path(cell.scene).stem, cell.objects, cell.lights, cell.point) for cell in made.cells]
    assert told == [
        *(("comparison-lights-2", n, 2, {"objects": n, "depth": d}) for n in (3, 4) for d in (1, 2)),
        *(("balls", n, 3, {"size": s, "depth": d}) for s, n in ((0, 2), (1, 11)) for d in (1, 2)),
        *(("icosphere", 20 * 4**s, 3, {"size": s, "depth": d}) for s in (0, 1, 8) for d in (1, 2)),
    ]
    assert made.left_out == (("scene != 'balls' or size <= 1", 2),)
    assert len({cell.scene_version for cell in made.cells}) == 7
    with pytest.raises(UserError, match="sweep: every point sweeps a count that comparison-lights-2 does not have"):
        generate(SEVERAL + "[sweep]\nsize = [0, 1]\n")
    with pytest.raises(UserError, match=r"generate\.1: lights is no count of balls; it has size"):
        generate('[[generate]]\nscene = "tetra"\n[[generate]]\nscene = "balls"\nlights = 2\n')


def test_hierarchies(known):
    """The plan of experiments/hierarchy.toml, without its largest scenes."""
    file = Path(__file__).parents[3] / "experiments" / "hierarchy.toml"
    asked = experiments.load(file)
    asked = asked.model_copy(update={"where": (*asked.where, "objects <= 100000")})
    made = plan.make(asked, file, known)
    assert {Path(cell.scene).stem for cell in made.cells} == {"comparison", "balls", "icosphere"}
    for cell in made.cells:
        parameters = cell.parameters
        assert parameters.accel == "bvh" or cell.objects <= 10_000
        assert cell.entry.name == "cpp" or parameters.vector == "off"
        assert cell.entry.name != "python" or cell.objects <= 100
    for scene in ("comparison", "balls", "icosphere"):
        for name, methods in (("cpp", ("off", "on")), ("numba", ("off",)), ("python", ("off",))):
            mine = [cell for cell in made.cells if (Path(cell.scene).stem, cell.entry.name) == (scene, name)]
            assert {cell.parameters.vector for cell in mine} == set(methods)
            for accel in ("none", "bvh"):
                assert len({cell.objects for cell in mine if cell.parameters.accel == accel}) > 1
    assert (min(cell.objects for cell in made.cells), max(cell.objects for cell in made.cells)) == (2, 81_920)


def test_counts_that_a_scene_cannot_have(generate):
    for more, message in (
        ('scene = "tetra"\n[sweep]\nsize = [0]\n', "experiment.toml: generate: expected a size factor from 1, found 0"),
        ('scene = "balls"\n[sweep]\nsize = [9]\n', "experiment.toml: sweep.size: Input should be less than or equal"),
        ('scene = "comparison"\n[sweep]\nlights = ["x"]\n', "sweep.lights: Input should be a valid integer"),
    ):
        with pytest.raises(UserError) as fault:
            generate(f"[generate]\n{more}")
        assert message in str(fault.value)
