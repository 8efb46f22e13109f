import json
from types import SimpleNamespace

import pytest
from repositories import git

from harness.errors import UserError
from harness.machine import environment
from harness.renderer import builder, versions


def values(facts):
    for value in facts.values():
        yield from values(value) if isinstance(value, dict) else [value]


def test_every_fact_is_told_or_says_why_not():
    facts = environment.capture()
    json.dumps(facts, allow_nan=False)
    assert all(value not in (None, "", {}) for value in values(facts))
    assert facts["cores"]["usable"] >= 1 and facts["memory_bytes"] > 10**8
    assert all(len(value) > len("unavailable: ") for value in values(facts) if str(value).startswith("unavailable"))


def test_without_proc_and_sys(monkeypatch):
    """As on another system: nothing is there to be read."""
    real = environment.Path
    monkeypatch.setattr(environment, "Path", lambda path: real(f"/no-such-place{path}"))
    facts = environment.capture()
    for name in ("governor", "turbo", "pressure", "virtual_machine", "caches"):
        assert facts[name].startswith("unavailable: "), name


@pytest.mark.parametrize("body", ["exit 1", "echo >&2 'mycc 2.0'; exit 1", "kill -9 $$", None])
def test_compilers_that_do_not_say(body, tmp_path, monkeypatch):
    compiler = tmp_path / "cc"
    compiler.write_text("no program" if body is None else f"#!/bin/sh\n{body}\n")
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", str(compiler))
    assert isinstance(environment.capture()["compilers"]["c"], str)
    builder.compiler_version.cache_clear()


@pytest.mark.parametrize("told", [NotImplementedError("can't find current frequency file"), OSError(22, "no"), None])
def test_a_processor_without_a_current_frequency(told, monkeypatch):
    """psutil raises what it likes there, or has no number."""

    def frequency():
        if told:
            raise told
        return SimpleNamespace(current=None, max=0.0)

    monkeypatch.setattr(environment.psutil, "cpu_freq", frequency)
    found = environment.capture()["frequency"]
    assert all(str(value).startswith("unavailable: ") for value in (found.values() if told is None else [found]))


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """A repository of which the module is a file, as a checkout of rayrace is; and another repository."""
    for name in ("ours", "another"):
        (tmp_path / name).mkdir()
        git(tmp_path / name, "init", "--quiet")
        (tmp_path / name / "environment.py").write_text(f"# {name}\n")
        git(tmp_path / name, "add", ".")
        git(tmp_path / name, "commit", "--quiet", "-m", name)
    monkeypatch.setattr(environment, "__file__", str(tmp_path / "ours" / "environment.py"))
    return tmp_path


def test_the_commit_is_of_the_repository_of_this_file(checkout, monkeypatch):
    """Whatever repository the environment names, as in a hook of git."""
    commit = git(checkout / "ours", "rev-parse", "--short", "HEAD").strip()
    assert environment._commit() == commit
    monkeypatch.setenv("GIT_DIR", str(checkout / "another" / ".git"))
    monkeypatch.setenv("GIT_WORK_TREE", str(checkout / "another"))
    monkeypatch.setenv("GIT_INDEX_FILE", str(checkout / "another" / ".git" / "index"))
    assert environment._commit() == commit
    (checkout / "ours" / "environment.py").write_text("# changed\n")
    assert environment._commit() == f"{commit}-dirty"


def test_a_repository_around_an_installed_package_is_not_its_own(checkout, monkeypatch):
    """As of a project whose folder has a virtual environment in it."""
    place = checkout / "ours" / "lib" / "environment.py"
    place.parent.mkdir()
    place.write_text("# installed\n")
    monkeypatch.setattr(environment, "__file__", str(place))
    assert environment._commit() == "unavailable: not in a git checkout"


def test_a_repository_of_another_user(checkout, monkeypatch):
    """Git looks at none ("dubious ownership"): what to do is told, and not that there is no repository."""
    monkeypatch.setenv("GIT_TEST_ASSUME_DIFFERENT_OWNER", "1")
    remedy = f"git config --global --add safe.directory {checkout / 'ours'}"
    assert environment._commit().endswith(f"which another user owns: {remedy}")
    entry = SimpleNamespace(renderer=SimpleNamespace(folder=checkout / "ours"), name="x")
    with pytest.raises(UserError) as caught:
        versions.others("HEAD", [entry])
    assert str(caught.value).endswith(remedy) and "no git repository" not in str(caught.value)
    with pytest.raises(UserError) as caught:
        versions.commits("HEAD~1..HEAD", entry)
    assert str(caught.value).endswith(remedy)


def test_doctor(rayrace):
    told = json.loads(rayrace("doctor", "--json", code=0).stdout)
    assert {finding["verdict"] for finding in told} <= {"good", "doubtful", "unknown"}
    assert len({finding["what"] for finding in told}) == len(told) >= 17
    assert all(finding["found"] for finding in told)
    assert all(finding["remedy"] for finding in told if finding["verdict"] == "doubtful")
    shown = rayrace("doctor", code=0).stdout
    assert "what to do" in shown and shown.splitlines()[-1].startswith("verdict: fit to measure")


def test_doctor_with_an_empty_path(rayrace):
    told = {
        row["what"]: row for row in json.loads(rayrace("doctor", "--json", env={"PATH": "", "CXX": ""}, code=0).stdout)
    }
    assert told["C++ compiler"]["verdict"] == "doubtful" and told["C++ compiler"]["remedy"] == "apt install g++"
