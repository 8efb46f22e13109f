"""Counts of instructions: they repeat, a hundredth more work is seen, and a machine without tools says so."""

import shutil
import stat
import sys

import pytest
from compilers import needs_compiler
from fixtures import SPHERE_SCENE, a_copy
from mock_host import Behaviour, Mock, planned

from harness.errors import UserError
from harness.plan import predict
from harness.plan.forecast import Forecast
from harness.plan.plan import Cell
from harness.race import counting, race
from harness.race.host import ThisHost
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.needs import needs
from harness.store import schema, store
from harness.system import counters

needs_valgrind = pytest.mark.skipif(not shutil.which("valgrind"), reason="no program valgrind on the PATH")
PERF = """#!{python}
# Takes 1000 instructions to start, and 500 a frame; a cycle for two of them. No cache misses are known.
import subprocess, sys
words = sys.argv[1:]
out, command = words[words.index("-o") + 1] if "-o" in words else None, words[words.index("--") + 1:]
frames = next((int(word.partition("=")[2]) for word in command if word.startswith("--frames=")), 0)
told = {counts}
lines = [f"{{value}},,{{name}}:u,1,100.00,," for name, value in told.items()]
lines.append("<not supported>,,cache-misses:u,0,100.00,,")
print("# started", "", *lines, sep="\\n", file=open(out, "w") if out else sys.stderr)
sys.exit(subprocess.run(command).returncode)
"""
COUNTS = '{"instructions": 1000 + 500 * (frames + 1), "cycles": 500 + 250 * (frames + 1)}'


def cell(entry, **parameters):
    """A cell of a sphere, 16 x 16 pixels, and the arrays of its job."""
    scene, wanted = text.read(SPHERE_SCENE, "scene of the test"), Parameters(width=16, height=16, **parameters)
    rest = {"processes": 1, "timeout": 120.0, "point": {}, "objects": 1, "lights": 1}
    return Cell("k", entry, "scene", "version", wanted, needs(scene, wanted), **rest), flatten(scene)


def counts(entry, cache, **parameters):
    status, reason, found = counting.count(*cell(entry, **parameters), ThisHost(), cache)
    assert (status, reason) == ("ok", ""), reason
    return found


@needs_valgrind
@needs_compiler("c++")
def test_counts_of_cpp_repeat_and_a_hundredth_more_work_is_seen(known, tmp_path, monkeypatch):
    monkeypatch.setattr(counters, "perf", lambda: counters.NO_PERF)
    first, second = (counts(known["cpp"], tmp_path / "cache") for _ in range(2))
    assert second["instructions"] == pytest.approx(first["instructions"], rel=0.002) and first["spread"] < 0.002
    assert (first["tool"], first["width"], first["height"], first["smaller"]) == ("valgrind", 16, 16, None)
    assert first["rays"] >= 256 and "cycles" not in first
    steps = round(0.012 * first["instructions"] / 5)  # a step of the loop takes some 5 instructions
    loop = f"for (volatile int i = 0; i < {steps}; i++) {{}}\n        frame();"
    slower = a_copy(known, "cpp", tmp_path / "slower", "main.cpp", "        frame();", loop)
    more = counts(slower, tmp_path / "cache")["instructions"] / first["instructions"]
    assert 1.005 < more < 1.03


@needs_valgrind
def test_counts_of_python_repeat(known, tmp_path, monkeypatch):
    monkeypatch.setattr(counters, "perf", lambda: counters.NO_PERF)
    found = counts(known["python"], tmp_path / "cache")  # of three processes
    assert found["instructions"] > 1e6 and found["spread"] < 0.01


def tools(folder, monkeypatch, perf=""):
    """A PATH with nothing but what a renderer needs, and perhaps a program perf."""
    folder.mkdir()
    for name in ("env", "true"):
        (folder / name).symlink_to(shutil.which(name))
    if perf:
        (folder / "perf").write_text(PERF.format(python=sys.executable, counts=perf))
        (folder / "perf").chmod(stat.S_IRWXU)
    monkeypatch.setenv("PATH", str(folder))


def test_perf_counts_the_picture_as_it_is(known, tmp_path, monkeypatch):
    tools(tmp_path / "bin", monkeypatch, COUNTS)
    found = counts(known["python"], tmp_path / "cache")
    assert {name: found[name] for name in ("tool", "instructions", "cycles", "spread", "smaller", "options")} == {
        "tool": "perf", "instructions": 500.0, "cycles": 250.0, "spread": 0.0, "smaller": None, "options": [],
    }  # fmt: skip
    assert "cache_misses" not in found  # not supported


def test_fewer_instructions_for_more_frames_are_no_count(known, tmp_path, monkeypatch):
    tools(tmp_path / "bin", monkeypatch, '{"instructions": 1000 - frames}')
    status, reason, found = counting.count(*cell(known["python"]), ThisHost(), tmp_path / "cache")
    assert (status, found) == ("unavailable", None) and "more frames took fewer instructions" in reason


def test_a_machine_without_tools_says_so(known, tmp_path, monkeypatch):
    tools(tmp_path / "bin", monkeypatch)
    status, reason, found = counting.count(*cell(known["python"]), ThisHost(), tmp_path / "cache")
    assert (status, found) == ("unavailable", None)
    assert reason == f"{counters.NO_PERF}; {counters.NO_VALGRIND}"
    assert all("apt install" in told for told in reason.split("; "))


def test_a_perf_without_counters_says_so(tmp_path, monkeypatch):
    tools(tmp_path / "bin", monkeypatch, '{"instructions": "<not supported>"}')
    assert counters.perf() == "perf reads no counters: instructions <not supported>"
    denied = tmp_path / "denied"
    denied.write_text("#!/bin/sh\necho 'Error:\nAccess is limited.\nTo change it, ..' >&2; exit 255\n")
    denied.chmod(stat.S_IRWXU)
    assert counters._able(str(denied)) == "perf reads no counters: Access is limited."


@pytest.mark.parametrize(
    "line, why",
    [
        ("900,,instructions:u,1,44.00,,", "perf: instructions 900, counted 44.00 % of the time"),
        ("<not counted>,,instructions:u,0,0.00,,", "perf: instructions <not counted>"),
        ("900,,cycles:u,1,100.00,,", "perf counted no instructions"),
    ],
)
def test_what_perf_only_estimates_is_no_count(tmp_path, line, why):
    (tmp_path / "perf.csv").write_text(f"{line}\n")
    assert counters.Tool("perf", "6.1", False).read(tmp_path) == why


@pytest.mark.parametrize("form", ["{kind}/{name}:u/", "{kind}/{name}/u"])
@pytest.mark.parametrize("kinds", ["", "cpu_atom cpu_core", "cpu_core cpu_atom cpu_lowpower"])
def test_kinds_of_cores_count_together(form, kinds, tmp_path, monkeypatch):
    """Each counts while the program is on it; what is counted in all of the time is exact, without perf's scaling."""
    kinds, lines = kinds.split(), []
    for name in ("instructions", "branch-misses"):
        names = [form.format(kind=kind, name=name) for kind in kinds] or [f"{name}:u"]
        lines += [f"<not counted>,,{name},0,0.00,," for name in names[2:]]
        lines += [f"{300 if kinds else 1000},,{names[0]},1,{'33.33' if kinds else '100.00'},,"]
        lines += [f"700,,{name},2,66.67,," for name in names[1:2]]
    (tmp_path / "perf.csv").write_text("\n".join(lines))
    tool = counters.Tool("perf", "6.9", False)
    assert tool.read(tmp_path) == {"instructions": 1000, "branch_misses": 1000} and "--no-scale" in tool.words(tmp_path)
    (tmp_path / "perf.csv").write_text("\n".join(line.replace("66.67", "40.00") for line in lines))
    if kinds:
        assert tool.read(tmp_path) == "perf: instructions 1000, counted 73.33 % of the time"
    program = tmp_path / "perf"
    program.write_text("#!/bin/sh\necho '" + "\n".join(lines) + "' >&2\n")
    program.chmod(stat.S_IRWXU)
    assert isinstance(counters._able(str(program)), counters.Tool)


def test_processes_of_one_renderer_count_together(tmp_path):
    for number, told in enumerate(("1,234,567", "33")):
        (tmp_path / f"{number}.log").write_text(f"==7== Cachegrind\n==7== \n==7== I   refs:      {told}\n")
    assert counters.Tool("valgrind", "3.19.0", True).read(tmp_path) == {"instructions": 1_234_600}


def test_a_frame_is_what_more_frames_take():
    jobs = [{"instructions": 1000 + 70 * frames, "cycles": 9 * frames} for frames in (0, 10, 20)]
    del jobs[1]["cycles"]
    assert counting.steady(jobs, 10) == {"instructions": 70, "spread": 0}
    assert counting.steady([{"instructions": n} for n in (0, 10, 21)], 1)["spread"] == pytest.approx(0.1)


@pytest.mark.parametrize(
    "asked, found",
    [
        ({"width": 64, "height": 48}, (64, 48, None)),
        ({"width": 640, "height": 320}, (64, 32, None)),
        ({"width": 3, "height": 3000}, (1, 64, None)),
        ({"width": 1000, "height": 1000, "region": (500, 500, 564, 532)}, (1000, 1000, (500, 500, 564, 532))),
        ({"width": 1000, "height": 1000, "region": (500, 250, 628, 314)}, (500, 500, (250, 125, 314, 157))),
    ],
)
def test_a_smaller_picture_has_the_same_view(asked, found):
    got = counting.smaller(Parameters(**asked))
    assert (got.width, got.height, got.region) == found


def test_every_renderer_that_needs_other_instructions_is_built_without_them(known):
    """What Valgrind does not know is switched off beside the rest of the command."""
    entry = known["cpp"]
    made = counting.under(entry, ("-mno-avx512f",), {"A": "b"}, ["valgrind"])
    assert made.renderer.manifest.build.command[-1] == "-mno-avx512f" and entry.name == made.name
    assert made.variant.command == ("env", "PYTHONHASHSEED=0", "A=b", "valgrind", *entry.variant.command)
    assert made.renderer.version == entry.renderer.version


@pytest.fixture
def asked(tmp_path, write):
    """asked('count = true'): an experiment of two mock renderers, its plan, and who is known."""
    return lambda measure="": planned(write, tmp_path, measure, 2, SPHERE_SCENE)


@pytest.mark.parametrize("order", ["interleaved", "sequential"])
def test_counts_come_after_everything_that_is_timed(asked, order):
    turns = asked("count = true\ncold = true")[1].order(1, order)
    assert [turn.kind == "count" for turn in turns] == [False] * 8 + [True] * 2
    assert {turn.cell.entry.name for turn in turns[-2:]} == {"a", "b"}
    assert "count" not in {turn.kind for turn in asked()[1].order(1, order)}


def test_a_run_counts_once_and_no_time_is_touched(asked, tmp_path, monkeypatch):
    made = {"instructions": 70.0, "tool": "perf", "version": "6", "width": 4, "height": 4, "rays": 7, "spread": 0.0}
    made |= {"smaller": None, "options": [], "environment": {}}
    calls = []
    for name, bad in (("instructions", 0.0), ("width", 0), ("rays", "many"), ("tool", None)):
        with pytest.raises(UserError, match=name):
            schema.row({"counts": made | {name: bad}}, tmp_path, 1)

    def count(cell, arrays, host, cache):
        calls.append(cell.entry.name)
        host.now += 40.0
        return ("ok", "", made) if cell.entry.name == "a" else ("unavailable", "no tool", None)

    monkeypatch.setattr(counting, "count", count)
    wanted, planned, known = asked('count = true\npair = "off"')
    mock = Mock({"a": Behaviour(0.5), "b": Behaviour(0.25)})
    race.run(wanted, planned, known, tmp_path / "run", host=mock)
    _, records = store.read(tmp_path / "run")
    *timed, first, second = records
    assert len(timed) == 4 and calls == ["a", "b"]
    assert (first["pass"], first["counts"], first["status"]) == ("count", made, "ok")
    assert (second["counts"], second["status"], second["reason"]) == (None, "unavailable", "no tool")
    assert all(first[name] is None for name in ("wall_s", "frames_s", "phases", "cpu", "memory", "picture"))
    predictor = predict.Predictor(records)
    assert predictor.count(planned.cells[0]) == 40 and predictor.seconds(planned.cells[0]).seconds < 5
    race.run(wanted, planned, known, tmp_path / "run", host=mock, resumed=True)
    assert calls == ["a", "b"]  # they are there
    ahead = Forecast(planned, wanted, predictor)
    assert ahead.seconds == pytest.approx(80 + sum(line.seconds for line in ahead.lines)) and not ahead.uncounted
    assert ahead.cut(ahead.seconds - 1) == (5, 2)  # all rounds, and one of two counts
    unknown = Forecast(planned, wanted, predict.Predictor(timed))
    assert unknown.uncounted == {"a": 1, "b": 1} and unknown.cut(1e6) is None and not unknown.unknown
