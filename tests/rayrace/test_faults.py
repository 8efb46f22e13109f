"""Wrong use through the real command line: one clear message, exit code 2, no traceback (the fixture looks for it)."""

import pytest

from harness.errors import UserError
from harness.experiment import experiment
from harness.plan import plan

SCENE = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\n"
GOOD = 'title = "t"\nscenes = ["scene.txt"]\nrenderers = ["python"]\n'
RAYS = "ox,oy,oz,dx,dy,dz\n"

# name: the words of the command, and what the message must hold
EXPERIMENTS = {
    "unknown key": (GOOD + "procesess = 2\n", 'experiment.toml:4: procesess: unknown key; did you mean "processes"?'),
    "unknown key below": (GOOD + "[image]\nwidht = 2\n", 'image.widht: unknown key; did you mean "width"?'),
    "unknown key in override": (
        GOOD + "[override.python]\nframe = 2\n",
        'override.python.frame: unknown key; did you mean "fr',
    ),
    "unknown key far": (GOOD + "zzz = 2\n", "zzz: unknown key; known keys: title, scenes"),
    "missing key": ('title = "t"\nscenes = ["scene.txt"]\n', "renderers: Field required"),
    "wrong type": (GOOD + '[image]\nwidth = "wide"\n', "image.width: Input should be a valid integer"),
    "number as text": (GOOD + 'processes = "3"\n', "processes: Input should be a valid integer"),
    "truth as number": (GOOD + "frames = true\n", "frames: Input should be a valid integer"),
    "number as truth": (GOOD + "[image]\nshadows = 1\n", "image.shadows: Input should be a valid boolean"),
    "bad duration": (GOOD + 'timeout = "ten minutes"\n', 'timeout: expected a time such as "50 ms", "30 s", "10 min"'),
    "bad unit": (GOOD + 'timeout = "3 days"\n', 'timeout: expected a time such as "50 ms"'),
    "no duration": (GOOD + 'timeout = "0 s"\n', "timeout: Input should be greater than 0"),
    "unknown renderer": (GOOD.replace("python", "pyhton"), 'no renderer "pyhton"; did you mean "python"?'),
    "renderer twice": (GOOD.replace('"python"', '"python", "python"'), "each may be named once"),
    "no renderer": (GOOD.replace('"python"', ""), "renderers: List should have at least 1 item"),
    "unknown scene suffix": (GOOD.replace("scene.txt", "scene.xyz"), 'scene.xyz: unknown kind of scene file ".xyz"'),
    "missing scene": (GOOD.replace("scene.txt", "nowhere.txt"), "nowhere.txt: no such file"),
    "faulty scene": (
        GOOD.replace("scene.txt", "faulty.txt"),
        'faulty.txt:2:1: unknown keyword "SHPERE"; did you mean SPHERE?',
    ),
    "sweep unknown": (GOOD + "[sweep]\ndeph = [1, 2]\n", 'sweep.deph: no such parameter; did you mean "depth"?'),
    "sweep empty": (GOOD + "[sweep]\ndepth = []\n", "sweep.depth: expected at least one value"),
    "sweep out of range": (
        GOOD + "[sweep]\ndepth = [1, -1]\n",
        "experiment.toml:5: sweep.depth: -1: Input should be greater than or equal to 0",
    ),
    "sweep of other type": (
        GOOD + '[sweep]\ndepth = ["deep"]\n',
        "experiment.toml:5: sweep.depth: 'deep': Input should be a valid integer",
    ),
    "sweep no list": (GOOD + "[sweep]\ndepth = 3\n", "sweep.depth: Input should be a valid list"),
    "sweep of two lengths": (GOOD + "[[sweep]]\ndepth = [1, 2]\nwidth = [4]\n", "zipped, so of one length"),
    "sweep in two tables": (GOOD + "[[sweep]]\ndepth = [1]\n[[sweep]]\ndepth = [2]\n", "sweep: depth is in two tables"),
    "cell twice": (
        GOOD + "[sweep]\ndepth = [1, 1]\n",
        '"python, scene, depth 1" and "python, scene, depth 1" are the same',
    ),
    "region outside": (
        GOOD + "[image]\nwidth = 8\nheight = 8\nregion = [0, 0, 9, 8]\n",
        "region [0, 0, 9, 8]: expected x0 < x1 <= width",
    ),
    "region empty": (GOOD + "[image]\nregion = [4, 4, 4, 5]\n", "region [4, 4, 4, 5]: expected x0 < x1"),
    "region short": (GOOD + "[image]\nregion = [4, 4, 4]\n", "image.region"),
    "region swept outside": (
        GOOD + "[image]\nwidth = 8\n[sweep]\nregion = [[0, 0, 9, 1]]\n",
        "region [0, 0, 9, 1]: expected x0 < x1",
    ),
    "block too large": (
        GOOD + "[image]\nblock_width = 64\nblock_height = 32\n",
        "image: block_width x block_height: 64 x 32 is 2048 threads, expected 1024 at most",
    ),
    "block swept too large": (
        GOOD + "[image]\nblock_height = 64\n[sweep]\nblock_width = [16, 32]\n",
        "sweep {'block_width': 32}: block_width x block_height: 32 x 64 is 2048 threads",
    ),
    "block side too large": (GOOD + "[image]\nblock_width = 1025\n", "image.block_width: Input should be less than or"),
    "block empty": (GOOD + "[image]\nblock_height = 0\n", "image.block_height: Input should be greater than or"),
    "registers": (GOOD + "[image]\nmax_registers = 256\n", "image.max_registers: Input should be less than or"),
    "memory unknown": (GOOD + '[image]\nscene_memory = "local"\n', "image.scene_memory: Input should be 'auto', "),
    "sample outside": (GOOD + "[image]\nsample_x = 1.0\n", "image.sample_x: Input should be less than 1"),
    "not a number": (GOOD + "[image]\nsample_x = nan\n", "image.sample_x: Input should be"),
    "override of nobody": (GOOD + "[override.cpp]\nframes = 1\n", "override.cpp: not among the experiment's renderers"),
    "no toml": ("title = \n", "experiment.toml: Invalid value (at line 1, column 9)"),
}


@pytest.fixture
def place(write, tmp_path):
    write("scene.txt", SCENE)
    write("scene.xyz", SCENE)
    write("faulty.txt", SCENE + "SHPERE (0,0,0) 1\n")
    write("good.toml", GOOD)
    return tmp_path


def assert_wrong_use(done, message):
    assert done.returncode == 2, done.stdout + done.stderr
    assert done.stderr.startswith("error: ") and message in done.stderr, done.stderr
    assert done.stdout == ""


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_experiment_by_functions(name, place, write, known):
    text, message = EXPERIMENTS[name]
    file = write("experiment.toml", text)
    with pytest.raises(UserError) as fault:
        plan.make(experiment.load(file), file, known)
    assert message in str(fault.value)
    assert "\n" not in str(fault.value)


@pytest.mark.parametrize(
    "name", ["unknown key", "bad duration", "unknown renderer", "faulty scene", "sweep out of range"]
)
def test_experiment(name, rayrace, place, write):
    text, message = EXPERIMENTS[name]
    file = write("experiment.toml", text)
    assert_wrong_use(rayrace("run", file, "--out", place / "run"), message)
    assert not (place / "run").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["run", "nowhere.toml"], "nowhere.toml: no such file, and no bundled experiment of that name"),
        (["run", "."], ".: expected a file, found a folder"),
        (["run", "good.toml", "--set", "depth"], "--set depth: expected key=value, such as image.depth=5"),
        (["run", "good.toml", "--set", "image.deph=5"], 'image.deph: unknown key; did you mean "depth"?'),
        (["run", "good.toml", "--set", "image.depth=deep"], "image.depth: Input should be a valid integer"),
        (["run", "good.toml", "--set", "title.x=1"], "--set title.x=1: title is not a table"),
        (["run", "good.toml", "--set", "=1"], "--set =1: expected key=value"),
        (
            ["run", "good.toml", "--only", "xyz"],
            "--only xyz: no such renderer; the experiment lists python; `rayrace list`",
        ),
        (["run", "good.toml", "--out", "."], ".: exists already; give --out another folder"),
        (["run", "good.toml", "--out", "scene.txt/run"], "scene.txt/run: Not a directory"),
        (
            ["run", "good.toml", "--renderer", "nowhere"],
            "nowhere/renderer.toml: no such file; a renderer is a folder with",
        ),
        (["render", "nowhere.txt"], "nowhere.txt: no such file"),
        (["render", "faulty.txt"], "faulty.txt:2:1: unknown keyword"),
        (["render", "scene.xyz"], 'unknown kind of scene file ".xyz"; supported: .txt'),
        (["render", "."], "expected a file, found a folder"),
        (["render", "scene.txt", "-o", "a.jpg"], 'a.jpg: unknown kind of picture ".jpg"; known: .png, .exr, .npy'),
        (["render", "scene.txt", "-o", "no/a.png"], "no: no such folder"),
        (["render", "scene.txt", "--region", "1,2,3"], "--region 1,2,3: expected four whole numbers x0,y0,x1,y1"),
        (["render", "scene.txt", "--region", "0,0,513,1"], "--region 0,0,513,1: expected 0 <= x0 < x1 <= 512"),
        (["render", "scene.txt", "-r", "pyton"], 'no renderer "pyton"; did you mean "python"?'),
        (["render", "scene.txt", "--precision", "float16"], "no renderer can do this job: "),
        (
            ["render", "scene.txt", "-r", "python", "--precision", "float16"],
            "python is unsupported: has no precision float16",
        ),
        (
            ["render", "scene.txt", "--block-width", "64", "--block-height", "32"],
            "error: block_width x block_height: 64 x 32 is 2048 threads, expected 1024 at most",
        ),
        (["render", "scene.txt", "--scene-memory", "local"], "--scene-memory local: Input should be 'auto', "),
        (
            ["render", "scene.txt", "-r", "python", "--scene-memory", "shared"],
            "python is unsupported: has no scene_memory shared (has auto)",
        ),
        (
            ["trace", "scene.txt", "good.csv", "-r", "python", "--scene-memory", "shared"],
            "python is unsupported: has no scene_memory shared (has auto)",
        ),
        (["render", "scene.txt", "-r", "python", "--threads", "2"], "python is unsupported: runs one thread"),
        (["trace", "scene.txt", "nowhere.csv"], "nowhere.csv: no such file"),
        (["trace", "scene.txt", "good.csv", "-o", "no/hits.csv"], "no: no such folder"),
        (["trace", "scene.txt", "empty.csv"], "empty.csv:1: expected the header ox,oy,oz,dx,dy,dz"),
        (["trace", "scene.txt", "nan.csv"], 'nan.csv:3: dy: expected a finite number, found "NaN"'),
        (["report", "."], ".: neither a run nor a folder of runs"),
        (["generate", "comparision"], 'no generator "comparision"; known: comparison'),
        (["generate", "comparison", "-o", "no/scene.txt"], "no/scene.txt: No such file or directory"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_words(words, message, rayrace, place, write):
    write("good.csv", RAYS + "0,0,0,0,0,1\n")
    write("empty.csv", "")
    write("nan.csv", RAYS + "0,0,0,0,0,1\n0,0,0,0,NaN,1\n")
    assert_wrong_use(rayrace(*words, cwd=place), message)


@pytest.mark.parametrize("words", [["run"], ["no-such-command"], ["render", "a.txt", "--width", "0"], ["list", "--x"]])
def test_words_that_typer_refuses(words, rayrace):
    done = rayrace(*words, code=2)
    assert "Usage: " in done.stderr


def test_faulty_renderer_on_the_search_path(rayrace, write, tmp_path):
    write("renderer.toml", "contract = 3\n")
    done = rayrace("list", env={"RAYRACE_RENDERERS": str(tmp_path)})
    assert_wrong_use(done, "renderer.toml:1: contract: Input should be 1")
    assert "name: Field required" in done.stderr


def test_a_renderer_that_fails_is_exit_1(rayrace, place, bad_folder):
    folder = bad_folder("bad-exit-stderr", name="failing")
    done = rayrace("render", "scene.txt", "-r", "bad-exit-stderr", "--renderer", folder, cwd=place, code=1)
    assert done.stderr.startswith("error: bad-exit-stderr: failed: exit 2: It broke here\n")
