"""Options of the command line: each adds up or is refused when given twice, and renderers named there take part."""

import json
import shutil
import tomllib
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pytest
import typer

from harness.errors import UserError
from harness.experiment import experiment
from harness.renderer import builder, registry
from harness.store import store
from rayrace import main

ROOT = Path(__file__).parents[2]
C = ROOT / "tests" / "harness" / "c_renderer"
COMMANDS = typer.main.get_command(main.app).commands
OPTIONS = [
    (name, option)
    for name, command in COMMANDS.items()
    for option in command.params
    if option.param_type_name == "option" and option.name != "help"
]


@pytest.mark.parametrize(("name", "option"), OPTIONS, ids=lambda one: getattr(one, "name", one))
def test_an_option_that_is_given_twice_adds_up_or_is_refused(name, option):
    words = [option.opts[0]] if option.is_flag else [option.opts[0], "1"]
    command = COMMANDS[name]
    if option.multiple:
        found = command.make_context(name, [*words, *words], resilient_parsing=True).params[option.name]
        assert len(found) == 2
    else:
        with pytest.raises(UserError, match=r"is given 2 times; rayrace .* takes it once"):
            command.make_context(name, [*words, *words], resilient_parsing=True)


def planned(rayrace, *words):
    told = json.loads(rayrace("run", *words, "--dry-run", "--json", code=0).stdout)
    return {cell["variant"] for cell in told["cells"]}


@pytest.mark.parametrize("only", [["--only", "cpp", "--only", "numba"], ["--only", "cpp, numba"]])
def test_only_adds_up(rayrace, only):
    assert planned(rayrace, "smoke", *only) == {"cpp", "numba"}


def test_only_takes_renderers_that_the_experiment_does_not_list(rayrace):
    listed = tomllib.loads((ROOT / "experiments" / "comparison.toml").read_text())["renderers"]
    assert "naive" not in listed and planned(rayrace, "comparison", "--only", "naive,cpp") == {"naive", "cpp"}


def test_a_key_that_is_set_twice(rayrace):
    done = rayrace("run", "smoke", "--set", "frames=1", "--set", "frames = 2", "--dry-run", code=2)
    assert "--set frames: is given 2 times; give each key once" in done.stderr


def test_a_renderer_of_the_command_line_takes_part(rayrace):
    smoke = planned(rayrace, "smoke")
    assert planned(rayrace, "smoke", "--renderer", C) == {*smoke, "flat"}
    assert planned(rayrace, "smoke", "--renderer", C, "--only", "flat") == {"flat"}
    done = rayrace("run", "smoke", "--renderer", C, "--only", "flatt", "--dry-run", code=2)
    assert 'did you mean "flat"?' in done.stderr


def test_exhibits_of_the_command_line_do_not_take_part(rayrace, tmp_path):
    shutil.copytree(C, tmp_path / "flat")
    manifest = tmp_path / "flat" / "renderer.toml"
    text = manifest.read_text()
    exhibit = text[text.index("[[variant]]") :].replace('"flat"', '"flat-wrong"') + '\nexhibit = "made to be wrong"\n'
    manifest.write_text(f"{text}\n{exhibit}")
    found = planned(rayrace, "smoke", "--renderer", tmp_path)
    assert "flat" in found and "flat-wrong" not in found


def test_any_program_may_be_the_compiler(tmp_path, monkeypatch):
    monkeypatch.setenv("RAYRACE_CACHE", str(tmp_path / "cache"))
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "main.sh").write_text("#!/bin/sh\n")
    head = 'contract = 1\nname = "mine"\ntechnology = "sh"\ndescription = "d"\nfeatures = []\n'
    tail = '[[variant]]\nname = "mine"\ncommand = ["{build}/main"]\n'

    def entry(compiler):
        command = '["{compiler}", "{folder}/main.sh", "{build}/main"]'
        build = f'[build]\ncompiler = "{compiler}"\ncommand = {command}\n'
        (folder / "renderer.toml").write_text(head + build + tail)
        return registry.entries((folder,))["mine"]

    assert entry("cp").unavailable is None
    assert (entry("cp").renderer.build().folder / "main").read_text() == "#!/bin/sh\n"
    lacking = entry("no-such-compiler")
    assert "no program no-such-compiler on the PATH" in lacking.unavailable
    with pytest.raises(builder.BuildError, match="no program no-such-compiler"):
        lacking.renderer.build()


def test_a_compiler_that_does_not_tell_its_version(tmp_path):
    """It is another one when its file is."""
    program = tmp_path / "quiet"
    program.write_text("#!/bin/sh\nexit 1\n")
    program.chmod(0o755)
    assert builder.compiler_version(str(program)) == "unavailable: it does not tell"
    before = builder._identity(str(program))
    program.write_text("#!/bin/sh\nexit 1 # another\n")
    assert builder._identity(str(program)) != before
    asked = tmp_path / "like-go"
    asked.write_text('#!/bin/sh\n[ "$1" = version ] && echo "like go 1.2" && exit 0\nexit 2\n')
    asked.chmod(0o755)
    assert builder.compiler_version(str(asked)) == "like go 1.2"


def test_a_run_in_a_renderers_folder_is_no_edit_of_it(rayrace, tmp_path):
    shutil.copytree(C, tmp_path / "mine")
    small = ("--set", "processes=2", "--set", "frames=0", "--only", "flat,python", "--set", "image.width=8")
    words = ("run", "smoke", "--renderer", tmp_path / "mine", *small)
    rayrace(*words, "--out", tmp_path / "mine" / "my-run", "--report", code=0)
    done = rayrace(*words, cwd=tmp_path / "mine", code=0)
    assert f"is a renderer's folder; the run goes to {tmp_path / 'results'}" in done.stderr
    assert len(list((tmp_path / "results").iterdir())) == 1 and not (tmp_path / "mine" / "results").exists()
    runs = [tmp_path / "mine" / "my-run", *(tmp_path / "results").iterdir()]
    rows = [row for run in runs for row in store.read(run)[1] if row["variant"] == "flat"]
    assert len({row["renderer_version"] for row in rows}) == 1


@pytest.mark.parametrize("name", ["flat.c", "below/more.h", "run.json", "results/table.csv", "new.txt"])
def test_an_edit_of_a_source_is_seen(tmp_path, name):
    """Also of a file that has only one of the names that a run has."""
    folder = tmp_path / "mine"
    shutil.copytree(C, folder)
    for known in ("below/more.h", "run.json", "results/table.csv"):
        (folder / known).parent.mkdir(exist_ok=True)
        (folder / known).write_text("1")
    renderer = registry.entries((folder,))["flat"].renderer
    assert renderer.version and renderer.changed() == []
    with open(folder / name, "a") as file:
        file.write("/* 2 */")
    assert renderer.changed() == [name]


@pytest.mark.parametrize(
    "name",
    [
        *("flat.c~", "#flat.c#", ".flat.c.swp", ".#flat.c", "flat.o", "below/flat.o", "__pycache__/a.py", "b/a.pyc"),
        *("target/CACHEDIR.TAG", "target/release/flat", "run/run.json", "run/pictures/a.npy", "old/table.csv"),
    ],
)
def test_what_editors_compilers_and_rayrace_leave_is_no_edit(tmp_path, name):
    folder = tmp_path / "mine"
    shutil.copytree(C, folder)
    for known in ("target/CACHEDIR.TAG", "run/run.json", "run/repetitions.jsonl", "old/.rayrace-report"):
        (folder / known).parent.mkdir(exist_ok=True)
        (folder / known).write_text("1")
    renderer = registry.entries((folder,))["flat"].renderer
    assert renderer.version and renderer.changed() == []
    (folder / name).parent.mkdir(parents=True, exist_ok=True)
    with open(folder / name, "a") as file:
        file.write("/* 2 */")
    assert renderer.changed() == []


def test_a_program_that_the_manifest_names_is_a_source_wherever_it_lies(tmp_path):
    folder = tmp_path / "mine"
    shutil.copytree(C, folder)
    text = (folder / "renderer.toml").read_text()
    program = folder / "target" / "release" / "flat.o"
    program.parent.mkdir(parents=True)
    (folder / "target" / "CACHEDIR.TAG").touch()
    program.write_text("1")
    text = text.replace('"{build}/flat"', '"{folder}/target/release/flat.o"')
    (folder / "renderer.toml").write_text(text)
    renderer = registry.entries((folder,))["flat"].renderer
    assert renderer.version and renderer.changed() == []
    program.write_text("2")
    assert renderer.changed() == ["target/release/flat.o"]


# Mistakes in keys and values, then in what concerns several of them, then in what is not there.
MISTAKES = {
    """title = 5
scenes = ["a.txt"]
renderers = ["cpp"]
proceses = 3

depth = 4
[image]
width = "wide"
region = [0, 0, 5]
[[case]]
name = "a"
scen = "x"
[override.cpp]
frames = -1
[measure]
intervall = 1
[[slurm]]
time = "5 h"
[generate]
scene = "bals"
""": """1: title: Input should be a valid string
4: proceses: unknown key; did you mean "processes"?
6: depth: unknown key; did you mean "image.depth" or "reference.depth"?
8: image.width: Input should be a valid integer
9: image.region.3: Field required
10: case.0.scene: Field required
12: case.0.scen: unknown key; did you mean "scene"?
14: override.cpp.frames: Input should be greater than or equal to 0
16: measure.intervall: unknown key; did you mean "interval"?
17: slurm: Input should be a valid table or instance of Slurm
20: generate.scene: Input should be 'comparison', 'balls', 'tetra' or 'icosphere'
""",
    """title = "t"
scenes = ["a.txt"]
renderers = ["cpp"]
where = ["depth >", "dept > 1"]
[[sweep]]
dept = [1]
[[sweep]]
depth = [1, -1]
walk = ["stack"]
[override.numba]
frames = 1
[measure]
pair = "nobody"
""": """4: where "depth >": expected an expression such as depth <= 4 or renderer != 'python': invalid syntax
4: where "dept > 1": no parameter dept; did you mean "depth"?
6: sweep.dept: no such parameter; did you mean "depth"?
8: sweep.depth: the lists of one [[sweep]] table are zipped, so of one length: ['depth', 'walk']
8: sweep.depth: -1: Input should be greater than or equal to 0
10: override.numba: not among the experiment's renderers
13: measure.pair: expected auto, off or a renderer of the experiment, found "nobody"
""",
    """title = "t"
scenes = ["nowhere.txt"]
renderers = ["cpp", "nunpy"]
""": """2: scenes.0: no such file: {folder}/nowhere.txt
3: renderers.1: no renderer "nunpy"; did you mean "numpy"?
""",
}


@pytest.mark.parametrize(("mistakes", "said"), MISTAKES.items(), ids=["keys and values", "several", "not there"])
def test_every_mistake_of_a_kind_at_once(mistakes, said, write):
    file = write("e.toml", mistakes)
    with pytest.raises(UserError) as fault:
        experiment.load(file, renderers=registry.entries())
    wanted = [f"{file}:{line}" for line in said.format(folder=file.parent).splitlines()]
    assert sorted(fault.value.message.splitlines()) == sorted(wanted)


def test_a_mistake_of_a_setting(write):
    file = write("e.toml", 'title = "t"\nscenes = ["a.txt"]\nrenderers = ["cpp"]\nproceses = 3\n')
    with pytest.raises(UserError) as fault:
        experiment.load(file, ("height=3",))
    assert fault.value.message.splitlines() == [
        '--set height: unknown key; did you mean "image.height"?',
        f'{file}:4: proceses: unknown key; did you mean "processes"?',
    ]


@pytest.mark.parametrize(("text", "value"), [("5", 5), ("5%", 5), ("2.5 %", 2.5), (" 0", 0)])
def test_per_cent(text, value):
    assert main.percent(text) == value


@pytest.mark.parametrize("text", ["", "%", "5 percent", "-1", "nan", "inf", "5%%"])
def test_no_per_cent(text):
    with pytest.raises(typer.BadParameter, match="expected a number of per cent, such as 5 or 5%"):
        main.percent(text)


def test_the_version(rayrace):
    assert rayrace("--version", code=0).stdout == f"rayrace {version('rayrace')}\n"


@pytest.fixture(scope="module")
def stored(rayrace, tmp_path_factory):
    folder = tmp_path_factory.mktemp("stored")
    (folder / "scene.txt").write_text("CAMERA (0,0,0) (1,0,0) (0,1,0) 3\n")
    head = 'title = "t"\nscenes = ["scene.txt"]\nrenderers = ["python"]\nprocesses = 1\nframes = 1\n'
    (folder / "e.toml").write_text(head + "[image]\nwidth = 4\nheight = 4\n")
    rayrace("run", "e.toml", "--out", "run", cwd=folder, code=0)
    return folder


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["export", "run", "--format", "pyperf", "--no-pictures"], "--no-pictures: only with --format packed"),
        (["export", "run", "--format", "github", "--no-truths"], "--no-truths: only with --format packed"),
        (["export", "run", "--format", "packed", "-o", "a.tar.xz", "--host", "x"], "--host: not with --format packed"),
        (["export", "run", "--format", "pyperf", "--host", "nobody"], "--host nobody: there are rows of "),
        (["compare", "run", "run", "--host", "nobody"], "--host nobody: there are rows of "),
        (["doctor", "--renderer", "."], "--scene, --target, --renderer: only with --cuda"),
        (["experiments", "-o", "there"], "-o: only with the name of an experiment"),
        (
            ["run", "e.toml", "--executor", "slurm", "--detach", "--report"],
            "--report: not with --detach; write it with `rayrace report RUN`",
        ),
        (["render", "scene.txt", "-o", "a.pov", "--frames", "2"], "--frames: a.pov is a scene, so nothing is rendered"),
    ],
)
def test_an_option_that_would_be_dropped_is_refused(words, message, stored, rayrace):
    before = sorted(stored.iterdir())
    assert rayrace(*words, cwd=stored, code=2).stderr.startswith(f"error: {message}")
    assert sorted(stored.iterdir()) == before


def test_the_host_of_a_run_may_be_named(stored, rayrace):
    (host,) = store.hosts(stored / "run")
    rayrace("export", "run", "--format", "pyperf", "--host", host, cwd=stored, code=0)


def test_files_that_nobody_named_stay(rayrace, write, tmp_path):
    """render without -o, the first time, and then beside what is there, also a link to nowhere."""
    write("scene.txt", "CAMERA (0,0,0) (1,0,0) (0,1,0) 2\nAMBIENT (1,1,1)\nSPHERE (0,0,-3) 1 (1,1,1) 0 1 (0,0,0) 1 1\n")
    small = ("render", "scene.txt", "-r", "numpy", "--width", 8, "--height", 8)
    first = rayrace(*small, cwd=tmp_path, code=0)
    assert first.stdout.startswith("picture.png: ") and "note" not in first.stderr
    (tmp_path / "picture.png").write_bytes(b"mine")
    (tmp_path / "picture-2.png").symlink_to("nowhere")
    second = rayrace(*small, "--json", cwd=tmp_path, code=0)
    assert json.loads(second.stdout)["picture"] == "picture-3.png" and (tmp_path / "picture-3.png").stat().st_size
    assert "note: picture.png exists and was kept, so this is picture-3.png; -o names a file\n" in second.stderr
    assert (tmp_path / "picture.png").read_bytes() == b"mine" and not (tmp_path / "nowhere").exists()
    rayrace(*small, "-o", "picture.png", cwd=tmp_path, code=0)
    assert (tmp_path / "picture.png").read_bytes() != b"mine"
    failed = rayrace("render", "nowhere.txt", cwd=tmp_path, code=2)
    assert "note" not in failed.stderr and not (tmp_path / "picture-4.png").exists()


def test_lengths_that_float32_cannot_square(rayrace, write, tmp_path):
    """They are refused in float32 and drawn in float64; and rays from anywhere are held to the same."""
    write(
        "scene.txt", "CAMERA (0,0,0) (1,0,0) (0,1,0) 2\nAMBIENT (1,1,1)\nSPHERE (0,0,0) 1e30 (1,1,1) 0 1 (0,0,0) 1 1\n"
    )
    write("rays.csv", "ox,oy,oz,dx,dy,dz\n0,0,0,0,0,1\n")
    write("far.csv", "ox,oy,oz,dx,dy,dz\n0,0,2e30,0,0,1\n")
    for renderer in ("numpy", "python"):
        rayrace("render", "scene.txt", "-r", renderer, "--width", 8, "--height", 8, "-o", "a.npy", cwd=tmp_path, code=0)
        assert np.load(tmp_path / "a.npy") == pytest.approx(1)
    words = "-r", "numpy", "--precision", "float32"
    done = rayrace("render", "scene.txt", *words, cwd=tmp_path, code=2)
    assert "numpy is unsupported: does not support lengths above 1e+09 in float32" in done.stderr
    done = rayrace("trace", "scene.txt", "rays.csv", *words, cwd=tmp_path, code=2)
    assert (
        "there are lengths above 1e+09 in float32, whose squares it cannot hold; use --precision float64" in done.stderr
    )
    done = rayrace("trace", "scene.txt", "far.csv", "-r", "numpy", cwd=tmp_path, code=2)
    assert "far.csv:2: the origin is farther than 1e+30 from (0,0,0)" in done.stderr
