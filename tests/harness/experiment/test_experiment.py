import shlex
from pathlib import Path

import pytest
from nightly import by_night

from harness.errors import UserError
from harness.experiment import experiment

REPOSITORY = Path(__file__).parents[3]
BASE = 'title = "t"\nscenes = ["a.txt"]\nrenderers = ["python"]\n'


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("50 ms", 0.05),
        ("30s", 30),
        (" 10 min ", 600),
        ("2 h", 7200),
        ("1.5 s", 1.5),
        (".5 s", 0.5),
        (3, 3),
        (0.25, 0.25),
    ],
)
def test_durations(text, seconds):
    assert experiment.duration(text) == pytest.approx(seconds, rel=1e-15)


@pytest.mark.parametrize(
    "text", ["", "s", "5", "-5 s", "1.2.3 s", ". s", "5 days", "5 S", "1e3 s", "nan s", "5 s 3 ms"]
)
def test_bad_durations(text):
    with pytest.raises(ValueError, match='expected a time such as "50 ms", "30 s", "10 min" or "2 h", found "'):
        experiment.duration(text)


def test_defaults(write):
    found = experiment.load(write("e.toml", BASE))
    assert (found.processes, found.frames, found.timeout, found.seed) == (5, 2, 600, 1)
    assert found.image.bounds() is None and found.measure.interval == 0.05
    assert (found.order, found.where, found.points, found.generate) == ("interleaved", (), (), None)
    assert (found.measure.least_frame, found.measure.pair) == (0.001, "auto")


@pytest.mark.parametrize(
    ("setting", "place", "value"),
    [
        ("processes=3", "processes", 3),
        ("image.depth = 5", "image.depth", 5),
        ('title="a = b"', "title", "a = b"),
        ("title=plain words", "title", "plain words"),
        ("timeout=10 min", "timeout", 600.0),
        ('renderers=["cpp", "numpy"]', "renderers", ("cpp", "numpy")),
        ("image.shadows=true", "image.shadows", True),
        ("image.region=[1, 2, 3, 4]", "image.region", (1, 2, 3, 4)),
        ("image.sample_x=0", "image.sample_x", 0.0),
        ("sweep.depth=[1, 2]", "sweep", {"depth": (1, 2)}),
    ],
)
def test_settings(setting, place, value, write):
    found = experiment.load(write("e.toml", BASE), (setting,))
    for step in place.split("."):
        found = getattr(found, step)
    assert found == value and type(found) is type(value)


@pytest.mark.parametrize(
    "setting", ["", "=", "=3", "processes", "title.x=3", "processes=", "image=3", "image.=3", "a b=3"]
)
def test_faulty_settings(setting, write):
    with pytest.raises(UserError):
        experiment.load(write("e.toml", BASE), (setting,))


@pytest.mark.parametrize("interval", ["1 us", "9 ms", "0 s", "-1 s"])
def test_the_measurer_looks_not_too_often(interval, write):
    """At 1 us it would take a core to itself, perhaps that of the renderer."""
    with pytest.raises(UserError, match="interval"):
        experiment.load(write("e.toml", BASE), (f'measure.interval="{interval}"',))
    assert experiment.load(write("e.toml", BASE), ('measure.interval="10 ms"',)).measure.interval == 0.01


def test_every_fault_is_named_at_once(write):
    file = write("e.toml", BASE + 'frames = "x"\nprocesses = 0\n[image]\ndeph = 3\n')
    with pytest.raises(UserError) as fault:
        experiment.load(file)
    assert [line.split(": ")[1] for line in str(fault.value).splitlines()] == ["frames", "processes", "image.deph"]
    assert all(line.startswith(f"{file}:") for line in str(fault.value).splitlines())


MADE = BASE.replace('scenes = ["a.txt"]\n', "")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (MADE, "[[case]] or [[stress]]: expected one of the three"),
        (BASE + '[[case]]\nname = "a"\nscene = "a.txt"\n', "[[case]] or [[stress]]: expected one of the three"),
        (MADE + '[generate]\nscene = "cubes"\n', "generate.scene: Input should be 'comparison', "),
        (MADE + '[generate]\nscene = "balls"\nlights = 2\n', "generate: lights is no count of balls; it has size"),
        (MADE + '[generate]\nscene = "balls"\n[sweep]\nobjects = [2]\n', "sweep.objects: only of a scene that has it"),
        (BASE + "[[points]]\nlights = [2]\n", "points.lights: only of a scene that has it, in [generate]"),
        (BASE + "[[points]]\ndeph = [2]\n", 'points.deph: no such parameter; did you mean "depth"?'),
        (BASE + "[[points]]\ndepth = []\n", "points.depth: expected at least one value"),
        (BASE + "[sweep]\ndepth = [1]\n[[points]]\ndepth = [2]\n", "points: depth is swept too"),
        (BASE + "[sweep]\nside = [8]\nwidth = [8]\n", "side is width and height at once; sweep the one or the others"),
        (BASE + "[[points]]\nside = [8]\n[[points]]\nheight = [8]\n", "side is width and height at once"),
        (BASE + 'order = "shuffled"\n', "order: Input should be 'interleaved' or 'sequential'"),
        (BASE + '[measure]\npair = "cpp"\n', "measure.pair: expected auto, off or a renderer of the"),
        (BASE + '[measure]\nleast_frame = "-1 ms"\n', 'measure.least_frame: expected a time such as "50 ms"'),
    ],
)
def test_faults_of_sweeps(text, message, write):
    file = write("e.toml", text)
    with pytest.raises(UserError) as fault:
        experiment.load(file)
    assert str(file) in str(fault.value) and message in str(fault.value)


@pytest.mark.parametrize("key", ["7" * 5000, '"²"', '"٣"', "12"], ids=["5000 digits", "square", "Arabic", "12"])
def test_an_unknown_key_of_digits_has_its_line(key, write):
    file = write("e.toml", f"{BASE}[[sweep]]\n{key} = [1]\n")
    with pytest.raises(UserError) as fault:
        experiment.load(file)
    named = key.strip('"')[:40]
    assert str(fault.value).startswith(f"{file}:5: sweep.{named}")


def test_schema_file_is_what_the_command_prints(rayrace):
    assert (REPOSITORY / "experiments" / "schema.json").read_text() == rayrace("schema", code=0).stdout


SHIPPED = sorted((REPOSITORY / "experiments").glob("*.toml"))


@pytest.mark.parametrize("file", SHIPPED, ids=lambda path: path.name)
def test_shipped_experiments_name_their_schema(file):
    """That each can be planned is seen by test_a_copy_is_complete."""
    assert file.read_text().startswith("#:schema ./schema.json\n")


@pytest.mark.slow
@pytest.mark.parametrize(
    "file",
    by_night(
        [path for path in SHIPPED if path.name.startswith("launch-")],
        *("launch-blocks.toml", "launch-faults.toml", "launch-memory.toml"),
        ids=lambda path: path.name,
    ),
)
def test_launch_experiments_in_the_simulator(file, rayrace, rows, known, tmp_path):
    """By the command that the head of the file tells; opencl runs as it is, on a processor if there is no GPU."""
    if known["numba-cuda"].missing:
        pytest.skip(known["numba-cuda"].missing)
    head = "\n".join(line.removeprefix("#") for line in file.read_text().splitlines() if line.startswith("#"))
    words = head[head.index("RAYRACE_CUDASIM=1 ") :].replace("\\\n", " ")
    variable, program, *words = shlex.split(words)
    assert (variable, program, words[:2]) == ("RAYRACE_CUDASIM=1", "rayrace", ["run", f"experiments/{file.name}"])
    words += "--out", tmp_path / "run"
    rayrace(*words, cwd=REPOSITORY, env=dict([variable.split("=")]), timeout=1200, code=0)
    found = [row for each in rows(tmp_path / "run").values() for row in each]

    def judge(name):
        mine = [row for row in found if row["variant"].startswith(name)]
        assert any(row["status"] == "ok" for row in mine) and not any(row["status"] == "unavailable" for row in mine)
        assert name == "opencl" or all(row["unranked"] for row in mine)

    judge("numba-cuda")
    if known["opencl"].unavailable:
        pytest.skip(f"numba-cuda passed; {known['opencl'].unavailable}")
    judge("opencl")


LADDER = BASE + (
    '[[ladder]]\nname = "a"\n[[ladder.rung]]\nname = "1"\nrenderer = "python"\nchanges = "-"\n'
    '[[ladder.rung]]\nname = "2"\nrenderer = "python"\nchanges = "a loop"\nimage = { walk = "chain" }\n'
)


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ('"2"\nrenderer = "python"', '"2"\nrenderer = "cpp"', 12, "cpp is not among the experiment's renderers"),
        ("walk = ", "wall = ", 14, 'image: no such parameter: wall; did you mean "walk"?'),
        ('"chain"', '"rope"', 14, "image: walk: 'rope': Input should be 'least'"),
        ("walk = ", "width = 9, walk = ", 14, "width: of [image] alone, as the rungs of a ladder have one picture"),
        ('changes = "a loop"\n', "", 10, "Field required"),
        ("renderers = ", "sweep = { depth = [1, 2] }\nrenderers = ", 5, "leave out [sweep], [[points]] and [[stress]]"),
    ],
)
def test_faults_of_a_ladder_have_their_lines(old, new, line, message, write):
    assert LADDER.count(old) == 1
    file = write("e.toml", LADDER.replace(old, new))
    with pytest.raises(UserError) as fault:
        experiment.load(file)
    (told,) = str(fault.value).splitlines()
    assert told.startswith(f"{file}:{line}: ") and message in told


def test_a_ladder_of_one_rung_is_refused(write):
    file = write("e.toml", LADDER[: LADDER.rindex("[[ladder.rung]]")])
    with pytest.raises(UserError, match=r"e\.toml:4: ladder\.0\.rung: .*at least 2"):
        experiment.load(file)
