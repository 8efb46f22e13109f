import random
from collections import Counter
from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace

import cpu_time
import pytest

from harness import experiment as experiments
from harness import plan, registry
from harness.errors import UserError
from harness.manifest import Requires
from harness.plan import Cell, Plan, Turn
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.generate import comparison

pytestmark = pytest.mark.alone

BASE = 'title = "t"\nscenes = ["scene.txt"]\nrenderers = ["python", "numpy"]\n'
SCENE = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\nSPHERE (0,0,-1) 0.8 (0.7,0.5,0.3) 0.4 20 (0,0,0) 1e6 1\n"


@pytest.fixture
def make(write, known):
    def make(more="", scene=SCENE, known=known, only=()):
        write("scene.txt", scene)
        file = write("experiment.toml", BASE + more)
        return plan.make(experiments.load(file), file, known, only)

    return make


def cells(*processes):
    rest = dict.fromkeys(field.name for field in fields(Cell))
    return tuple(Cell(**{**rest, "key": f"c{n}", "processes": count}) for n, count in enumerate(processes))


def test_every_cell_once_a_round():
    rng = random.Random(7)
    for seed in range(20):
        counts = [rng.randint(1, 6) for _ in range(rng.randint(1, 8))]
        order = Plan(cells(*counts), {}).order(seed)
        assert Counter(turn.cell.key for turn in order) == {f"c{n}": count for n, count in enumerate(counts)}
        rounds = [turn.number for turn in order]
        assert rounds == sorted(rounds)
        for repetition in range(max(counts)):
            keys = [turn.cell.key for turn in order if turn.number == repetition]
            assert sorted(keys) == sorted(f"c{n}" for n, count in enumerate(counts) if count > repetition)


def test_the_seed_decides_the_order():
    some = Plan(cells(*[5] * 8), {})

    def keys(seed):
        return [turn.cell.key for turn in some.order(seed)]

    assert keys(1) == keys(1) != keys(2)
    assert keys(1)[:8] != keys(1)[16:24]
    assert Plan((), {}).order(1) == []


def test_linear_drift_meets_all_cells_alike():
    order = Plan(cells(*[6] * 9), {}).order(3)
    places = {}
    for place, turn in enumerate(order):
        places.setdefault(turn.cell.key, []).append(place)
    assert len({sum(found) for found in places.values()}) == 1
    assert len({tuple(found) for found in places.values()}) == 9


def test_sequential():
    order = Plan(cells(2, 1, 3), {}).order(1, "sequential")
    assert [(turn.cell.key, turn.number) for turn in order] == [
        ("c0", 0), ("c0", 1), ("c1", 0), ("c2", 0), ("c2", 1), ("c2", 2),
    ]  # fmt: skip


def test_the_pair_has_turns_of_its_own():
    some = cells(5, 3, 5)
    paired = Plan(some, {}, pair=some[0])
    order = paired.order(4)
    assert Counter(turn.kind for turn in order) == {"timed": 13, "pair": 5}
    first = [turn for turn in order if turn.kind == "pair"]
    assert [turn.number for turn in first] == [0, 1, 2, 3, 4] and {turn.cell.key for turn in first} == {"c0"}
    assert [turn.number for turn in order] == sorted(turn.number for turn in order)
    between = [
        order.index(Turn(some[0], number, "pair")) - order.index(Turn(some[0], number, "timed")) for number in range(5)
    ]
    assert min(between) < 0 < max(between)
    kinds = [turn.kind for turn in paired.order(4, "sequential") if turn.cell is some[0]]
    assert kinds == ["timed"] * 5 + ["pair"] * 5


@pytest.mark.parametrize(
    ("sweep", "expected"),
    [
        ("", [{}]),
        (
            "[sweep]\ndepth = [1, 2]\nwidth = [8, 9]\n",
            [{"depth": d, "width": w} for d in (1, 2) for w in (8, 9)],
        ),
        ("[[sweep]]\ndepth = [1, 2]\nwidth = [8, 9]\n", [{"depth": 1, "width": 8}, {"depth": 2, "width": 9}]),
        (
            "[[sweep]]\ndepth = [1, 2]\nwidth = [8, 9]\n[[sweep]]\nshadows = [false, true]\n",
            [{"depth": d, "width": w, "shadows": s} for d, w in ((1, 8), (2, 9)) for s in (False, True)],
        ),
    ],
)
def test_points(sweep, expected, make):
    made = make(sweep)
    assert [cell.point for cell in made.cells] == [point for point in expected for _ in range(2)]
    assert [cell.entry.name for cell in made.cells] == ["python", "numpy"] * len(expected)
    for cell in made.cells:
        for name, value in cell.point.items():
            assert getattr(cell.parameters, name) == value


def points(made):
    return list(dict.fromkeys(tuple(cell.point.items()) for cell in made.cells))


def test_one_at_a_time_and_jointly(make):
    tables = "[[points]]\nside = [8, 16]\n[[points]]\ndepth = [0, 3]\n[[points]]\nside = [4, 8]\ndepth = [0, 3]\n"
    made = make("[image]\nwidth = 8\nheight = 8\ndepth = 3\n" + tables)
    expected = [(8, 3), (16, 3), (8, 0), (4, 0), (4, 3)]  # a point that two tables hold is one
    assert points(made) == [(("side", side), ("depth", depth)) for side, depth in expected]
    for cell in made.cells:
        assert cell.parameters.width == cell.parameters.height == cell.point["side"]
        assert cell.parameters.depth == cell.point["depth"]


def test_points_are_combined_with_a_sweep(make):
    made = make("[sweep]\nshadows = [false, true]\n[[points]]\ndepth = 1\n[[points]]\nregion = [[0, 0, 2, 2]]\n")
    assert points(made) == [
        (("depth", depth), ("region", region), ("shadows", shadows))
        for depth, region in ((1, "all"), (10, (0, 0, 2, 2)))
        for shadows in (False, True)
    ]


def test_cells_that_two_tables_spell_differently_are_one(make):
    made = make('[[points]]\nthreads = "default"\n[[points]]\nthreads = [1, 2]\n')
    assert [cell.parameters.threads for cell in made.cells] == [1, 1, 2, 2]
    with pytest.raises(UserError, match='"python, scene, threads default" and "python, scene, threads 1" are the same'):
        make('[[points]]\nthreads = ["default", 1]\n')


def test_where(make):
    tables = "[sweep]\nside = [8, 16, 32]\ndepth = [0, 3]\n"
    expressions = "renderer != 'python' or side <= 8", "objects * lights == 0 and depth in (0, 3)", "depth < 3"
    made = make(f"where = {list(expressions)}\n{tables}")
    assert [(cell.entry.name, cell.point["side"]) for cell in made.cells] == [
        ("python", 8), ("numpy", 8), ("numpy", 16), ("numpy", 32),
    ]  # fmt: skip
    assert made.left_out == tuple(zip(expressions, (4, 0, 4), strict=True))
    assert len(made.cells) + sum(count for _, count in made.left_out) == 12


def test_a_cell_that_two_tables_hold_is_left_out_once(make):
    made = make('where = ["depth < 3"]\n[[points]]\ndepth = [0, 3]\n[[points]]\ndepth = [1, 3]\n')
    assert [cell.point["depth"] for cell in made.cells] == [0, 0, 1, 1] and made.left_out == (("depth < 3", 2),)


def test_each_cell_has_needs_of_its_own(make):
    made = make("[image]\nlens_radius = 0.1\nfocal_distance = 4.0\n[sweep]\ndepth = [0, 1]\nsamples = [1, 2]\n")
    for cell in made.cells:
        assert ("reflection" in cell.needs) == (cell.point["depth"] == 1)
        assert ("supersampling" in cell.needs) == (cell.point["samples"] == 2) and "lens" in cell.needs


@pytest.mark.parametrize(
    ("expression", "message"),
    [
        ("depth <", 'experiment.toml: where "depth <": expected an expression such as depth <= 4'),
        ("deph < 3", 'where "deph < 3": no parameter deph; known: renderer, scene, case, stress, level, objects'),
        ("renderer == 'numpy' or sides < 3", "no parameter sides; known: "),
        ("depth * lights", "expected true or false, such as objects * lights <= 200, found 0"),
        ("size > 3", "cannot be worked out for size = None: '>' not supported"),
        ("depth / lights > 1", "cannot be worked out for depth = 10, lights = 0: division by zero"),
        ("open('a') or True", "no parameter open; known: "),
        ("().__class__ == 1", 'where "().__class__ == 1": cannot be worked out for '),
        ("depth > 99", "experiment.toml: every cell is left out by where"),
    ],
)
def test_faulty_constraints(expression, message, make):
    with pytest.raises(UserError) as fault:
        make(f'where = ["""{expression}"""]\n')
    assert message in str(fault.value)


@pytest.fixture
def generate(write, known):
    def make(more, renderers='["numpy"]'):
        file = write("experiment.toml", f'title = "t"\nrenderers = {renderers}\n{more}')
        return plan.make(experiments.load(file), file, known)

    return make


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
    with pytest.raises(UserError, match="generate: no point is of comparison-lights-2, which lacks a count of each"):
        generate(SEVERAL + "[sweep]\nsize = [0, 1]\n")
    with pytest.raises(UserError, match=r"generate\.1: lights is no count of balls; it has size"):
        generate('[[generate]]\nscene = "tetra"\n[[generate]]\nscene = "balls"\nlights = 2\n')


def test_hierarchies(known):
    """The plan of experiments/hierarchy.toml, without its largest scenes."""
    file = Path(__file__).parents[2] / "experiments" / "hierarchy.toml"
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


def test_least_frame(make):
    assert {cell.parameters.least_frame for cell in make().cells} == {0.001}
    assert {cell.parameters.least_frame for cell in make("[measure]\nleast_frame = 0\n").cells} == {0}


def test_the_pair_is_the_most_work_of_the_fastest(generate, known):
    if known["cpp"].unavailable:
        pytest.skip(known["cpp"].unavailable)
    more = '[generate]\nscene = "comparison"\n[sweep]\nside = [8, 16]\ndepth = [5, 1]\nobjects = [4, 2]\n'
    both, four = '["python", "cpp"]', "processes = 4\n"

    def pair(head="", renderers=both, measure=""):
        made = generate(head + more + measure, renderers)
        return made.pair and made.pair.label, made.pair_reason

    most = "comparison, side 16, depth 5, objects 4"
    assert pair() == (f"cpp, {most}", "")
    assert pair(measure='[measure]\npair = "python"\n') == (f"python, {most}", "")
    assert pair(four) == (None, "its noise floor needs 5 processes")
    assert pair(measure="[override.cpp]\nprocesses = 4\n") == (f"python, {most}", "")
    assert pair(measure='[measure]\npair = "off"\n') == (None, 'measure.pair is "off"')
    assert pair(renderers='["numba-cuda"]')[0] is None
    assert pair(renderers='["python", "cpp"]', head="where = [\"renderer != 'cpp'\"]\n") == (f"python, {most}", "")


def test_no_pair_of_what_cannot_run_or_be_compared(make, known):
    def changed(**what):
        entry = known["numpy"]
        return replace(entry, variant=entry.variant.model_copy(update=what))

    absent, exhibit = changed(requires=Requires(modules=("no_such_module",))), changed(exhibit="made to be wrong")
    for entry in (absent, exhibit):
        assert make(known={**known, "numpy": entry}).pair.entry.name == "python"
    assert make().pair.entry.name == "numpy"
    unsupported = make('[image]\nprecision = "float16"\n')
    assert (unsupported.pair, unsupported.pair_reason) == (
        None, "no cell here that runs, is no exhibit and is not simulated",
    )  # fmt: skip


def test_ten_thousand_cells_in_two_seconds(generate):
    """The bound of the planner, of which it takes a third to a half. Time of the processor: the machine may be busy."""
    more = """where = ["objects * lights <= 5000", "renderer != 'python' or side <= 128"]
[generate]
scene = "comparison"
[sweep]
side = [8, 16, 24, 32, 40, 48, 56, 64, 72, 80]
depth = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9]
objects = [1, 2, 5, 10, 20, 30, 40, 50, 60, 70]
lights = [1, 2, 3, 4, 5]
precision = ["float64", "float32"]
"""

    def work():
        made = generate(more)
        made.order(1)
        return made

    made, took = cpu_time.seconds(work)
    assert len(made.cells) == 10_000 == len({cell.key for cell in made.cells})
    assert took < 2


def test_defaults_and_overrides(make):
    python, numpy = make('timeout = "1.5 min"\n[override.python]\nframes = 0\nprocesses = 1\ntimeout = 9\n').cells
    assert (python.parameters.frames, python.processes, python.timeout) == (0, 1, 9)
    assert (numpy.parameters.frames, numpy.processes, numpy.timeout) == (2, 5, 90)


def test_regions(make):
    made = make('[image]\nwidth = 9\nheight = 4\n[sweep]\nregion = ["all", "one pixel", [1, 2, 3, 4]]\n')
    assert [cell.parameters.bounds() for cell in made.cells[::2]] == [(0, 0, 9, 4), (4, 2, 5, 3), (1, 2, 3, 4)]


def test_only(make):
    assert [cell.entry.name for cell in make(only=("numpy",)).cells] == ["numpy"]


def test_threads(write, known, monkeypatch):
    monkeypatch.setattr(registry, "usable_cores", lambda: 7)
    write("scene.txt", SCENE)
    text = BASE.replace("numpy", "cpp-threads") + '[sweep]\nthreads = ["default", 3]\n'
    file = write("experiment.toml", text)
    made = plan.make(experiments.load(file), file, known)
    assert [cell.parameters.threads for cell in made.cells] == [1, 7, 3, 3]


def keys(made):
    return [cell.key for cell in made.cells]


def test_keys_stay(make):
    base = keys(make())
    assert len(set(base)) == 2
    assert keys(make()) == base
    assert keys(make("processes = 9\nseed = 4\n")) == base
    assert keys(make('timeout = "1 s"\norder = "sequential"\n[measure]\ninterval = "10 ms"\npair = "off"\n')) == base
    assert keys(make("[image]\nwidth = 512\ndepth = 10\n")) == base
    assert keys(make(scene="# a comment\n" + SCENE + "\n")) == base
    assert keys(make("[sweep]\ndepth = [10]\n")) == base
    assert keys(make("[[points]]\ndepth = 10\n[[points]]\nside = 512\n")) == base


@pytest.mark.parametrize(
    "more",
    ["frames = 3\n", '[measure]\nleast_frame = "2 ms"\n']
    + [f"[image]\n{line}\n" for line in (
        "width = 511", "height = 511", "depth = 9", "shadows = true", "sample_x = 0.25", "sample_y = 0.25",
        'precision = "float32"', 'region = "one pixel"', "threads = 2", 'scene_memory = "shared"', "block_width = 8",
        "block_height = 8", "total_threads = 64", "max_registers = 64",
    )],
)  # fmt: skip
def test_keys_change_with_parameters(make, more):
    assert not set(keys(make(more))) & set(keys(make()))


@pytest.mark.parametrize(
    "scene",
    [
        SCENE.replace("0.8", "0.80000000000000004"),
        SCENE + "BACKGROUND (0.1,0,0)\n",
        SCENE.replace("(0,0,3)", "(0,0,4)"),
    ],
)
def test_keys_change_with_the_scene(make, scene):
    same = scene.count("0.80000000000000004")  # the same float64
    assert (keys(make(scene=scene)) == keys(make())) == bool(same)


def test_keys_change_with_the_renderer(make, known, bad_folder):
    before, other = keys(make())
    manifest = known["python"].renderer.manifest.model_copy(update={"shares": ()})
    changed = registry.Renderer(bad_folder("bad-nothing", name="other"), manifest)
    python = replace(known["python"], renderer=changed)
    after, same = keys(make(known={**known, "python": python}))
    assert after != before and same == other


def test_label():
    entry = SimpleNamespace(name="cpp")
    cell = replace(cells(1)[0], entry=entry, scene="scenes/a.txt", point={"depth": 3, "region": "all"})
    assert cell.label == "cpp, a, depth 3, region all"
