"""Hostile experiments: cells to run, or an error that names the key."""

import math
from pathlib import Path

import hostile
import pytest

from harness.errors import UserError
from harness.experiment import experiment
from harness.experiment.experiment import Experiment, Generate, Measure, Stress
from harness.experiment.image import Image
from harness.plan import plan

EXPERIMENTS = Path(__file__).parents[2] / "experiments"
SCENE = (
    "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\nLIGHT (4,5,6) (1,1,1) 0\nSPHERE (0,0,-1) 0.8 (1,1,1) 0.4 9 (0,0,0) 9 1\n"
)
HEAD = 'title = "t"\nscenes = ["scene.txt"]\nrenderers = ["python", "numpy"]\n'
VALID = [
    HEAD + 'processes = 2\ntimeout = "10 s"\nwhere = ["side <= 8 or renderer == \'numpy\'"]\n'
    "[image]\nwidth = 8\nheight = 8\n[sweep]\nside = [4, 8]\ndepth = [0, 1]\n[override.python]\nframes = 1\n",
    HEAD + "[[sweep]]\ndepth = [1, 2]\nsamples = [1, 2]\n[[points]]\nside = 4\n[[points]]\nside = [4, 5]\nseed = 3\n",
    'title = "t"\nrenderers = ["numpy"]\n[generate]\nscene = "comparison"\nobjects = 4\n[sweep]\nlights = [1, 2]\n'
    '[measure]\ninterval = "50 ms"\npair = "off"\n[reference]\nspots = 0\ntimes = 8\n',
    'title = "t"\nrenderers = ["numpy"]\n[[case]]\nname = "a"\nscene = "scene.txt"\ndepth = 1\n[[case]]\nname = "b"\n'
    'scene = "scene.txt"\n[image]\nregion = [0, 0, 4, 4]\n[slurm]\ncells = 3\noptions = {qos = "long"}\n',
    *(text for path in sorted(EXPERIMENTS.glob("*.toml")) if len(text := path.read_text()) < 1200),
]
KEYS = [key for model in (Experiment, Image, Generate, Measure, Stress) for key in model.model_fields]
PIECES = [
    *(f"{key} = 1\n" for key in KEYS), *KEYS, "[sweep]\n", "[[points]]\n", "[", "]", "=", '"', "\n", "{x = 1}", "true",
    '"1/255"', '"2^-10"', '"10 min"', '"one pixel"', '"all"', "[0, 0, 4, 4]", "1979-05-27T07:32:00Z", "'''",
]  # fmt: skip
FEW = 20  # points, and objects, of experiments that are planned: the rest is of their length, and takes its time


@pytest.fixture
def tried(place, known):
    """tried(content): the plan, the experiment of one that asks for much, or the UserError."""
    (place / "scene.txt").write_text(SCENE)
    (place / "comparison.txt").write_text(SCENE)

    def tried(content, planned=False):
        file = place / "e.toml"
        file.write_bytes(content if isinstance(content, bytes) else content.encode())

        def run():
            found = experiment.load(file)
            return plan.make(found, file, known) if planned or is_small(found) else found

        return hostile.outcome(run, "e.toml", "scene.txt", ".txt", "/dev/zero")

    return tried


def is_small(told):
    tables = [told.sweep] if isinstance(told.sweep, dict) else [*told.sweep]
    lists = [value for table in (*tables, *told.points) for value in table.values()]
    points = math.prod(len(value) if isinstance(value, tuple) else 1 for value in lists)
    counts = [count for made in told.made() for count in made.counts().values()]
    counts += [item for value in lists for item in (value if isinstance(value, tuple) else (value,))]
    asked = [told.image.rays, *(case.rays or 0 for case in told.case), told.processes]
    if told.stress or any(made.scene != "comparison" for made in told.made()):
        return False
    return points * len(told.renderers) <= FEW and not any(
        isinstance(count, int) and not isinstance(count, bool) and abs(count) > FEW for count in (*counts, *asked)
    )


def test_cases(fuzz, tried):
    fuzz("experiment", lambda random: tried(hostile.mutated(random, VALID, PIECES)))


def test_the_corpus_is_good(tried):
    for text in VALID[:4]:
        assert not isinstance(found := tried(text), UserError), found
        assert found.cells


NINE = "[" + ", ".join(map(str, range(1000))) + "]"
BAD = {
    "nothing": (b"", "title: Field required"),
    "NUL bytes": (b"\0" * 1000, "it has a NUL byte here"),
    "UTF-16": (HEAD.encode("utf-16"), "not a text file"),
    "half a letter": (HEAD.encode() + b"# \xc3", "not a text file"),
    "an ELF file": (b"\x7fELF\x02\x01\x01\0" + bytes(range(256)) * 9, "not a text file"),
    "nested lists": (HEAD + "where = " + "[" * 100_000, "nested too deep"),
    "nested tables": (HEAD + "image = " + "{a = " * 100_000, "nested too deep"),
    "nested keys": (HEAD + "image" + ".a" * 1000 + " = 1\n", "nested too deep"),
    "a sweep of 10^9 points": (HEAD + f"[sweep]\nseed = {NINE}\nglossy_rays = {NINE}\nfeelers = {NINE}\n", "10000"),
    "[[sweep]] of 10^9 points": (
        HEAD + "".join(f"[[sweep]]\n{key} = {NINE}\n" for key in ("seed", "glossy_rays", "feelers")),
        "1000000000 points",
    ),
    "[[points]] of 10^9 points": (
        HEAD + f"[[points]]\nseed = {NINE}\nglossy_rays = {NINE}\nfeelers = {NINE}\n", "1000000000 points",
    ),
    "a stress of 10^9 points": (
        'title = "t"\nrenderers = ["numpy"]\n[[stress]]\nrow = "drift"\n'
        f"sweep = {{seed = {NINE}, glossy_rays = {NINE}, feelers = {NINE}}}\n", "1000000000 points",
    ),
    "[generate] with 10^12 objects": (
        'title = "t"\nrenderers = ["numpy"]\n[generate]\nscene = "comparison"\nobjects = 1000000000000\n',
        "generate.objects",
    ),
    "[generate] of 9^100 objects": (
        'title = "t"\nrenderers = ["numpy"]\n[generate]\nscene = "balls"\nsize = 100\n', "generate.size",
    ),
    "[generate] of 9^8 objects": (
        'title = "t"\nrenderers = ["numpy"]\n[generate]\nscene = "balls"\nsize = 8\n', "48427562 objects",
    ),
    "a sweep of 9^8 objects": (
        'title = "t"\nrenderers = ["numpy"]\n[generate]\nscene = "balls"\n[sweep]\nsize = [8]\n',
        "48427562 objects, 10000000 at most",
    ),
    "10^6 processes": (
        HEAD + f"processes = 10000\n[sweep]\nseed = {NINE}\n", "2000 cells have 20000000 processes",
    ),
    "a width of 10^9": (HEAD + "[image]\nwidth = 1000000000\n", "image.width"),
    "a width of 5000 digits": (HEAD + f"[image]\nwidth = {'9' * 5000}\n", "digits"),
    "10^12 processes": (HEAD + "processes = 1000000000000\n", "processes"),
    "10^12 processes of one": (HEAD + "[override.python]\nprocesses = 1000000000000\n", "override.python.processes"),
    "10^12 frames": (HEAD + "frames = 1000000000000\n", "frames"),
    "a number that is none": (HEAD + "[image]\ncutoff = nan\n", "image.cutoff"),
    "infinity": (HEAD + "timeout = inf\n", "timeout"),
    "1e308 hours": (HEAD + f'timeout = "{"9" * 308} h"\n', "timeout"),
    "1e308 as a number": (HEAD + '[image]\ncutoff = "1e308/1e-308"\n', "image.cutoff"),
    "0/0": (HEAD + '[image]\nepsilon = "0/0"\n', "image.epsilon"),
    "a region of 10^9": (HEAD + "[image]\nregion = [0, 0, 1000000000, 1]\n", "image.region"),
    "a where that is code": (HEAD + "where = ['__import__(\"os\").getpid() > 0']\n", "where"),
    "a where that looks inside": (HEAD + "where = ['().__class__.__mro__[1] == 1']\n", "where"),
    "a where that takes long": (HEAD + "where = ['9**9**9**9 > 1']\n", "where"),
    "a where of many digits": (HEAD + "where = ['9**999999 > 8**999999']\n", "where"),
    "a where of much text": (HEAD + "where = ['\"x\" * 10**9 == \"\"']\n", "where"),
    "a where of many lists": (HEAD + "where = ['[x for x in [1]*10**4 for y in [1]*10**4] == []']\n", "where"),
    "a where nested": (HEAD + f"where = ['{'(' * 10_000}1{')' * 10_000} == 1']\n", "where"),
    "a where of minus": (HEAD + f"where = ['{'-' * 100_000}1 == 1']\n", "where"),
    "a where of not": (HEAD + f"where = ['{'not ' * 100_000}true']\n", "where"),
    "a where of a long sum": (HEAD + f"where = ['{'1+' * 100_000}1 == 1']\n", "where"),
    "a where with a NUL": (HEAD + 'where = ["1 == \\u0000"]\n', "where"),
    "a scene with a NUL": (HEAD.replace("scene.txt", "\\u0000.txt"), "no such file"),
    "a scene that is a device": (HEAD.replace("scene.txt", "/dev/zero"), "unknown kind of scene"),
    "100,000 renderers": (HEAD.replace('"python"', ", ".join(f'"r{n}"' for n in range(100_000))), "no renderer"),
    "100,000 unknown keys": (HEAD + "".join(f"k{n} = 1\n" for n in range(100_000)), "unknown key"),
    "escapes for a terminal": (HEAD + '"\\u001b[2J" = 1\n', "unknown key"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_bad(tried, name):
    content, match = BAD[name]
    found = tried(content, planned=True)
    assert isinstance(found, UserError), found
    assert match in str(found)


@pytest.mark.parametrize(
    "setting", ["=", "a", "a=" + "[" * 10_000, "a=" + "1" * 5000, "a.b." * 5000 + "=1", "title=\x00"]
)
def test_settings(place, setting):
    """Of the command line; those of experiments and of the scheduler alike."""
    (place / "e.toml").write_text(HEAD)
    hostile.outcome(lambda: experiment.load(place / "e.toml", (setting,)), "--set", "e.toml")
