"""Builds, with a shell script for a compiler: it notes each call in a file beside it."""

import json
import os
import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from harness.errors import UserError
from harness.renderer import builder, manifest, registry
from harness.renderer.registry import Renderer

MANIFEST = """contract = 1
name = "built"
technology = "sh"
description = "for the tests"
features = []
[build]
compiler = "c"
command = ["{{compiler}}", "{flag}", "{{folder}}/main.c", "{{build}}/render"]
[[variant]]
name = "built"
command = ["{{build}}/render"]
"""
COMPILER = """#!/bin/sh
if [ "$1" = --version ]; then echo "{version}"; exit; fi
echo "$@" >> {calls}
cp "$2" "$3"
"""


@pytest.fixture
def bench(tmp_path, monkeypatch):
    return Bench(tmp_path, monkeypatch)


class Bench:
    def __init__(self, folder, monkeypatch):
        self.folder, self.calls = folder / "built", folder / "calls"
        self.folder.mkdir()
        self.cc = folder / "mycc"
        monkeypatch.setenv("RAYRACE_CACHE", str(folder / "cache"))
        monkeypatch.setenv("CC", str(self.cc))
        self.compiler()
        self.source("first")
        self.flag("-O1")

    def compiler(self, text=COMPILER, version="mycc 1.0"):
        self.cc.write_text(text.format(version=version, calls=self.calls))
        self.cc.chmod(0o755)
        builder.compiler_version.cache_clear()

    def source(self, text, name="main.c"):
        (self.folder / name).write_text(text)

    def flag(self, flag):
        (self.folder / "renderer.toml").write_text(MANIFEST.format(flag=flag))

    def build(self):
        return Renderer(self.folder, manifest.load(self.folder)).build()

    def count(self):
        return len(self.calls.read_text().splitlines()) if self.calls.exists() else 0


def test_second_time_from_the_cache(bench):
    first, second = bench.build(), bench.build()
    assert (first.cached, second.cached, bench.count()) == (False, True, 1)
    assert first.folder == second.folder and first.seconds == second.seconds > 0
    assert (second.folder / "render").read_text() == "first"
    assert second.compiler == "mycc 1.0" and second.command == first.command == (
        "{compiler}",
        "-O1",
        "{folder}/main.c",
        "{build}/render",
    )


@pytest.mark.parametrize(
    "change",
    [
        lambda bench: bench.source("second"),
        lambda bench: bench.source("", "more.h"),
        lambda bench: bench.flag("-O2"),
        lambda bench: bench.compiler(version="mycc 1.1"),
        lambda bench: bench.compiler(version="mycc 1.0 ") or bench.source("third"),
    ],
)
def test_built_again_when_something_changes(bench, change):
    before = bench.build().folder
    change(bench)
    after = bench.build()
    assert not after.cached and after.folder != before and bench.count() == 2


def test_built_again_on_another_processor(bench, monkeypatch):
    bench.build()
    monkeypatch.setattr(builder, "processor", lambda: "another")
    assert not bench.build().cached


@pytest.mark.parametrize("name", ["NOTES.md", "README.md", ".git/index", "__pycache__/x.pyc", "x.pyc", ".hidden"])
def test_not_built_again_for_what_is_no_source(bench, name):
    bench.build()
    (bench.folder / name).parent.mkdir(exist_ok=True)
    bench.source("changed", name)
    assert bench.build().cached


def test_a_folder_of_any_name_has_sources(bench, tmp_path):
    odd = tmp_path / "__pycache__" / "README.md"
    shutil.copytree(bench.folder, odd)
    assert Renderer(odd, manifest.load(odd)).sources() == ["main.c", "renderer.toml"]


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (
            "echo 'main.c:3:1: error: expected ;' >&2; echo '1 error generated.' >&2; exit 1",
            r"exit 1: main.c:3:1: error: expected ;",
        ),
        ("echo 'no input' >&2; exit 4", "exit 4: no input"),
        ("exit 5", "exit 5: no message"),
        ("printf '\\377 error\\n' >&2; exit 1", "exit 1: \ufffd error"),
        ("kill -9 $$", "exit -9: no message"),
    ],
)
def test_failure(bench, body, message):
    bench.compiler('#!/bin/sh\n[ "$1" = --version ] && exit\n' + body + "\n")
    with pytest.raises(builder.BuildError) as fault:
        bench.build()
    assert str(fault.value).endswith(message) and str(fault.value).startswith(f"{bench.cc} -O1 ")
    left = [path.name for path in (Path(os.environ["RAYRACE_CACHE"]) / "builds").iterdir() if path.is_dir()]
    assert left == []
    bench.compiler()
    assert not bench.build().cached


def test_a_build_that_never_ends(bench, monkeypatch):
    bench.compiler('#!/bin/sh\n[ "$1" = --version ] && exit\nexec sleep 60\n')
    monkeypatch.setattr(builder, "TIMEOUT", 0.2)
    with pytest.raises(builder.BuildError, match="the build did not end within"):
        bench.build()


def test_two_at_once_build_once(bench):
    slow = COMPILER.replace("cp ", "sleep 0.5; cp ")
    bench.compiler(slow)
    builder.compiler_version(str(bench.cc))
    with ThreadPoolExecutor() as pool:
        built = list(pool.map(lambda _: bench.build(), range(3)))
    assert bench.count() == 1 and sorted(one.cached for one in built) == [False, True, True]


def test_compilers(tmp_path, monkeypatch):
    for name in ("g++", "clang++", "own"):
        (tmp_path / name).write_text("#!/bin/sh\n")
        (tmp_path / name).chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CXX", raising=False)
    assert builder.find_compiler("c++") == str(tmp_path / "g++")
    assert builder.find_compiler("c") is None
    for chosen, found in (
        ("own", tmp_path / "own"),
        (str(tmp_path / "clang++"), tmp_path / "clang++"),
        ("", tmp_path / "g++"),
    ):
        monkeypatch.setenv("CXX", chosen)
        assert builder.find_compiler("c++") == str(found)
    monkeypatch.setenv("CXX", "no-such")
    assert builder.find_compiler("c++") is None


def test_a_compiler_of_several_words(bench, monkeypatch):
    """As CC="ccache gcc": its version and its builds are of all words, also where a folder has a blank."""
    program = bench.folder.parent / "a folder" / "launcher"
    program.parent.mkdir()
    program.write_text('#!/bin/sh\nexec "$@"\n')
    program.chmod(0o755)
    monkeypatch.setenv("CC", f"'{program}' {bench.cc}")
    built = bench.build()
    assert (bench.count(), built.compiler, built.cached) == (1, "mycc 1.0", False)
    assert builder.compiler("c") == (str(program), str(bench.cc))
    monkeypatch.setenv("CC", str(program))  # a path with a blank, which is no two words
    assert builder.compiler("c") == (str(program),)


@pytest.mark.parametrize("chosen", ["no-such", "no-such gcc", "'no-such"])
def test_a_compiler_that_is_not_there(chosen, bench, monkeypatch):
    monkeypatch.setenv("CC", chosen)
    why = f"CC is {chosen!r}, and there is no such program (correct CC, or unset it)"
    renderer = Renderer(bench.folder, manifest.load(bench.folder))
    assert builder.compiler("c") == () and renderer.unavailable == why
    with pytest.raises(builder.BuildError) as caught:
        bench.build()
    assert str(caught.value) == why


def test_no_folder_for_the_cache(monkeypatch):
    """Neither HOME nor an entry of the user, as in a container that runs as any number."""
    for name in ("RAYRACE_CACHE", "XDG_CACHE_HOME", "HOME"):
        monkeypatch.delenv(name, raising=False)

    def unknown(user):
        raise KeyError(f"getpwuid(): uid not found: {user}")

    monkeypatch.setattr("pwd.getpwuid", unknown)
    with pytest.raises(UserError, match=r"HOME is not set, .*; set RAYRACE_CACHE to a folder"):
        builder.cache_folder("builds")
    monkeypatch.setenv("RAYRACE_CACHE", "/a/folder")
    assert str(builder.cache_folder("builds")) == "/a/folder/builds"


def test_without_a_compiler(bench, monkeypatch):
    monkeypatch.setenv("CC", "")
    monkeypatch.setenv("PATH", "")
    renderer = Renderer(bench.folder, manifest.load(bench.folder))
    assert renderer.unavailable == "no C compiler (apt install gcc)"
    with pytest.raises(builder.BuildError, match="no C compiler"):
        renderer.build()


def test_list_without_a_compiler(rayrace):
    done = rayrace("list", env={"PATH": "", "CXX": "", "CC": ""}, code=0)
    built = [entry for entry in registry.entries().values() if entry.renderer.manifest.build]
    assert done.stdout.count("unavailable: no C++ compiler (apt install g++)") == len(built) >= 2
    told = json.loads(rayrace("list", "--json", env={"PATH": "", "CXX": ""}, code=0).stdout)
    available = {row["variant"]: row["available"] for row in told}
    assert all(available[name] for name in ("python", "numpy", "numba", "numba-parallel"))
    assert not any(available[name] for name in ("cpp", "cpp-threads", "povray", "cython", "mypyc"))
    for row in told:
        if row["variant"].startswith("cpp"):
            assert row["reason"] == "no C++ compiler (apt install g++)"


def test_run_without_a_compiler(rayrace, experiment, rows, tmp_path):
    """The renderers that need one are rows, everything else still runs and is judged, and that is no failure."""
    file = experiment(["cpp", "cpp-threads", "python", "numpy"])
    rayrace("run", file, "--out", tmp_path / "run", env={"PATH": "", "CXX": "", "CC": ""}, code=0)
    found = {name: row for name, (row,) in rows(tmp_path / "run").items()}
    for name in ("cpp", "cpp-threads"):
        assert (found[name]["status"], found[name]["reason"]) == ("unavailable", "no C++ compiler (apt install g++)")
        assert found[name]["wall_s"] is None and found[name]["frames_s"] is None
    for name in ("python", "numpy"):
        assert found[name]["status"] == "ok" and found[name]["agreement"]["max_outside"] < 1e-9
