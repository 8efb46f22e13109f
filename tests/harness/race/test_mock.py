"""The timing logic of the whole harness, told exactly what every process takes (tests/support/mock_host.py)."""

import math

import pytest
from mock_host import Behaviour, Mock, entries

from harness.experiment import experiment as experiments
from harness.machine import environment
from harness.plan import plan
from harness.race import frames, race
from harness.statistics import statistics
from harness.store.record import FALSE_FRAMES, UNCHECKED
from reports.run import ranking, results
from reports.summary import doubts

SCENE = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\nBACKGROUND (0.2,0.5,0.7)\n"
CAPTURED = environment.capture()
PLAIN = pytest.mark.nightly("CI has the case with outliers, where a verdict is harder")


@pytest.fixture
def mock_run(tmp_path, monkeypatch):
    """Run an experiment of mock renderers: mock_run(Mock({"a": ..}), processes=20) is (records, results)."""
    monkeypatch.setattr(environment, "capture", lambda: CAPTURED)
    (tmp_path / "scene.txt").write_text(SCENE)

    def run(mock, name="run", more="", budget=math.inf, tell=lambda *_: None, **settings):
        names = ", ".join(f'"{variant}"' for variant in mock.behaviours)
        words = "\n".join(f"{key} = {value!r}" for key, value in {"processes": 5, "frames": 2, **settings}.items())
        file = tmp_path / "experiment.toml"
        file.write_text(
            f'title = "mock"\nscenes = ["scene.txt"]\nrenderers = [{names}]\n{words}\n'
            f"[image]\nwidth = 4\nheight = 4\n{more}"
        )
        known = entries(tmp_path / "renderers", *mock.behaviours)
        asked = experiments.load(file)
        records = race.run(asked, plan.make(asked, file, known), known, tmp_path / name, tell, False, budget, mock)
        return records, results.load(tmp_path / name)

    return run


def cell(loaded, variant):
    return next(cell for cell in loaded.cells if cell.variant == variant)


def test_an_exact_renderer_is_measured_exactly(mock_run):
    records, loaded = mock_run(Mock({"a": Behaviour(0.123, start=0.5)}), processes=6)
    timed = [record for record in records if record["pass"] == "timed"]
    assert len(timed) == 6 and len(records) == 12
    for record in timed:
        assert record["frames_s"] == pytest.approx([0.123] * 3) and record["status"] == "ok"
        assert record["wall_s"] == pytest.approx(0.5 + 3 * 0.123) == record["took_s"]
    found = cell(loaded, "a").median("steady_s", "")
    assert (found.value, found.low, found.high, found.processes) == (*[pytest.approx(0.123)] * 3, 6)


def test_what_a_renderer_does_is_what_is_said_of_it(mock_run):
    """0.123 s a frame, 12 % outliers, 3 % of drift a minute, 7 frames of warm-up: in, and out again."""
    told = Behaviour(0.123, frame_noise=0.01, outliers=0.12, warmup=7)
    mock = Mock({"a": told}, seed=3, drift_per_minute=0.03)
    _, loaded = mock_run(mock, processes=8, frames=99)
    rows = cell(loaded, "a").good
    assert set(rows["steady_state"]) == {"steady"}
    # where the first frame after the warm-up is itself an outlier, nobody can tell
    assert set(rows["warmup_frames"]) <= {7, 8} and (rows["warmup_frames"] == 7).sum() >= 5
    share = rows["outlier_frames"].sum() / (rows["steady_frames"].sum())
    assert share == pytest.approx(0.12, abs=0.05)
    middle = 0.123 * (1 + 0.03 * mock.now / 2 / 60)
    assert cell(loaded, "a").median("steady_s", "").value == pytest.approx(middle, rel=0.02)


def test_no_steady_state_is_said(mock_run):
    """It gets slower by a third while a process runs: its time is no number."""
    _, loaded = mock_run(Mock({"a": Behaviour(1.0)}, drift_per_minute=0.3), frames=60, processes=5)
    found = cell(loaded, "a")
    assert set(found.rows["steady_state"]) == {"none"} and "no steady state" in found.unranked


def ratio(loaded):
    return ranking.ratio(cell(loaded, "b"), cell(loaded, "a"))


@pytest.mark.slow
@pytest.mark.parametrize(("processes", "within"), [(5, 0.015), (6, 0.01), (9, 0.01), (20, 0.01)])
def test_drift_is_cancelled_by_interleaving_and_not_by_running_in_order(mock_run, processes, within):
    """Everything gets 10 % slower from the first to the last process; b truly takes 1.25 times as long as a.

    Of 5 rounds one is alone, and each is 2 % of drift: one order in twenty leaves 1 to 1.4 %.
    """
    for seed in range(8):
        found = {}
        for order in ("interleaved", "sequential"):
            behaviours = {"a": Behaviour(1.0, noise=0.002), "b": Behaviour(1.25, noise=0.002)}
            length = processes * 3 * (1.0 + 1.25 + 1.0) / 60  # min: a, b and the pair's second
            records, loaded = mock_run(
                Mock(behaviours, seed=seed, drift_per_minute=0.10 / length),
                name=f"{order}-{seed}", order=order, processes=processes, seed=seed,
            )  # fmt: skip
            steady = [record["frames_s"][1] for record in records if record["variant"] == "a"]
            assert 1.05 < max(steady) / min(steady) < 1.12
            found[order] = ratio(loaded)
        told = f"seed {seed}: {found}"
        assert abs(found["interleaved"].value / 1.25 - 1) < within, told
        assert abs(found["sequential"].value / 1.25 - 1) > 0.02, told
        if processes == 20:
            assert not found["sequential"].low <= 1.25 <= found["sequential"].high, told


@pytest.mark.slow
@pytest.mark.whole
@pytest.mark.parametrize(
    ("truth", "more"),
    [
        pytest.param(1.0, {}, id="equal", marks=PLAIN),
        pytest.param(1.0, {"process_outliers": 0.12}, id="equal, 12 % of processes outlying"),
        pytest.param(1.05, {}, id="5 % slower", marks=PLAIN),
        pytest.param(1.05, {"outliers": 0.12}, id="5 % slower, 12 % of frames outlying"),
    ],
)
def test_a_hundred_runs(mock_run, truth, more):
    """2 % noise, 20 repetitions: equals are told apart in at most 5 of 100 runs, 5 % is found in at least 95."""
    verdicts = []
    for seed in range(100):
        mock = Mock({"a": Behaviour(1.0, noise=0.02, **more), "b": Behaviour(truth, noise=0.02, **more)}, seed=seed)
        _, loaded = mock_run(mock, name=f"run-{seed}", processes=20, frames=10 if more else 2)
        verdicts.append(statistics.verdict(ratio(loaded), loaded.floor.value))
    expected = "not resolved" if truth == 1 else "slower"
    print(f"truth {truth}, {more}: {verdicts.count(expected)} of 100 {expected}, seeds 0 to 99")
    assert verdicts.count(expected) >= 95


def test_a_budget_is_kept_and_the_time_left_is_told(mock_run):
    heard = []
    behaviours = {"a": Behaviour(1.0, start=0.0), "b": Behaviour(9.0, start=0.0)}  # 3 s and 27 s a process
    mock = Mock(behaviours)
    tell = lambda cell, record, done, total, left: heard.append((mock.now, done, total, left))  # noqa: E731
    records, _ = mock_run(mock, budget=200.0, processes=50, tell=tell, more='[measure]\npair = "off"\n')
    turns = [sum(record["variant"] == name for record in records) for name in ("a", "b")]
    assert mock.now <= 200 and mock.now > 200 - 27 and abs(turns[0] - turns[1]) <= 1
    assert heard[-1][1:3] == (len(records), 100)
    assert all(0 < left <= 200 - now for now, _, _, left in heard[:-1]), "from the first process on, within the budget"


@pytest.mark.parametrize(("false", "ranked"), [(0, True), (2, True), (3, False), (9, False)])
def test_a_cell_of_false_times_has_no_rank(mock_run, false, ranked):
    """Of five processes with frames of 1 us; of few the times do not count, of most all are lost."""
    mock = Mock({"a": Behaviour(0.2, false=false), "b": Behaviour(0.1)})
    records, loaded = mock_run(mock, more='[measure]\npair = "off"\n', order="sequential")
    told = [record for record in records if record["variant"] == "a"]
    words = "its marks contradict its phases: its frames cover 3e-06 s of 0.6 s of phase render"
    assert [record["unranked"] for record in told] == [words if number < false else None for number in range(5)]
    assert {record["status"] for record in records} == {"ok"}
    found = cell(loaded, "a")
    assert bool(found.unranked) is not ranked
    if ranked:
        assert found.steady.value == pytest.approx(0.2) and found.steady.processes == 5 - false
        assert (words in found.verdict) == (false > 0)
    else:
        assert found.unranked.startswith(words) and isinstance(found.steady, results.Missing)
    assert [c.variant for c in ranking.ranked(loaded, found.place)] == (["b", "a"] if ranked else ["b"])
    assert ranking.baseline(loaded, found.scene) == ("a" if ranked else "b")


def test_one_false_frame_takes_the_rank_of_a_cell(mock_run):
    """It is looked for in one repetition of five to nine, at random: the others say nothing of it."""
    records, loaded = mock_run(Mock({"a": Behaviour(0.1, copies=True), "b": Behaviour(0.2)}), processes=11)
    told = [record for record in records if record["variant"] == "a" and record["pass"] == "timed"]
    found = [record for record in told if record["unranked"]]
    assert sorted(record["repetition"] // 6 for record in found) == [0, 1]
    assert all(record["unranked"].startswith(FALSE_FRAMES) and record["checked"]["frame"] in (1, 2) for record in found)
    assert all(record["checked"] is None for record in told if record not in found)
    a = cell(loaded, "a")
    assert a.unranked.startswith(FALSE_FRAMES) and [c.variant for c in ranking.ranked(loaded, a.place)] == ["b"]


def test_a_run_that_ends_early_says_whose_frames_are_unchecked(mock_run, monkeypatch):
    """A finished one has looked at a frame of each cell."""
    _, loaded = mock_run(Mock({"a": Behaviour(0.1), "b": Behaviour(0.2)}))
    assert not [text for text in doubts.kinds(loaded) if UNCHECKED in text]
    monkeypatch.setattr(frames.Turns, "is_due", lambda *_: False)
    _, loaded = mock_run(Mock({"a": Behaviour(0.1), "b": Behaviour(0.2)}), name="early")
    assert len([text for text in doubts.kinds(loaded) if UNCHECKED in text]) == 2


def test_the_noise_floor_is_not_made_of_false_times(mock_run):
    _, loaded = mock_run(Mock({"a": Behaviour(0.2, false=99)}))
    assert loaded.floor.value is None
