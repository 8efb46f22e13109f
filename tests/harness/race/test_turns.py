"""Jobs that are timed without an experiment: in turn, audited, with the doubts of a run."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from mock_host import Behaviour, Mock, entries

from harness.race import turns
from harness.race.audit import Audit, Task
from harness.renderer.parameters import Parameters
from harness.statistics import steady
from harness.store.record import CONTRADICTED, FALSE_FRAMES
from harness.system import trouble

SCENE = """CAMERA (0,0,0) (1,0,0) (0,0.8,0) 4
LIGHT (4,5,6) (0.9,0.9,0.8) 0
SPHERE (-0.2,0.1,-1) 0.6 (0.7,0.5,0.3) 0 20 (0,0,0) 1e6 1
"""


@pytest.fixture
def take(tmp_path, monkeypatch):
    """Times mock renderers: take(Mock({"a": ..}), 5) is their Times by name."""
    monkeypatch.setenv("RAYRACE_CACHE", str(tmp_path / "cache"))

    def take(mock, count, frames=2):
        known = entries(tmp_path / "renderers", *mock.behaviours)
        job = Parameters(width=4, height=4, frames=frames)
        tasks = [Task(known[name], {}, job, (), "scene", name) for name in mock.behaviours]
        return dict(zip(mock.behaviours, turns.take(tasks, count, Audit(mock)), strict=True))

    return take


def test_exact_times_in_rounds_of_which_every_other_is_reversed(take):
    mock = Mock({"a": Behaviour(0.1), "b": Behaviour(0.3), "c": Behaviour(0.2)})
    found = take(mock, 6)
    one, two = mock.started[:3], mock.started[3:6]
    assert set(one) == {"a", "b", "c"} and two == one[::-1] and len(mock.started) == 18
    told = found["b"].seconds
    assert told.value == pytest.approx(0.3) and told.low == pytest.approx(0.3) and told.processes == 6
    assert turns.ratio(found["b"], found["a"]).value == pytest.approx(3)
    assert found["a"].record()["seconds"] == pytest.approx(0.1) and found["a"].doubts == []


def test_ratios_of_rounds_stand_against_a_drift_of_the_machine(take):
    found = take(Mock({"a": Behaviour(0.1), "b": Behaviour(0.1)}, drift_per_minute=1.0), 9)
    assert turns.ratio(found["b"], found["a"]).value == pytest.approx(1, rel=0.02)
    assert turns.floor(found["a"], found["b"]).value < 0.02


def test_a_process_that_contradicts_itself_does_not_count(take):
    found = take(Mock({"a": Behaviour(0.4, false=1)}), 5)["a"]
    assert found.records[0]["unranked"].startswith(CONTRADICTED) and sorted(found.rounds) == [1, 2, 3, 4]
    assert found.seconds.value == pytest.approx(0.4) and found.doubts == [found.records[0]["unranked"]]
    found = take(Mock({"a": Behaviour(0.4, false=3)}), 5)["a"]
    assert found.broken.startswith(CONTRADICTED) and found.record()["unavailable"] == found.broken


def test_one_false_frame_takes_the_time(take):
    found = take(Mock({"a": Behaviour(0.1, copies=True), "b": Behaviour(0.1)}), 3)
    assert found["a"].broken.startswith(FALSE_FRAMES) and not found["b"].broken and found["b"].doubts == []


def test_what_has_no_steady_state_has_no_time(take):
    mock = Mock({"a": Behaviour(0.01)}, drift_per_minute=200)
    assert take(mock, 3, frames=60)["a"].broken.startswith(steady.NO_STATE)


def test_what_fails_has_no_further_turn(take):
    mock = Mock({"a": Behaviour(0.1), "b": Behaviour(0.1, fails="failed")})
    found = take(mock, 4)
    assert found["b"].broken == "failed: as it was told to" and mock.started.count("b") == 1
    assert found["a"].seconds.processes == 4


@pytest.mark.parametrize(("count", "told"), [(3, True), (2, False)])
def test_doubts_are_those_of_half_of_the_processes_or_more(take, count, told):
    mock, looks = Mock({"a": Behaviour(0.1)}), []

    def look():
        looks.append(len(looks))
        busy = 9.0 * sum(1 for number in looks if number % 2 and number // 2 < count)
        return {**dict.fromkeys(("steal_s", "own_s", "waited_s", "swapped_pages", "held_back_s", "throttled"), 0.0),
                "busy_s": busy}  # fmt: skip

    mock.look = look
    found = take(mock, 5)["a"]
    assert found.doubts == [trouble.DOUBTS["other_cpu_s"]] * told


@pytest.mark.alone
@pytest.mark.parametrize(
    "words",
    [
        ("needs", "scene.txt", "-r", "numpy", "--processes", "2", "--width", "12", "--height", "10"),
        ("render", "scene.txt", "-r", "numpy", "--max-error", "1/8", "--width", "12", "--height", "10", "-o", "p.npy"),
    ],
    ids=["needs", "max-error"],
)
def test_a_machine_that_another_program_burns_is_told(environment, tmp_path, words):
    """Programs that keep all cores busy: with them the output has the doubt of a run, on paper and in JSON."""
    (tmp_path / "scene.txt").write_text(SCENE)
    program = Path(sys.executable).with_name("rayrace")

    def run(*more):
        return subprocess.run([program, *words, *more], env=environment, cwd=tmp_path, capture_output=True, text=True)

    run()  # builds what it needs, which would take long beside the others
    # Two for each core: of one for each the scheduler takes as much as the bound of a doubt.
    cores = 2 * len(trouble.usable())
    burning = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(cores)]
    try:
        said = run(), run("--json")
    finally:
        for process in burning:
            process.kill()
            process.wait()
    for done in said:
        assert done.returncode == 0, done.stdout + done.stderr
    assert f"  numpy: warning: {trouble.DOUBTS['other_cpu_s']}\n" in said[0].stdout
    told = json.loads(said[1].stdout)
    assert trouble.DOUBTS["other_cpu_s"] in (told.get("time") or told)["doubts"]
