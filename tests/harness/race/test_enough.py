"""A run that ends when its ratios are known well enough: by a rule whose intervals still cover the truth."""

from types import SimpleNamespace

import numpy as np
import pytest
import seeds

from harness.race import enough
from harness.statistics import statistics

UNTIL, MOST = 0.02, 400


def lognormal(rng, shape):
    return np.exp(rng.normal(0, 0.05, shape))


def shifted(rng, shape):
    """Times of which none is below a best one."""
    return 1 + 0.05 * rng.exponential(size=shape)


NOISES = {"lognormal": lognormal, "shifted": shifted}


def coverage(noise, runs, seed):
    """The share of simulated runs whose interval at the end holds the true ratio, 1; and their rounds."""
    rng, held, rounds = np.random.default_rng(seed), 0, []
    for _ in range(runs):
        above, below = NOISES[noise](rng, (2, MOST))

        def estimate(count, above=above, below=below):
            return statistics.ratio(above[:count], below[:count], paired=True)

        count = enough.end(MOST, UNTIL, lambda count, estimate=estimate: [estimate(count)]) or MOST
        found = estimate(count)
        held += found.low <= 1 <= found.high
        rounds.append(count)
    return held / runs, rounds


@pytest.mark.parametrize("noise", NOISES)
def test_intervals_hold_though_the_run_ends_when_they_are_narrow(noise):
    """2,500 runs: within 4 standard errors of 94 to 96 %; 10,000 by night."""
    seed = seeds.numbers("enough", noise)
    share, rounds = coverage(noise, 2500, seed)
    assert 0.94 - 0.019 < share < 0.96 + 0.016, (seed, share)
    assert 20 < np.median(rounds) < MOST


@pytest.mark.nightly("the same with 2,500 runs is in CI")
@pytest.mark.parametrize("noise", NOISES)
def test_in_ten_thousand_runs(noise):
    seed = seeds.numbers("enough by night", noise)
    share, _ = coverage(noise, 10_000, seed)
    assert 0.94 - 0.002 < share < 0.96 + 0.002, (seed, share)  # a standard error


def test_looks():
    assert enough.looks(19) == [] and enough.looks(20) == [20] and enough.looks(70) == [20, 25, 32, 40, 50, 63]


def plan_of(*cells, against=()):
    """A plan of cells (variant, processes), each its own key."""
    made = [
        SimpleNamespace(
            key=name, entry=SimpleNamespace(name=name), scene="a.txt", point={}, processes=processes, refused=None
        )
        for name, processes in cells
    ]
    return SimpleNamespace(cells=made, against=against)


def rows_of(times):
    """The rows of cells whose frames take such times, by variant."""
    return [
        {"cell": name, "pass": "timed", "repetition": n, "status": "ok", "unranked": None, "frames_s": [9.0, t, t]}
        for name, mine in times.items()
        for n, t in enumerate(mine)
    ]


def test_a_run_ends_at_the_second_look_that_finds_all_ratios_narrow():
    noise = np.tile([0.99, 1.01], 50)
    plan = plan_of(("cpp", 100), ("numba", 100))
    calm, wild = {"cpp": noise, "numba": 2 * noise}, {"cpp": noise, "numba": noise[::-1] ** 8}
    for count, rounds in ((20, None), (24, None), (25, 25), (60, 25)):
        assert enough.rounds(UNTIL, plan, rows_of({name: mine[:count] for name, mine in calm.items()})) == rounds
    assert enough.rounds(UNTIL, plan, rows_of(wild)) is None
    assert enough.rounds(None, plan, rows_of(calm)) is None


def test_versions_are_held_against_each_other():
    """Both are within 2 % of cpp's time, and not of each other's."""
    noise = np.tile([0.985, 1.015], 50)
    times = {"cpp": np.ones(100), "numba": noise, "numba@old": 1 / noise}
    cells = [(name, 100) for name in times]
    assert enough.rounds(UNTIL, plan_of(*cells), rows_of(times)) == 25
    assert enough.rounds(UNTIL, plan_of(*cells, against=[("numba", "numba@old")]), rows_of(times)) is None


def test_a_cell_of_fewer_processes_does_not_count_and_one_that_is_behind_does():
    noise = np.tile([0.99, 1.01], 50)
    plan = plan_of(("cpp", 100), ("numba", 100), ("python", 2))
    times = {"cpp": noise, "numba": noise, "python": [1.0, 3.0]}
    assert enough.rounds(UNTIL, plan, rows_of(times)) == 25
    assert enough.rounds(UNTIL, plan, rows_of(times | {"numba": noise[:24]})) is None


@pytest.mark.alone
def test_a_run_of_the_command_line(rayrace, experiment, rows, tmp_path):
    """It ends at a look, and nothing is left to be resumed."""
    file = experiment(["python"], '[measure]\nuntil = "95 %"\npair = "off"\n', processes=60)
    done = rayrace("run", file, "--out", tmp_path / "run", "--report", code=0)
    count = len(rows(tmp_path / "run")["python"])
    assert count in enough.looks(59) and "are left" not in done.stdout
    text = (tmp_path / "run" / "report" / "report.md").read_text()
    assert f"It ended after {count} rounds: every ratio's interval is within 95 % of it (until)." in text
    again = rayrace("run", file, "--resume", tmp_path / "run", code=0)
    assert len(rows(tmp_path / "run")["python"]) == count and "are left" not in again.stdout


@pytest.mark.parametrize(
    "text, message",
    [
        ('until = "2"', 'expected per cent such as "2 %"'),
        ("until = 2", 'expected per cent such as "2 %"'),
        ('until = "0 %"', "greater than 0"),
    ],
)
def test_wrong_use(rayrace, experiment, text, message):
    done = rayrace("run", experiment(["python"], f"[measure]\n{text}\n"), code=2)
    assert message in done.stderr and "until" in done.stderr


def test_not_in_sequence_and_not_on_a_cluster(rayrace, experiment):
    until = '[measure]\nuntil = "2 %"\n'
    done = rayrace("run", experiment(["python"], 'order = "sequential"\n' + until), code=2)
    assert "measure.until: not with order sequential" in done.stderr
    done = rayrace("run", experiment(["python"], until), "--executor", "slurm", code=2)
    assert "measure.until: of a run here" in done.stderr
