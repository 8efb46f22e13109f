"""Files are written by one function, which follows no link: neither of a stranger's report, nor of a stranger's run."""

import ast
import json
import os
import shutil
from pathlib import Path

import pytest
import stored_run

from harness.errors import UserError
from harness.store import confined, store
from harness.system import output
from reports.page import index, several

ROOT = Path(__file__).parents[2]
# Modules that write otherwise, and why that leads nowhere.
OTHERWISE = {
    "harness/system/output.py": "the one function",
    "harness/system/lock.py": "a lock's file, which is never written; it follows no link",
    "harness/system/machine_lock.py": "the number of the process and the user in /tmp, where it follows no link",
    "harness/system/ownership.py": "the mark of a folder that it has just made; it opens with O_EXCL",
    "harness/renderer/job.py": "a job, in a temporary folder",
    "harness/renderer/builder.py": "a build, in a new folder of the cache",
    "harness/process/process.py": "what the launcher reads, in a temporary folder",
    "harness/process/launcher.py": "the output of a renderer, in a temporary folder",
    "harness/process/measurer.py": "a series, whose place the bench has cleared",
    "harness/process/scratch.py": "moves, in a temporary folder",
    "harness/process/session.py": "a pipe, in a temporary folder",
    "harness/process/dialog.py": "two pipes, in a new folder within a temporary one",
    "harness/contract/check_scenes.py": "a mesh, in a temporary folder",
    "harness/store/packed.py": "what a packed run holds, in a temporary folder",
    "reports/paper/vector.py": "a drawing, in memory",
    "rayrace/main.py": "/dev/null",
    "rayrace/progress.py": "/dev/null",
}
NAMES = {
    *("write_text", "write_bytes", "savefig", "to_csv", "to_parquet", "touch", "symlink_to", "hardlink_to", "copyfile"),
    *("copy2", "copytree", "mkfifo", "savez", "savez_compressed", "tofile", "extractall", "print_svg"),
}
MOVES = "os.rename", "os.replace", "shutil.move"
OPENED = "file", "npy"  # names of what is open already


def writers(path):
    """Lines of a module that open a file to write it, or write or move one by its name."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if not isinstance(node, ast.Call):
            continue
        called = ast.unparse(node.func)
        name, first = called.rpartition(".")[2], ast.unparse(node.args[0]) if node.args else ""
        words = [*map(ast.unparse, node.args), *(ast.unparse(word.value) for word in node.keywords)]
        if called == "os.open":
            bad = any(flag in ast.unparse(node) for flag in ("O_WRONLY", "O_RDWR", "O_CREAT"))
        elif name in ("open", "fdopen"):
            modes = [word.strip("'") for word in words if word.startswith("'")]
            bad = any(set(mode) & set("wax+") and len(mode) <= 3 for mode in modes) and not first.startswith("output.")
        elif called in ("np.save", "numpy.save") or (name == "save" and "Image" in called):
            bad = first not in OPENED
        elif called in ("os.rename", "os.replace", "shutil.move") or (
            name in ("rename", "replace") and len(words) == 1
        ):
            bad = "columns" not in ast.unparse(node) and called not in ("replace", "dataclasses.replace")
        else:
            bad = name in NAMES and first not in OPENED and not (name == "to_csv" and not node.args)
        if bad:
            yield node.lineno, ast.unparse(node)[:100]


def test_one_function_writes():
    found = {}
    for top in ("harness", "reports", "rayrace"):
        for path in sorted((ROOT / top).rglob("*.py")):
            if lines := list(writers(path)):
                found[path.relative_to(ROOT).as_posix()] = lines
    assert {path: lines for path, lines in found.items() if path not in OTHERWISE} == {}
    assert sorted(OTHERWISE.keys() - found.keys()) == []


@pytest.mark.parametrize(
    "text",
    [
        "path.write_text('x')", "open(path, 'w')", "open(path, mode='a')", "os.open(path, os.O_CREAT)",
        "np.save(path, a)",
        "figure.savefig(path)", "frame.to_csv(path)", "shutil.copyfile(a, b)", "path.rename(b)", "path.open('wb')",
    ],
)  # fmt: skip
def test_the_walk_finds_a_writer(text, tmp_path):
    (tmp_path / "a.py").write_text(text)
    assert list(writers(tmp_path / "a.py"))


@pytest.fixture
def mine(tmp_path):
    """Files of the user, and a check that they are as they were, and no others."""
    home = tmp_path / "home"
    home.mkdir()
    (home / "precious").write_text("mine")
    (home / "folder").mkdir()
    (home / "folder" / "report.md").write_text("mine too")

    def unchanged():
        found = {path.relative_to(home).as_posix(): path for path in home.rglob("*")}
        assert sorted(found) == ["folder", "folder/report.md", "precious"]
        assert (home / "precious").read_text() == "mine" and found["folder/report.md"].read_text() == "mine too"

    return home, unchanged


@pytest.fixture
def run(tmp_path):
    stored_run.write(tmp_path / "runs" / "run", stored_run.facts(), stored_run.rows())
    return tmp_path / "runs" / "run"


KINDS = {
    "a link to a file": lambda path, home: path.symlink_to(home / "precious"),
    "a link to a folder": lambda path, home: path.symlink_to(home / "folder"),
    "a link to what is not there": lambda path, home: path.symlink_to(home / "new"),
    "a pipe": lambda path, home: os.mkfifo(path),
}
NAMES_OF_A_REPORT = (
    *("report.md", "report.html", "repetitions.csv", "times.csv", "times.png", "times.json", "times.svg.part"),
    *(several.MARK, ".rayrace-card", "index.html", ".rayrace-fresh", "run", "run/report.md", "run/report.html"),
    *("run/.rayrace-report", "run/.rayrace-fresh", "run/host/report.md", "run/host/times.pdf"),
)


@pytest.mark.parametrize("kind", KINDS)
def test_links_in_a_report(kind, run, mine):
    """At every place that a report writes, two and three folders down; of one run, and of a folder of runs."""
    home, unchanged = mine
    for name in NAMES_OF_A_REPORT:
        for folder, make in (
            (run / "report", lambda out: several.make([run], out)),
            (run.parent / "report", lambda out: index.make(run.parent, out)),
        ):
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            (folder / several.MARK).write_text("a report")
            path.unlink(missing_ok=True)
            KINDS[kind](path, home)
            before = sorted(folder.rglob("*"))
            with pytest.raises(UserError, match=r"not a plain file|a link|do not belong"):
                make(folder)
            assert sorted(folder.rglob("*")) == before, "something was written"
            unchanged()
            shutil.rmtree(folder)


def test_the_folder_of_a_report_is_a_link(run, mine):
    home, unchanged = mine
    (home / "folder" / "report.md").rename(home / "aside")
    for target in ("folder", "new"):
        (run / "report").symlink_to(home / target)
        with pytest.raises(UserError, match="a link"):
            several.make([run], run / "report")
        (run / "report").unlink()
        (run.parent / "report").symlink_to(home / target)
        with pytest.raises(UserError, match="a link"):
            index.make(run.parent, run.parent / "report")
        (run.parent / "report").unlink()
    (home / "aside").rename(home / "folder" / "report.md")
    unchanged()


def test_nothing_is_written_before_the_whole_run_was_checked(run):
    good = (run / "repetitions.jsonl").read_bytes()
    for bad in (b"{}\n", b'{"wall_s": "x"}\n'):
        (run / "repetitions.jsonl").write_bytes(good + bad)
        with pytest.raises(UserError):
            several.make([run], run / "report")
        assert not (run / "report").exists()


@pytest.mark.slow
def test_second_names_in_a_report(run, mine):
    """A file with two names is replaced under the one alone."""
    home, unchanged = mine
    stored_run.write_series(run, stored_run.rows())
    several.make([run], run / "report")
    names = [path.relative_to(run / "report") for path in (run / "report").rglob("*") if path.is_file()]
    shutil.rmtree(run / "report")
    for name in [*names, "times.png.part"]:
        path = run / "report" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        os.link(home / "precious", path)
    (run / "report" / several.MARK).unlink()
    (run / "report" / several.MARK).write_text("a report")
    several.make([run], run / "report")
    unchanged()
    assert len(names) > 10 and (run / "report" / "report.md").read_text() != "mine"


@pytest.fixture(scope="module")
def interrupted(rayrace, tmp_path_factory):
    """An experiment, and a run of it that lacks its last row."""
    place = tmp_path_factory.mktemp("interrupted")
    (place / "scene.txt").write_text("CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\nBACKGROUND (0.2,0.5,0.7)\n")
    (place / "e.toml").write_text(
        'title = "t"\nscenes = ["scene.txt"]\nrenderers = ["python"]\nprocesses = 2\n[image]\nwidth = 4\nheight = 3\n'
    )
    rayrace("run", place / "e.toml", "--out", place / "run", code=0)
    rows = (place / "run" / "repetitions.jsonl").read_bytes().splitlines(keepends=True)
    (place / "run" / "repetitions.jsonl").write_bytes(rows[0])
    return place, json.loads(rows[1])


def places_of(run, row):
    """What a resumed run writes."""
    names = "run.json", "run.json.part", "repetitions.jsonl", ".lock", "pictures", "series", "logs"
    return [*(run / name for name in names), run / row["series"], run / f"logs/{row['cell']}-1.stdout"]


@pytest.mark.parametrize("kind", [*KINDS, "a second name"])
def test_a_run_that_is_gone_on_with(kind, interrupted, rayrace, tmp_path, mine):
    """A link, or a second name of a file, at every place that it writes."""
    home, unchanged = mine
    place, row = interrupted
    for number in range(len(places_of(tmp_path, row))):
        run = shutil.copytree(place / "run", tmp_path / f"run-{number}")
        path = places_of(run, row)[number]
        whole = path.read_bytes() if path.is_file() else None
        shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
        if kind == "a second name":
            if path.name in ("pictures", "series", "logs"):
                continue
            if whole is not None:
                (home / "precious").write_bytes(whole)
            os.link(home / "precious", path)
        else:
            KINDS[kind](path, home)
        before = (home / "precious").read_bytes()
        done = rayrace("run", place / "e.toml", "--resume", run)
        inside = path.parent.name in ("series", "logs") or path.name == "run.json.part"
        if kind == "a second name" and inside:  # it is replaced
            assert done.returncode in (0, 2), done.stderr
        else:
            assert done.returncode == 2 and ("not a plain file" in done.stderr or "second name" in done.stderr), done
        assert (home / "precious").read_bytes() == before
        (home / "precious").write_text("mine")
        unchanged()


def test_a_run_that_was_cut_off_before_it_described_itself(tmp_path, mine, interrupted, rayrace):
    home, unchanged = mine
    place, _ = interrupted
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "run.json.part").symlink_to(home / "precious")
    done = rayrace("run", place / "e.toml", "--resume", tmp_path / "run", code=2)
    assert "run.json.part: not a plain file" in done.stderr
    unchanged()


def test_a_run_of_a_linked_folder(tmp_path):
    """The user named it: it may be a link."""
    (tmp_path / "real").mkdir()
    (tmp_path / "run").symlink_to(tmp_path / "real")
    run = store.Run(tmp_path / "run")
    run.describe(title="t")
    run.append({"repetition": 0})
    run.close()
    assert store.read(tmp_path / "run")[0]["title"] == "t"
    confined.check_to_write(tmp_path / "run")


OUT = {
    "picture.png": ["render", "s.txt", "-r", "python", "--width", "3", "--height", "2", "-o"],
    "picture.npy": ["render", "s.txt", "-r", "python", "--width", "3", "--height", "2", "-o"],
    "scene.txt": ["generate", "comparison", "-o"],
    "hits.csv": ["trace", "s.txt", "rays.csv", "-r", "python", "-o"],
    "run.json": ["export", "RUN", "--format", "github", "-o"],
}


@pytest.mark.parametrize("name", OUT)
def test_a_link_that_is_named(name, tmp_path, mine, rayrace, run):
    """With -o: it is refused, and what it leads to stays."""
    home, unchanged = mine
    (tmp_path / "s.txt").write_text("CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\n")
    (tmp_path / "rays.csv").write_text("ox,oy,oz,dx,dy,dz\n0,0,9,0,0,-1\n")
    (tmp_path / name).symlink_to(home / "precious")
    words = [str(run) if word == "RUN" else word for word in OUT[name]]
    assert "a link; nothing is written through it" in rayrace(*words, name, cwd=tmp_path, code=2).stderr
    unchanged()
    (tmp_path / name).unlink()
    rayrace(*words, name, cwd=tmp_path, code=0)
    assert (tmp_path / name).stat().st_size


def test_the_function(tmp_path):
    """A file is there whole or not at all, and nothing is left beside it."""

    def fail(file):
        file.write(b"half")
        raise OSError(28, "No space left on device")

    path = tmp_path / "a"
    output.data(path, b"old")
    for how in ({}, {"own": False}, {"shared": True}):
        with pytest.raises(OSError, match="No space left") as raised:
            output.write(path, fail, **how)
        assert raised.value.filename == str(path)
        assert path.read_bytes() == b"old" and [one.name for one in tmp_path.iterdir()] == ["a"]
        output.write(path, lambda file: file.write(b"new"), **how)
        assert path.read_bytes() == b"new" and [one.name for one in tmp_path.iterdir()] == ["a"]
        output.data(path, b"old")
    (tmp_path / "folder").mkdir()
    with pytest.raises(IsADirectoryError):
        output.data(tmp_path / "folder", b"")
    with pytest.raises(UserError, match="not a plain file"):
        output.data(Path("/dev/null"), b"", own=False)
