"""Gates pass, fail or cannot tell: of intervals that can be checked by hand, and of a machine that others use, of which
the times are simulated."""

import re
from collections import Counter

import command_line
import numpy as np
import pytest

from harness.errors import UserError
from harness.statistics import statistics
from harness.statistics.statistics import Estimate
from harness.system import trouble
from reports.compare import compare, gate, versions
from reports.run import repetition, results

BUSY = {"warnings": [trouble.DOUBTS["other_cpu_s"]]}
AGAINST = [{"variant": "cpp", "other": "cpp@old"}]
OTHER = {"series": None, "picture": {"file": "pictures/cpp.npy"}}
TURN = 3.0  # ms that a program has the core for, and then the other


@pytest.fixture
def run(record, make_run):
    """A function that makes a run in which cpp takes `above[n]` (s) for its frames in round n, and cpp@old `below[n]`.

    cpu: the CPU times of a frame of both, by round. later, earlier: changes of the records of cpp, of cpp@old.
    """

    def make(
        above, below, cpu=(None, None), later=None, earlier=None, variants=("cpp", "cpp@old"), name="run", **facts
    ):
        rows = []
        sides = (above, cpu[0], later or {}), (below, cpu[1], {**OTHER, **(earlier or {})})
        for variant, (frames, used, changes) in zip(variants, sides, strict=True):
            for number, times in enumerate(frames):
                times = list(times) if np.ndim(times) else [times] * 2
                seconds = {} if used is None else {"frame_s": used[number]}
                told = {"cpu": {"user_s": 1.5, "system_s": 0.5, "series_s": 2.0, **seconds}, **changes}
                rows.append(record(variant, number, (9.0, *times), **told))
        return make_run(rows, name, **{"against": AGAINST, **facts})

    return make


@pytest.fixture
def held(run):
    """A function that makes such a run and returns the gate at 5 %."""
    return lambda *words, **options: gate.of_versions(versions.comparisons(results.load(run(*words, **options))), 5)


def ratios(low, high, count=9):
    return np.linspace(low, high, count)


@pytest.mark.parametrize(
    "low, high, verdict, line",
    [
        (0.98, 1.02, gate.PASS, "gate: pass: no slowdown of 5 % or more: at most 1.5 %"),
        (0.90, 0.94, gate.PASS, "gate: pass: no slowdown of 5 % or more"),
        (1.00, 1.04, gate.PASS, "gate: pass: no slowdown of 5 % or more: at most 3.5 %"),  # slower, by less
        (1.00, 1.08, gate.UNKNOWN, "gate: cannot tell: this run can only see 7.0 % or more: more processes, a quiet"),
        (0.80, 1.60, gate.UNKNOWN, "gate: cannot tell: this run can only see 50 % or more: more processes, a quiet"),
        (1.07, 1.11, gate.FAIL, "gate: fail: slower by more than 5 %: cpp, comparison: slower: 1.090 [1.075, 1.105] ×"),
    ],
)
def test_the_interval_decides(held, low, high, verdict, line):
    """The interval of nine ratios is from the second to the eighth."""
    found = held(ratios(low, high), np.ones(9))
    assert found.verdict == verdict and gate.line([found]).startswith(line)
    assert (verdict == gate.PASS) == (gate.details([found]) == [])


def test_noise_that_no_interval_has(held):
    """The A/A pair of the run differs by 20 %, so that a ratio of 1.09 is not resolved."""
    (row,) = [versions.Held("a", "b", e, "slower", "", False, True, None, 0.2) for e in [estimate(1.07, 1.09, 1.11)]]
    found = gate._of_ratio("a", row.ratio, 5, row.floor)
    assert found.verdict == gate.UNKNOWN and found.sees == 0.2
    assert gate._of_ratio("a", row.ratio, 5, 0.05).verdict == gate.FAIL


def estimate(low, value, high):
    return Estimate(value, low, high, 9)


@pytest.mark.parametrize("share, text", [(0.0501, "5.1 %"), (0.05, "5.0 %"), (0.512, "52 %"), (1.23, "130 %")])
def test_what_is_seen_is_rounded_up(share, text):
    assert gate._up(share) == text


def test_no_comparison_is_no_pass(held, bad):
    few = held(np.ones(4), np.ones(4))
    assert few.verdict == gate.UNKNOWN and "no interval from 4 processes" in gate.line([few])
    wrong = {"status": "wrong picture", "reason": "it is off"}
    assert held(np.ones(6), np.ones(6), later=wrong).verdict == gate.FAIL  # it was right before
    before = held(np.ones(6), np.ones(6), earlier=wrong)  # there is nothing to hold it against
    assert before.verdict == gate.UNKNOWN and "no cell could be compared" in gate.line([before])
    assert gate.of_versions([], 5).verdict == gate.UNKNOWN


def test_several_gates():
    """The worst counts: who fails is not told that another cannot tell."""
    fail, unknown, passed = (
        gate.Gate([gate.Answer(word, word)], "all well") for word in (gate.FAIL, gate.UNKNOWN, gate.PASS)
    )
    assert gate.line([passed, unknown, fail]) == "gate: fail: fail"
    assert gate.line([passed, unknown]) == "gate: cannot tell: cannot tell"
    assert gate.line([passed, passed]) == "gate: pass: all well; all well"


# --- A machine on which another program has each core for half of the time, in turns ---


def interrupted(rng, work_ms, count):
    """The wall times (s) of frames of so much work, of a process that has the core in turns of about TURN."""
    times, left = [], rng.uniform(0, TURN)
    for _ in range(count):
        due, wall = work_ms, 0.0
        while due > left:
            wall, due = wall + left + rng.normal(TURN, TURN / 10), due - left
            left = rng.normal(TURN, TURN / 10)
        left -= due
        times.append((wall + due) / 1e3)
    return times


def busy(rng, work_ms, processes=20, frames=100):
    """Frames, and the CPU time of one, of so many processes: the work, and 2 % of noise."""
    works = work_ms * np.exp(rng.normal(0, 0.02, processes))
    return [interrupted(rng, work, frames) for work in works], works / 1e3


@pytest.mark.parametrize("work, side, shown", [(3.3, "below", 1.06), (4.3, "above", 1.33)])
def test_verdicts_on_a_busy_machine(work, side, shown):
    """20 pairs that are equal and 20 with 10 %: by CPU and by mean times none is false, and CPU times nearly always
    tell. The interval of medians leaves the truth out. A frame of 3.3 ms is mostly interrupted once, as is one of 10 %
    more: the time of the other program hides a part of them. Of 4.3 ms, the longer ones are mostly interrupted twice.
    """
    seed = 3
    rng, verdicts, outside, medians = np.random.default_rng(seed), Counter(), Counter(), []
    for _ in range(20):
        for factor in (1.0, 1.1):
            (above, cpu), (below, cpu_below) = busy(rng, work * factor), busy(rng, work)
            sides = {
                "median": (np.median(above, axis=1), np.median(below, axis=1)),
                "mean": (np.mean(above, axis=1), np.mean(below, axis=1)),
                "cpu": (cpu, cpu_below),
            }
            for kind, times in sides.items():
                ratio = statistics.ratio(*times, paired=True)
                verdicts[kind, factor, gate._of_ratio("", ratio, 5, None).verdict] += 1
                if (kind, factor) == ("median", 1.1):
                    medians.append(ratio.value)
                if not ratio.low <= factor <= ratio.high:
                    outside[kind, factor, "below" if ratio.high < factor else "above"] += 1
    told = seed, verdicts, outside
    assert outside["median", 1.1, side] >= 10 and abs(np.median(medians) - shown) < 0.01, (told, np.median(medians))
    assert sum(count for (kind, *_), count in outside.items() if kind == "cpu") <= 5, told  # of 40, at 95 %
    assert sum(count for (kind, *_), count in outside.items() if kind == "mean") <= 5, told
    assert not any(verdicts[kind, 1.0, gate.FAIL] + verdicts[kind, 1.1, gate.PASS] for kind in ("mean", "cpu")), told
    assert min(verdicts["cpu", 1.0, gate.PASS], verdicts["cpu", 1.1, gate.FAIL]) >= 19, told


@pytest.mark.parametrize("factor, verdict", [(1.0, gate.PASS), (1.1, gate.FAIL)])
def test_a_run_on_a_busy_machine(held, run, factor, verdict):
    seed = 4
    rng = np.random.default_rng(seed)
    (above, cpu), (below, cpu_below) = (busy(rng, 4.0 * scale) for scale in (factor, 1.0))
    assert held(above, below, (cpu, cpu_below), BUSY, BUSY).verdict == verdict, seed
    (row,) = versions.comparisons(results.load(run(above, below, (cpu, cpu_below), BUSY, BUSY, name="again")))
    assert re.fullmatch(
        r".* × the CPU time of cpp@old \(wall time: [^()]*\), as other programs used the processor", row.text
    )
    (row,) = versions.comparisons(results.load(run(above, below, (None, None), BUSY, BUSY, name="unknown")))
    assert row.witness.column == repetition.MEAN and " × the mean time of cpp@old, as other " in row.text


def test_cpu_time_speaks_for_one_thread(run, record):
    two = {"parameters": record("cpp")["parameters"] | {"threads": 2}, **BUSY}
    (row,) = versions.comparisons(results.load(run(np.ones(9), np.ones(9), (np.ones(9), np.ones(9)), two, two)))
    assert row.witness.column == repetition.MEAN
    (row,) = versions.comparisons(
        results.load(run(np.ones(9), np.ones(9), ([*[None] * 5, *[1.0] * 4], np.ones(9)), BUSY, BUSY, name="unknown"))
    )
    assert row.witness.column == repetition.MEAN


def test_a_slowdown_that_takes_no_cpu_time(held):
    """Frames that wait 20 % longer: the CPU time alone would let them pass."""
    seconds = np.ones(9), np.ones(9)
    found = held(ratios(1.19, 1.21), np.ones(9), seconds, BUSY, BUSY)
    assert found.verdict == gate.UNKNOWN and "CPU time and wall time disagree" in gate.line([found])
    assert held(ratios(1.0, 1.3), np.ones(9), seconds, BUSY, BUSY, name="wide").verdict == gate.PASS


def test_few_disturbed_processes_change_nothing(run, record, make_run):
    rows = [
        record(variant, number, **(BUSY if number < 4 else {}), **({} if variant == "cpp" else OTHER))
        for variant in ("cpp", "cpp@old")
        for number in range(9)
    ]
    (row,) = versions.comparisons(results.load(make_run(rows, against=AGAINST)))
    assert row.witness.column == repetition.STEADY and "as " not in row.text


# --- Two runs, and the machine between them ---


@pytest.fixture
def pair(run):
    """A function that makes two runs of two versions of cpp, beside a renderer that has not changed, and compares them.

    drifted: the time of that one in the second run, over that in the first.
    """

    def make(factor, drifted=1.0, changes=None):
        times, same, made = ratios(0.99, 1.01), np.ones(9), []
        for number, (version, scale, still) in enumerate((("v", 1.0, 1.0), ("w", factor, drifted))):
            later = {"renderer_version": version, **(changes or {})}
            facts = {"variants": ("cpp", "still"), "against": [], "name": f"{factor}-{drifted}-{number}"}
            made.append(run(scale * times, still * same, later=later, earlier=changes, **facts))
        return made

    return make


@pytest.mark.parametrize(
    "factor, drifted, line",
    [
        (1.0, 1.0, "gate: pass: no slowdown of 5 % or more: at most "),
        (1.1, 1.0, "gate: fail: slower by more than 5 %: cpp, comparison"),
        (1.04, 1.0, "gate: cannot tell: this run can only see 5."),
        (1.0, 1.3, "gate: cannot tell: this run can only see 32 % or more: more processes, a quiet machine, or"),
        (1.1, 1.3, "gate: cannot tell: this run can only see 4"),
        (2.0, 1.3, "gate: fail: slower by more than 5 %: cpp, comparison"),
    ],
)
def test_the_drift_between_two_runs(pair, factor, drifted, line):
    assert gate.line([gate.of_comparison(compare.compare(*pair(factor, drifted)), 5)]).startswith(line)


def test_the_terminal_ends_with_the_verdict(pair):
    done = command_line.rayrace("compare", *pair(1.0, 1.3), "--fail-slower", "5", code=2)
    assert done.stdout.splitlines()[-1].startswith("gate: cannot tell: this run can only see 32 % or more: ")
    assert done.stderr.startswith("slower by 5 % or not: cpp, comparison; only 32 % or more could be seen")


def test_two_runs_on_a_busy_machine_say_so(pair):
    done = command_line.rayrace("compare", *pair(1.1, changes=BUSY), "--fail-slower", "5", code=1)
    assert " of mean time, as other programs used the processor" in done.stdout


def test_json_stays_json(pair):
    done = command_line.rayrace("compare", *pair(1.0), "--fail-slower", "5", "--json", code=0)
    assert done.stdout.lstrip().startswith("{") and "gate: pass" not in done.stdout
    assert done.stderr.splitlines()[-1].startswith("gate: pass: ")


# --- What the report says ---


@pytest.mark.parametrize(
    "low, high, line",
    [(0.99, 1.01, "Gate: pass: "), (1.19, 1.21, "Gate: fail: slower"), (0.9, 1.3, "Gate: cannot tell: this run can")],
)
def test_the_report_begins_with_the_verdict(run, low, high, line):
    from reports.summary import glance

    limits = {"slower_percent": 5.0, "budget": None}
    loaded = results.load(run(ratios(low, high), np.ones(9), gate=limits))
    lead = glance.write(loaded).split("\n\n")[1].replace("\\", "")
    assert lead.startswith(line) and " This version: cpp, comparison: " in lead
    assert not glance.write(results.load(run(np.ones(9), np.ones(9), name="none"))).startswith("Gate")


def test_a_failed_repetition_fails_its_gate(run, bad):
    loaded = results.load(run(np.ones(9), np.ones(9)))
    limits = {"slower_percent": 5.0, "budget": None}
    assert gate.verdict(gate.of(loaded, limits)) == gate.PASS
    loaded.records.append(bad("cpp", "failed", "exit 1"))
    assert gate.line(gate.of(loaded, limits)) == "gate: fail: 1 repetition failed"
    assert gate.of(loaded, None) == []


def test_a_stored_gate_that_is_none(run):
    loaded = results.load(run(np.ones(9), np.ones(9)))
    with pytest.raises(UserError, match=re.escape("run.json")):
        gate.of(loaded, {"slower_percent": None, "budget": {"percent": "x"}})


def test_compare_needs_what_was_right(pair):
    comparison = compare.compare(*pair(1.0))
    assert gate.of_comparison(comparison, 5).verdict == gate.PASS
    assert gate.of_instructions(comparison, 1).verdict == gate.UNKNOWN
