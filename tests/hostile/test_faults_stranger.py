"""A stored run of a stranger is read, and nothing else: no file outside it, no process, no network, no pickle."""

import ast
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from harness.errors import UserError
from harness.store import store

REPOSITORY = Path(__file__).parents[2]
NAMES = {  # where a row names a file
    "picture": ("picture", "file"),
    "series": (None, "series"),
    "reference": ("agreement", "reference_file"),
    "mask": ("agreement", "mask_file"),
    "truth": ("error", "truth_file"),
    "standard error": ("error", "standard_error_file"),
    "flip": ("error", "flip_file"),
    "dropped": ("bound", "dropped_file"),
}
PATHS = (
    *("../secret.npy", "{outside}/secret.npy", "pictures/../../secret.npy", "logs//../../secret.npy", "~/secret.npy"),
    *("run.json", "", ".", "pictures/", "pictures/a/b.npy", "pictures/x.npy\0", "parts/0/pictures/x.npy"),
)

# What the interpreter tells of while a command works (PEP 578), a line each.
WATCHED = """
import os, sys
seen = open(os.environ["SEEN"], "a", buffering=1)
def hook(event, arguments):
    name = event.partition(".")[0]
    if event == "open" and isinstance(arguments[0], (str, bytes)):
        seen.write("open " + os.path.realpath(os.fsdecode(arguments[0])) + chr(10))
    elif name in ("subprocess", "socket", "pickle", "urllib", "ftplib", "http") or event in (
        "os.system", "os.exec", "os.fork", "os.forkpty", "os.posix_spawn", "os.spawn", "os.startfile", "marshal.loads",
    ):
        seen.write(event + " " + repr(arguments)[:300].replace(chr(10), " ") + chr(10))
sys.addaudithook(hook)
from rayrace.main import main
main()
"""


@pytest.fixture(scope="module")
def made(rayrace, tmp_path_factory):
    """A run of two renderers, and its report."""
    folder = tmp_path_factory.mktemp("stranger")
    (folder / "scene.txt").write_text(
        "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\nBACKGROUND (0.2,0.5,0.7)\nLIGHT (4,5,6) (1,1,1) 0\n"
        "SPHERE (0,0,-1) 0.8 (0.7,0.5,0.3) 0.4 20 (0,0,0) 1e6 1\n"
    )
    (folder / "e.toml").write_text(
        'title = "a stranger\'s"\nscenes = ["scene.txt"]\nrenderers = ["python", "numpy"]\nprocesses = 2\n'
        "[image]\nwidth = 8\nheight = 7\ndepth = 1\n"
    )
    rayrace("run", folder / "e.toml", "--out", folder / "run", code=0)
    return folder / "run"


@pytest.fixture
def run(made, tmp_path):
    """A copy of it to be tampered with."""
    return shutil.copytree(made, tmp_path / "run")


def tamper(run, place, value):
    path = run / "repetitions.jsonl"
    table, key = place
    lines = []
    for line in path.read_text().splitlines():
        row = json.loads(line)
        if table and not row.get(table):
            row[table] = {}
        (row[table] if table else row)[key] = value
        lines.append(json.dumps(row))
    path.write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize("name", NAMES)
def test_a_name_of_a_file_stays_in_the_run(name, run, tmp_path):
    np.save(tmp_path / "secret.npy", np.zeros((7, 8, 3)))
    whole = (run / "repetitions.jsonl").read_bytes()
    for path in PATHS:
        (run / "repetitions.jsonl").write_bytes(whole)
        tamper(run, NAMES[name], path.format(outside=tmp_path))
        with pytest.raises(UserError, match=r"repetitions\.jsonl:1: no file of a run"):
            store.read(run)


def test_a_name_that_run_json_says_of_the_cell(run):
    """Its facts of a cell stand for what rows leave out."""
    facts = json.loads((run / "run.json").read_text())
    for cell in facts["cells"]:
        cell["bound"] = {"dropped_file": "/etc/passwd"}
    (run / "run.json").write_text(json.dumps(facts))
    rows = [json.loads(line) for line in (run / "repetitions.jsonl").read_text().splitlines()]
    (run / "repetitions.jsonl").write_text(
        "".join(json.dumps({k: v for k, v in row.items() if k != "bound"}) + "\n" for row in rows)
    )
    with pytest.raises(UserError, match=r"no file of a run: '/etc/passwd'"):
        store.read(run)


@pytest.mark.parametrize("place", ["pictures/x.npy", "series/x.csv", "logs", "report", "report/report.html", "run.json",
                                   "repetitions.jsonl", "parts", "parts/0000-1"])  # fmt: skip
def test_a_link_is_no_part_of_a_run(place, run, tmp_path):
    """Not of what is read, nor where a report would be written through it."""
    path, outside = run / place, tmp_path / "outside"
    (run / "report").mkdir()
    if path.exists():
        path.rename(outside)
    path.parent.mkdir(exist_ok=True)
    path.symlink_to(outside)
    with pytest.raises(UserError, match="not a plain file; a run has no links"):
        store.read(run)


def test_a_pipe_is_not_waited_for(run):
    os.mkfifo(run / "series" / "x.csv")
    with pytest.raises(UserError, match="not a plain file"):
        store.read(run)


def watched(tmp_path, environment, *words):
    """What the interpreter told of during a command: {"open": paths, ..}."""
    log = tmp_path / "seen"
    log.write_text("")
    done = subprocess.run(
        [sys.executable, "-c", WATCHED, *map(str, words)], env={**environment, "SEEN": str(log)},
        capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    found = {}
    for line in log.read_text().splitlines():
        event, _, what = line.partition(" ")
        if event == "subprocess.Popen" and "'fc-list'" in what:  # matplotlib lists the fonts, once on a machine
            continue
        found.setdefault(event, []).append(what)
    return found


COMMANDS = {
    "report": ["report", "RUN", "-o", "OUT"],
    "report --check": ["report", "RUN", "--check", "-o", "REPORT"],
    "compare": ["compare", "RUN", "RUN"],
    **{
        f"export {form}": ["export", "RUN", "--format", form, "-o", "OUT.tar.xz" if form == "packed" else "OUT"]
        for form in ("pyperf", "hyperfine", "github", "parquet", "packed")
    },
}


SLOW = ["report", "report --check", "export hyperfine", "export github", "export parquet"]


@pytest.mark.parametrize(
    "command", [pytest.param(name, marks=[pytest.mark.slow] * (name in SLOW)) for name in COMMANDS]
)
def test_a_run_that_is_looked_at_starts_nothing(command, run, rayrace, tmp_path, environment):
    """No process, no connection, no pickle; and no file but of the run, of what is written, and of the software."""
    out = tmp_path / "out"
    if "--check" in command:
        rayrace("report", run, "-o", tmp_path / "report", code=0)
    places = {"RUN": run, "OUT": out, "OUT.tar.xz": tmp_path / "out.tar.xz", "REPORT": tmp_path / "report"}
    found = watched(tmp_path, environment, *(places.get(word, word) for word in COMMANDS[command]))
    opened = found.pop("open")
    found.pop("marshal.loads", None)  # the interpreter's own modules
    assert found == {}, {event: what[:3] for event, what in found.items()}
    ours = [
        *map(str, places.values()),
        environment["TMPDIR"],
        str(tmp_path / "seen"),
        str(REPOSITORY),
        sys.prefix,
        sys.base_prefix,
    ]
    ours += ["/usr/", "/lib", "/etc/", "/proc/", "/sys/", "/dev/", "/var/cache/fontconfig", str(Path.home() / ".")]
    inside = os.path.realpath(tmp_path)  # the folder itself is opened, to put into it what is written
    places = tuple(os.path.realpath(place) for place in ours)
    strange = [path for path in opened if path != inside and not path.startswith(places)]
    assert strange == []
    print(f"{command}: {len(opened)} files opened, none outside; processes 0, connections 0, pickles 0")


UNSAFE_MODULES = {"pickle", "cPickle", "_pickle", "cloudpickle", "dill", "joblib", "shelve", "marshal", "yaml"}
UNSAFE_CALLS = {"eval", "exec", "read_pickle", "os.system", "os.popen"}
LOADS = {"np.load", "np.lib.format.read_array"}


def test_nothing_that_is_read_can_run():
    """By the sources of the harness and of the reports: no pickles, no evaluation of text; loads of arrays say so."""
    loads = 0
    for path in sorted([*(REPOSITORY / "harness").rglob("*.py"), *(REPOSITORY / "reports").rglob("*.py")]):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            where = f"{path.relative_to(REPOSITORY)}:{getattr(node, 'lineno', 0)}"
            if isinstance(node, ast.Import | ast.ImportFrom):
                names = [getattr(node, "module", None) or "", *(alias.name for alias in node.names)]
                assert not UNSAFE_MODULES & {name.partition(".")[0] for name in names}, where
            if isinstance(node, ast.Call):
                called = ast.unparse(node.func)
                assert called not in UNSAFE_CALLS and not called.endswith(".read_pickle"), where
                told = {word.arg: getattr(word.value, "value", None) for word in node.keywords}
                assert told.get("allow_pickle") is not True and told.get("shell") is not True, where
                if called in LOADS:
                    assert told.get("allow_pickle") is False, f"{where}: say allow_pickle=False"
                    loads += 1
    assert loads >= 1


def test_an_array_of_objects_is_not_loaded(run):
    """Its pickle would run a command of the stranger's."""

    class Evil:
        def __reduce__(self):
            return os.mkdir, (str(run / "evil"),)

    from reports.run import results, stored

    (record,) = store.read(run)[1][:1]
    np.save(run / record["picture"]["file"], np.array([Evil()], dtype=object), allow_pickle=True)
    found = stored.array(results.load(run), record["picture"]["file"])
    assert isinstance(found, stored.Missing) and not (run / "evil").exists()


def test_a_renderer_runs_only_where_it_is_named(rayrace, tmp_path):
    """Not one that lies in the current folder, nor in that of an experiment or of a run."""
    evil = """contract = 1\nname = "evil"\ntechnology = "t"\ndescription = "d"\nfeatures = []\n[build]\n
compiler = "c"\ncommand = ["touch", "{folder}/built"]\n[[variant]]\nname = "evil"\ncommand = ["touch", "{folder}/ran"]
changes = "c"\nthreads = 1\ndevice = "cpu"\n"""
    for place in ("renderers/evil", "evil", "."):
        (tmp_path / place).mkdir(parents=True, exist_ok=True)
        (tmp_path / place / "renderer.toml").write_text(evil)
    (tmp_path / "scene.txt").write_text("CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\n")
    (tmp_path / "e.toml").write_text('title = "t"\nscenes = ["scene.txt"]\nrenderers = ["evil"]\n')
    assert "evil" not in rayrace("list", cwd=tmp_path, code=0).stdout
    assert 'no renderer "evil"' in rayrace("run", "e.toml", "--out", "run", cwd=tmp_path, code=2).stderr
    named = rayrace("list", "--renderer", tmp_path / "evil", cwd=tmp_path, code=0).stdout
    assert "evil" in named and not list(tmp_path.rglob("built")) and not list(tmp_path.rglob("ran"))
