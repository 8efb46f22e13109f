import random
from collections import Counter
from dataclasses import fields, replace
from types import SimpleNamespace

import pytest

from harness import experiment as experiments
from harness import plan, registry
from harness.plan import Cell, Plan

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
        assert Counter(cell.key for cell, _ in order) == {f"c{n}": count for n, count in enumerate(counts)}
        rounds = [repetition for _, repetition in order]
        assert rounds == sorted(rounds)
        for repetition in range(max(counts)):
            keys = [cell.key for cell, number in order if number == repetition]
            assert sorted(keys) == sorted(f"c{n}" for n, count in enumerate(counts) if count > repetition)


def test_the_seed_decides_the_order():
    some = Plan(cells(*[5] * 8), {})

    def keys(seed):
        return [cell.key for cell, _ in some.order(seed)]

    assert keys(1) == keys(1) != keys(2)
    assert keys(1)[:8] != keys(1)[8:16]
    assert Plan((), {}).order(1) == []


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
    assert keys(make('timeout = "1 s"\n[measure]\ninterval = "10 ms"\n')) == base
    assert keys(make("[image]\nwidth = 512\ndepth = 10\n")) == base
    assert keys(make(scene="# a comment\n" + SCENE + "\n")) == base
    assert keys(make("[sweep]\ndepth = [10]\n")) == base


@pytest.mark.parametrize(
    "more",
    ["frames = 3\n"]
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
    changed = registry.Renderer(bad_folder("bad-nothing", name="other"), known["python"].renderer.manifest)
    python = replace(known["python"], renderer=changed)
    after, same = keys(make(known={**known, "python": python}))
    assert after != before and same == other


def test_label():
    entry = SimpleNamespace(name="cpp")
    cell = replace(cells(1)[0], entry=entry, scene="scenes/a.txt", point={"depth": 3, "region": "all"})
    assert cell.label == "cpp, a, depth 3, region all"
