import dataclasses
import json
from dataclasses import replace
from types import SimpleNamespace

import cpu_time
import pytest

from harness.errors import UserError
from harness.experiment import experiment as experiments
from harness.plan import plan
from harness.renderer import registry
from harness.renderer.manifest import Requires

BASE = 'title = "t"\nscenes = ["scene.txt"]\nrenderers = ["python", "numpy"]\n'
SCENE = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\nSPHERE (0,0,-1) 0.8 (0.7,0.5,0.3) 0.4 20 (0,0,0) 1e6 1\n"


@pytest.fixture
def make(write, known):
    def make(more="", scene=SCENE, known=known, only=()):
        write("scene.txt", scene)
        file = write("experiment.toml", BASE + more)
        return plan.make(experiments.load(file), file, known, only)

    return make


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


def test_scale(write, known):
    write("scene.txt", SCENE)
    case = '[[case]]\nname = "{}"\nscene = "scene.txt"\n{}\n'.format
    cases = case("a", "width = 41\nheight = 3") + case("b", 'region = [10, 20, 11, 64]\nscale = "1/8"')
    image = "[image]\nwidth = 64\nheight = 64\nscale = 0.25\n"
    file = write("experiment.toml", f'title = "t"\nrenderers = ["python"]\n{image}{cases}')
    made = plan.make(experiments.load(file), file, known, ())
    assert [(cell.parameters.width, cell.parameters.height, cell.parameters.region) for cell in made.cells] == [
        (10, 1, None), (8, 8, (1, 2, 2, 8)),
    ]  # fmt: skip


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


def test_a_point_with_half_a_lens_says_where(make):
    with pytest.raises(UserError) as told:
        make("[[points]]\nside = 4\n[[points]]\nside = 5\nlens_radius = 1\n")
    assert ".toml: point {" in str(told.value) and "lens_radius: also needs focal_distance" in str(told.value)


@pytest.mark.parametrize(
    ("expression", "message"),
    [
        ("depth <", 'experiment.toml:4: where "depth <": expected an expression such as depth <= 4'),
        ("deph < 3", 'where "deph < 3": no parameter deph; did you mean "depth"?'),
        ("xyz < 3", 'where "xyz < 3": no parameter xyz; known: renderer, scene, case, stress, level, objects'),
        ("renderer == 'numpy' or sides < 3", 'no parameter sides; did you mean "side"?'),
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
        None, "no cell of any variant runs here without being an exhibit or simulated",
    )  # fmt: skip


@pytest.mark.alone
def test_ten_thousand_cells_take_little_time(generate):
    """A bound for the planner, of which it takes a half: four times as long as writing the cells' parameters as JSON.

    Both times are of small objects, for which one processor may be slower and no slower in a loop of arithmetic.
    """
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

    def write():
        return [json.dumps(dataclasses.asdict(cell.parameters)) for cell in made.cells]

    made, took = cpu_time.seconds(work)
    written, least = cpu_time.seconds(write)
    print("planning takes", took / least, "times as long as writing")
    assert len(made.cells) == len(written) == 10_000 == len({cell.key for cell in made.cells})
    assert took < 4 * least


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


def test_label(make):
    cell = make().cells[0]
    cell = replace(cell, entry=SimpleNamespace(name="cpp"), scene="scenes/a.txt", point={"depth": 3, "region": "all"})
    assert cell.label == "cpp, a, depth 3, region all"


def test_the_cells_of_ladders_are_their_rungs(make):
    """Each once, though two ladders share a rung, and one rung spells a default."""

    def rung(renderer, image):
        return f'[[ladder.rung]]\nname = "r"\nrenderer = "{renderer}"\nchanges = "c"\nimage = {image}\n'

    shared = rung("python", '{ walk = "least", accel = "none" }')
    first = rung("numpy", "{}") + shared + rung("python", '{ walk = "chain" }')
    last = rung("python", '{ accel = "auto" }')
    made = make(f'[[ladder]]\nname = "a"\n{first}[[ladder]]\nname = "b"\n{shared}{last}')
    told = [(cell.entry.name, cell.point) for cell in made.cells]
    assert told == [
        ("python", {"accel": "auto", "walk": "least"}),
        ("numpy", {"accel": "auto", "walk": "least"}),
        ("python", {"accel": "none", "walk": "least"}),
        ("python", {"accel": "auto", "walk": "chain"}),
    ]
