import importlib.metadata
import json
import os
import re
import shutil
from pathlib import Path

import pytest

from harness.errors import UserError
from harness.renderer import manifest, registry

GOOD = """contract = 1
name = "mine"
technology = "T"
description = "D"
features = ["sphere"]
[[variant]]
name = "mine"
command = ["true"]
"""


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("contract = 1", "contract = 3", "contract: Input should be 1 or 2"),
        ("contract = 1\n", "", "contract: Field required"),
        ('name = "mine"\nt', 'name = "My Own"\nt', "name: String should match pattern"),
        ('["true"]', '"true"', "variant.0.command: Input should be a valid list"),
        ('["true"]', "[]", "variant.0.command: List should have at least 1 item"),
        ('command = ["true"]', 'comand = ["true"]', 'variant.0.comand: unknown key; did you mean "command"?'),
        ('command = ["true"]', "", "variant.0.command: Field required"),
        ("[[variant]]", "[variant]", "variant: Input should be a valid list"),
        ('["sphere"]', '["sphere", 3]', "features.1: Input should be a valid string"),
        (
            "[[variant]]",
            "[requires]\nprogramms = []\n[[variant]]",
            'requires.programms: unknown key; did you mean "programs"?',
        ),
        (
            "[[variant]]",
            '[build]\ncompiler = ""\ncommand = ["x"]\n[[variant]]',
            "build.compiler: String should have at least 1 character",
        ),
        (
            "[[variant]]",
            '[build]\ncompiler = "c"\ncomand = []\n[[variant]]',
            'build.comand: unknown key; did you mean "command"?',
        ),
        ('command = ["true"]', 'command = ["true"]\nthreads = 4', "variant.0.threads: Input should be 1 or 'all'"),
        ('["true"]', '["true"]\ndevice = "tpu"', "variant.0.device: Input should be 'cpu', 'cuda' or 'opencl'"),
        ('["true"]', '["true"]\nexhibit = ""', "variant.0.exhibit: String should have at least 1 character"),
        (
            '["true"]',
            '["true"]\nrequires = { module = ["x"] }',
            'variant.0.requires.module: unknown key; did you mean "modules"?',
        ),
        ('["sphere"]', '["sphere"]\nshares = ["../no.py"]', "shares.0: no such file: ../no.py"),
        ('["sphere"]', '["sphere"]\nshares = [".."]', "shares.0: no such file: .."),
        ("contract = 1", "contract = ", "Invalid value (at line 1"),
        (GOOD, "\udcff", "not a text file (UTF-8)"),
    ],
)
def test_faulty_manifest(old, new, message, tmp_path):
    file = tmp_path / "renderer.toml"
    assert old in GOOD
    file.write_bytes(GOOD.replace(old, new, 1).encode("utf-8", errors="surrogateescape"))
    with pytest.raises(UserError) as fault:
        manifest.load(tmp_path)
    assert str(file) in str(fault.value) and message in str(fault.value), str(fault.value)


def test_no_manifest(tmp_path):
    with pytest.raises(UserError, match=r"renderer\.toml: no such file; a renderer is a folder with a renderer\.toml"):
        manifest.load(tmp_path)


def test_two_renderers_with_one_variant_name(write, tmp_path, rayrace):
    for name in ("a", "b"):
        write(f"{name}/renderer.toml", GOOD)
    done = rayrace("list", "--renderer", tmp_path, code=2)
    assert done.stderr == f'error: {tmp_path}/b/renderer.toml: variant "mine" is also in {tmp_path}/a; rename one\n'
    write("b/renderer.toml", GOOD.replace("mine", "cpp"))
    done = rayrace("list", "--renderer", tmp_path / "b", code=2)
    assert 'variant "cpp" is also in ' in done.stderr


def test_where_renderers_are_looked_for(write, tmp_path, monkeypatch):
    for name in ("one", "two", "three/four"):
        write(f"{name}/renderer.toml", GOOD.replace("mine", name[-4:].strip("/")))
    monkeypatch.setenv("RAYRACE_RENDERERS", f"{tmp_path / 'one'}::{tmp_path / 'three'}")
    found = registry.entries((tmp_path / "two",))
    assert list(found)[-3:] == ["one", "four", "two"] and "cpp" in found
    again = registry.entries((tmp_path / "one", tmp_path / "two", Path(registry.folders()[0])))
    assert set(again) == set(found)


def test_find(known):
    assert registry.find("numpy", known).name == "numpy"
    with pytest.raises(UserError, match=r'no renderer "nunpy"; did you mean "numpy"\?'):
        registry.find("nunpy", known)
    with pytest.raises(UserError, match='no renderer "zzz"; known: cpp, '):
        registry.find("zzz", known)


@pytest.mark.parametrize(
    ("requires", "reason"),
    [
        ('modules = ["json"]', None),
        ('modules = ["json", "no_such"]', "no Python module no_such (pip install no_such)"),
        ('modules = ["no_such.part"]', "no Python module no_such.part (pip install no_such.part)"),
        ('modules = ["json.no_such"]', "no Python module json.no_such (pip install json.no_such)"),
        ('modules = [""]', "no Python module  (pip install )"),
        ('programs = ["sh"]', None),
        ('programs = ["no-such"]', "no program no-such on the PATH (apt install no-such)"),
    ],
)
def test_what_is_required(requires, reason, write, tmp_path):
    write("renderer.toml", GOOD.replace("[[variant]]", f"[requires]\n{requires}\n[[variant]]"))
    assert registry.Renderer(tmp_path, manifest.load(tmp_path)).unavailable == reason


def test_what_a_bundled_renderer_lacks_is_in_an_extra(monkeypatch):
    brought = [re.sub("[-_.]+", "-", line).lower() for line in importlib.metadata.requires("rayrace")]
    for module, extra in registry.EXTRAS.items():
        name = re.sub("[._]", "-", module).lower()
        assert [line for line in brought if re.match(rf"{name}[>=]", line) and f"extra == '{extra}'" in line]
    monkeypatch.setattr(registry, "_is_installed", lambda module: module in ("numba", "numpy"))
    lacking = registry.entries()["numba-cuda"].unavailable
    assert lacking == "no Python module numba_cuda (pip install 'rayrace[cuda]')"


def test_version_is_of_the_content_alone(write, tmp_path):
    first = write("a/renderer.toml", GOOD).parent
    second = tmp_path / "b"
    shutil.copytree(first, second)
    versions = [registry.Renderer(folder, manifest.load(folder)).version for folder in (first, second)]
    assert versions[0] == versions[1]
    write("b/lib/x.h", "")
    assert registry.Renderer(second, manifest.load(second)).version != versions[0]


def renderer(folder):
    return registry.Renderer(folder, manifest.load(folder))


def test_version_covers_what_is_shared(write, tmp_path):
    write("lib/worker.py", "x = 1\n")
    write("lib/other.py", "y = 1\n")
    folder = write("lib/mine/renderer.toml", GOOD.replace("[[var", 'shares = ["../worker.py"]\n[[var')).parent
    first = renderer(folder)
    assert first.sources() == ["renderer.toml", "../worker.py"] and first.version == renderer(folder).version
    write("lib/other.py", "y = 2\n")
    assert renderer(folder).version == first.version and first.changed() == []
    write("lib/worker.py", "x = 2\n")
    assert renderer(folder).version != first.version and first.changed() == ["../worker.py"]
    (tmp_path / "lib" / "worker.py").unlink()
    assert first.changed() == ["../worker.py"]


def test_who_imports_the_worker_shares_it():
    for folder in registry.folders():
        imports = any("from renderers import worker" in path.read_text() for path in folder.rglob("*.py"))
        assert imports == (manifest.load(folder).shares == ("../worker.py",)), folder


def test_what_has_changed(write, tmp_path):
    folder = write("mine/renderer.toml", GOOD).parent
    write("mine/a.py", "x = 1\n")
    made = renderer(folder)
    before = made.version
    assert made.changed() == []
    write("mine/a.py", "x = 2\n")
    assert made.changed() == made.changed() == ["a.py"] and made.version == before
    write("mine/a.py", "x = 1\n")  # as it was
    assert made.changed() == []
    for name in ("NOTES.md", "__pycache__/a.pyc", ".a.swp"):
        write(f"mine/{name}", "")
    assert made.changed() == []
    write("mine/lib/b.py", "")
    (folder / "renderer.toml").unlink()
    assert made.changed() == ["lib/b.py", "renderer.toml"]


def test_an_edit_that_keeps_size_and_time_is_seen(write, tmp_path):
    made = renderer(write("mine/renderer.toml", GOOD).parent)
    file = write("mine/a.py", "x = 1\n")
    stamp = file.stat().st_mtime_ns
    assert made.version
    file.write_text("x = 2\n")
    os.utime(file, ns=(stamp, stamp))
    assert made.changed() == ["a.py"]


def test_a_source_that_is_as_it_was_is_not_read_again(write, monkeypatch):
    folder = write("mine/renderer.toml", GOOD).parent
    write("mine/a.py", "x = 1\n")
    made, read = renderer(folder), []
    digest = registry._digest
    monkeypatch.setattr(registry, "_digest", lambda path: read.append(path.name) or digest(path))
    assert made.version and sorted(read) == ["a.py", "renderer.toml"]
    read.clear()
    assert made.changed() == [] and read == []
    (folder / "a.py").touch()
    assert made.changed() == [] and read == ["a.py"]


def test_list(rayrace, known):
    told = json.loads(rayrace("list", "--json", code=0).stdout)
    assert [row["variant"] for row in told] == list(known)
    assert set(told[0]) == {
        *("variant", "technology", "threads", "device", "available", "reason", "simulated", "exhibit"),
        *("changes", "features", "folder"),
    }
    shown = rayrace("list", code=0).stdout
    assert all(f" {name} " in shown for name in known)
