import json

import pytest

from harness.machine import environment
from harness.renderer import builder


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


def test_doctor(rayrace):
    told = json.loads(rayrace("doctor", "--json", code=0).stdout)
    assert {finding["verdict"] for finding in told} <= {"good", "doubtful", "unknown"}
    assert len({finding["what"] for finding in told}) == len(told) >= 17
    assert all(finding["found"] for finding in told)
    assert all(finding["remedy"] for finding in told if finding["verdict"] == "doubtful")
    assert "what to do" in rayrace("doctor", code=0).stdout


def test_doctor_with_an_empty_path(rayrace):
    told = {
        row["what"]: row for row in json.loads(rayrace("doctor", "--json", env={"PATH": "", "CXX": ""}, code=0).stdout)
    }
    assert told["C++ compiler"]["verdict"] == "doubtful" and told["C++ compiler"]["remedy"] == "apt install g++"
