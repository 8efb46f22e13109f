"""Verdicts: each word from made-up runs, and the study's claims, whose cells their experiments must have."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from harness.experiment import experiment
from harness.plan import plan
from reports.study import claims, page, verdict
from reports.study.claims import Claim

REPOSITORY = Path(__file__).parents[3]
NUMBERED = (
    *("table 2.1", "figure 2.5", "figure 2.6", "figure 2.7", "figure 2.8", "figure 2.9", "figure 2.10", "figure 2.11"),
    *("equation 2.21", *(f"figure 3.{n}" for n in range(1, 7)), "equation 4.1", "table 4.1", "table 4.2"),
    *("figure 4.1", "figure 4.2", "figure 4.3"),
)
ALL = [claim for chapter in claims.chapters() for claim in chapter.claim]


TIME, PICTURE, GROWTH = "time of a frame", "picture", "growth of the time of a frame"
SLOW_FAST = {"above": {"variant": "slow"}, "below": {"variant": "fast"}}


def claim(**changes):
    rule = next((name for name in claims.RULES if name in changes), "")
    quantity = {"ratio": TIME, **dict.fromkeys(("agree", "differ", "apart"), PICTURE)}.get(rule, "")
    return Claim(**{"place": "4", "says": "s", "run": "r", "why": "w", "quantity": quantity} | changes)


@pytest.fixture
def run(load, cell):
    """Two variants, of which one takes 4 times as long; the errors 0.2 and 0.1."""
    slow = cell("slow", [4.0, 4.1, 4.2, 3.9, 4.0, 4.0], 0.2)
    return load([*slow, *cell("fast", [1.0, 1.0, 1.0, 1.0, 1.0, 1.1], 0.1)])


@pytest.mark.parametrize(
    ("rule", "expected"),
    [
        ({"least": 3}, "true"), ({"most": 5, "least": 3.5}, "true"), ({"least": 5}, "false"), ({"most": 3}, "false"),
        ({"least": 4.0}, "not decided"), ({"most": 4.0}, "not decided"),
    ],
)  # fmt: skip
def test_a_ratio_of_times(run, rule, expected):
    ratio = {"above": {"variant": "slow"}, "below": {"variant": "fast"}}
    found = verdict.decide(claim(ratio=ratio, **rule), run)
    assert found.verdict == expected and found.measured.startswith("4.0") and found.measured.endswith("×")


@pytest.mark.parametrize(
    ("rule", "expected"),
    [
        ({"least": 2.0}, "true"),
        ({"least": 3.9}, "not decided"),
        ({"most": 4.1}, "not decided"),
        ({"most": 2.0}, "false"),
    ],
)
def test_a_ratio_of_too_few_processes_is_a_first_look(load, cell, rule, expected):
    few = load([*cell("slow", [4.0, 4.1], 0.2), *cell("fast", [1.0, 1.0], 0.1)])
    ratio = {"above": {"variant": "slow"}, "below": {"variant": "fast"}}
    found = verdict.decide(claim(ratio=ratio, **rule), few)
    assert found.verdict == expected and "no interval, n = 2" in found.measured
    one = {"above": {"variant": "slow"}, "below": {"variant": "slow"}, "column": "steady_s", "over": "steady_s"}
    share = claim(ratio=one | {"column": "kernel_s"}, least=0.9, quantity="the kernel's share of a frame")
    assert verdict.decide(share, few).verdict == "unavailable"  # a renderer without a kernel


def test_errors_factors_and_exponents(run):
    sides = {"above": {"variant": "slow"}, "below": {"variant": "fast"}}
    errors = claim(ratio={**sides, "column": "error_rmse"}, least=1.9, most=2.1, quantity="error")
    found = verdict.decide(errors, run)
    assert (found.verdict, found.measured) == ("true", "2.00 ×")
    assert verdict.decide(claim(ratio={**sides, "times": 100.0}, least=350, most=450), run).verdict == "true"
    exponent = {**sides, "column": "error_rmse", "power": 2.0, "unit": "as exponent"}
    growth = claim(ratio=exponent, least=0.9, most=1.1, quantity="growth of the error")
    assert verdict.decide(growth, run).verdict == "true"


def test_the_growth_of_time_is_a_slope_over_all_cells(load, cell):
    """12 s for 6 objects and 3 lights, and four times as long for twice as many: the exponent of o + l is 2."""
    rows = [
        row
        for objects, lights, time in ((6, 3, 1.0), (12, 6, 4.0), (24, 12, 16.0), (24, 3, 99.0))
        for row in cell("cpp", [time] * 5, 0.1, objects=objects, lights=lights)
    ]
    for row in rows:
        row["point"] = {name: row["point"][name] for name in ("objects", "lights")}
    found = load(rows)
    growth = {"cells": {"variant": "cpp", "lights": {"not": 99}}, "along": "objects"}
    few = claim(growth={"cells": {"variant": "none"}, "along": "objects"}, least=0.8, quantity=GROWTH)
    assert verdict.decide(few, found).measured == "unavailable: the run has 0 such cells"
    rows = [row for row in rows if (row["point"]["objects"], row["point"]["lights"]) != (24, 3)]
    exponent = claim(growth=growth, least=1.99, most=2.01, quantity=GROWTH)
    decided = verdict.decide(exponent, load(rows, name="three"))
    assert decided.verdict == "true" and decided.measured.endswith(" as exponent")


def test_what_is_missing_has_a_reason(run):
    ratio = {"above": {"variant": "slow"}, "below": {"variant": "none"}}
    assert verdict.decide(claim(ratio=ratio, least=1), run).measured == "unavailable: the run has 0 such cells"
    found = verdict.decide(claim(ratio=ratio, least=1), None)
    assert found.measured == "unavailable: no committed run of experiments/r.toml"
    untestable = claim(run="", untestable="a matter of taste")
    assert verdict.decide(untestable, run) == verdict.Decided("not testable here", "a matter of taste")


def test_pictures(load, cell, record):
    agreed = record("a")["agreement"]
    rows = [*cell("a", [1.0], 0.1), *cell("b", [1.0], 0.1)]
    sides = {"first": {"variant": "a"}, "other": {"variant": "b"}}
    found = load(rows)
    assert verdict.decide(claim(agree={}), found) == verdict.Decided("true", "2 of 2 pictures agree")
    assert verdict.decide(claim(differ={}), found).verdict == "false"
    assert verdict.decide(claim(apart=sides, least=0.01), found).verdict == "false"
    file = rows[1]["picture"]["file"]
    picture = np.load(found.folder / file)
    picture[0, 0] += 0.5
    apart = verdict.decide(claim(apart=sides, least=0.01), load(rows, name="apart", files={file: picture}))
    assert apart == verdict.Decided("true", "6.2 % of the pixels differ")
    rows[1]["agreement"] = agreed | {"wrong": "1 pixel is off"}
    other = load(rows, name="wrong")
    assert verdict.decide(claim(agree={}), other) == verdict.Decided("false", "1 of 2 pictures agree")


def test_gains_shares_of_cores_and_the_lowest_of_several(run):
    cores = run.facts["environment"]["cores"]["usable"]
    gain = {**SLOW_FAST, "gain": {"above": {"variant": "slow"}, "below": {"variant": "fast"}}}
    assert verdict.decide(claim(ratio=gain, least=0.99, most=1.01), run).verdict == "true"  # 4 over 4
    each = {**SLOW_FAST, "per_core": True}
    share = claim(ratio=each, least=3.5 / cores, most=4.5 / cores, quantity="speed-up for each core")
    assert verdict.decide(share, run).verdict == "true"
    lowest = {"above": {"variant": "slow"}, "below": {}, "lowest": True}  # of both variants the fast one
    assert verdict.decide(claim(ratio=lowest, least=3.5, most=4.5), run).verdict == "true"
    others = {"above": {"variant": "slow"}, "below": {"variant": {"not": "slow"}}}
    assert verdict.decide(claim(ratio=others, least=3.5, most=4.5), run).verdict == "true"


def test_counts_and_light(load, cell):
    rows = cell("table", [1.0], 0.1)
    rows[0]["used"] = {"features": [], "methods": {"walk_rows": 2047}}
    rows[0]["rays"] = {"primary": 4, "reflected": 12, "transmitted": 0, "shadow": 0, "non_finite": 0}
    more = cell("more", [1.0], 0.1)
    more[0]["rays"] = {"primary": 4, "reflected": 48, "transmitted": 0, "shadow": 0, "non_finite": 0}
    found = load([*rows, *more], files={rows[0]["picture"]["file"]: np.full((4, 4, 3), 0.25)})
    value = {"cell": {"variant": "table"}, "column": "walk_rows", "unit": "rows"}
    table = claim(value=value, least=2047, most=2047, quantity="rows of the table of rays")
    assert verdict.decide(table, found) == verdict.Decided("true", "2047 rows")
    ratio = {"above": {"variant": "more"}, "below": {"variant": "table"}, "column": "reflected", "power": 2.0}
    rays = claim(ratio=ratio | {"unit": "as exponent"}, least=2.0, most=2.0, quantity="growth of the number of rays")
    assert verdict.decide(rays, found) == verdict.Decided("true", "2 as exponent")
    value = {"cell": {"variant": "table"}, "column": "mean_light", "unit": "of the light"}
    light = claim(value=value, most=0.99, quantity="energy")
    assert verdict.decide(light, found) == verdict.Decided("true", "0.25 of the light")


def test_cores_are_those_of_the_phase_and_not_of_the_process(load, cell):
    """One core while it compiles for 8 s, two while it renders for 1 s: the mean of the process is neither."""
    rows = cell("numba-parallel", [1.0] * 5, 0.1)
    for row in rows:
        row["phases"] = [["compile", 0.0, 8.0], ["render", 8.0, 9.0]]
        row["series"] = "series/one.csv"
        row["cpu"] = {"user_s": 10.0, "system_s": 0.0}
    found = load(rows)
    times = np.arange(0.0, 9.01, 0.1)
    spent = np.where(times <= 8.0, times, 8.0 + 2 * (times - 8.0))
    (found.folder / "series").mkdir(exist_ok=True)
    lines = "\n".join(f"{t},{cpu}" for t, cpu in zip(times, spent, strict=True))
    (found.folder / "series" / "one.csv").write_text(f"t,cpu_s\n{lines}\n")

    def busy(phase):
        cores = {"cell": {"variant": "numba-parallel"}, "phase": phase}
        return verdict.decide(claim(cores=cores, least=1.8, quantity="cores in a phase"), found)

    assert busy("render").verdict == "true" and busy("render").measured.startswith("2.0")
    assert busy("compile").verdict == "false" and busy("compile").measured.startswith("1.0")
    assert busy("upload").verdict == "unavailable"


RATIO = {"ratio": SLOW_FAST, "least": 1.0}
SELF = {"above": {"variant": "slow"}, "below": {"variant": "slow"}}


@pytest.mark.parametrize(
    "changes",
    [
        RATIO | {"quantity": "error"},
        RATIO | {"quantity": "rows of the table of rays"},
        RATIO | {"quantity": "picture"},
        RATIO | {"quantity": "cores in a phase"},
        RATIO | {"quantity": "growth of the time of a frame"},
        RATIO | {"quantity": "speed-up for each core"},
        RATIO | {"quantity": "speed"},
        RATIO | {"quantity": ""},
        {"ratio": SELF | {"column": "cpu_s", "over": "wall_s"}, "least": 0.9, "quantity": "cores in a phase"},
        {"ratio": SELF, "least": 0.9, "quantity": TIME},
        {"ratio": SLOW_FAST | {"column": "kernel_s", "over": "steady_s"}, "least": 0.9, "quantity": TIME},
        {"ratio": SLOW_FAST | {"power": 2.0}, "least": 0.9, "quantity": TIME},
        {"agree": {}, "quantity": "error"},
        {"run": "", "untestable": "taste", "quantity": PICTURE},
    ],
)
def test_a_rule_that_measures_another_quantity_is_refused(changes):
    with pytest.raises(ValidationError, match=r"quantity|measured by|is of"):
        claim(**changes)


def test_each_quantity_and_its_columns_are_of_some_claim():
    used = {one.quantity for one in ALL} - {""}
    assert used == set(claims.QUANTITIES)
    pairs = {(one.quantity, one.columns) for one in ALL if one.columns}
    assert pairs == {(name, pair) for name, one in claims.QUANTITIES.items() for pair in one.columns}


def test_equation_4_1_is_decided_as_the_study_has_it(known):
    """Without shadows, and with every ray against every object."""
    growths = [one for one in ALL if one.quantity == GROWTH]
    assert {one.growth.along for one in growths} == {"side", "depth", "objects", "lights"}
    assert {one.place for one in growths} == {"4.1.1, equation 4.1"}
    for name in {one.run for one in growths}:
        cells = planned(name, known)
        for one in (one for one in growths if one.run == name):
            found = [cell for cell in cells if all(verdict.has(cell, *item) for item in one.growth.cells.items())]
            assert len({cell.swept[one.growth.along] for cell in found}) == len(found) >= 5
            assert {(cell.parameters["shadows"], cell.parameters["accel"]) for cell in found} == {(False, "none")}


def test_a_run_with_enough_processes_is_chosen_before_a_newer_one(load, cell):
    runs = {}
    for name, processes, started in (("old", 12, "2026-01-01"), ("new", 6, "2026-02-01")):
        rows = [*cell("slow", [4.0] * processes, 0.2), *cell("fast", [1.0] * processes, 0.1)]
        runs[name] = load(rows, name=name, experiment={"processes": processes})
        runs[name].facts["started"] = started

    def best(asked):
        return max(runs, key=lambda name: page._rank(runs[name], asked))

    assert best(asked=12) == "old" and best(asked=6) == "new"
    runs["old"].facts["experiment"]["processes"] = 13  # it was cut short
    assert best(asked=12) == "new"
    row = page._row(claim(ratio=SLOW_FAST, least=3.0), [("machine", runs["new"])], Counter())
    assert "r, machine, 6 processes" in row


@pytest.mark.parametrize(
    "changes",
    [{}, {"agree": {}, "untestable": "why"}, {"agree": {}, "least": 1.0}, {"run": "", "agree": {}}],
    ids=["nothing decides it", "two ways", "a bound without a number", "no run"],
)
def test_a_claim_that_nothing_or_two_things_decide_is_refused(changes):
    with pytest.raises(ValidationError):
        claim(**changes)


def test_every_table_and_figure_of_results_has_a_claim():
    places = [place.strip() for one in ALL for place in one.place.replace(";", ",").split(",")]
    assert [name for name in NUMBERED if name not in places] == []
    assert {"4.2.1", "4.2.2", "5"} <= set(places)


def planned(name, known):
    file = REPOSITORY / "experiments" / f"{name}.toml"
    return [Planned(cell) for cell in plan.make(experiment.load(file), file, known).cells]


@pytest.mark.parametrize("name", sorted({one.run for one in ALL} - {""}))
def test_the_cells_of_claims_are_planned(name, known):
    """One for each side of a number, and some for pictures: a verdict is not unavailable for a slip."""
    cells = planned(name, known)
    for one in ALL:
        if one.run != name:
            continue
        for wanted in one.sides:
            count = sum(all(verdict.has(cell, *item) for item in wanted.items()) for cell in cells)
            assert count >= 1 if one.ratio and one.ratio.lowest else count == 1, (one, wanted)
        wanted = one.agree if one.agree is not None else one.differ
        if one.growth:
            wanted = one.growth.cells
        if one.failing:
            wanted = {"stress": one.failing.row, **one.failing.cells}
        if wanted is not None:
            assert any(all(verdict.has(cell, *item) for item in wanted.items()) for cell in cells), one


class Planned:
    """A planned cell with the names of a reported one."""

    def __init__(self, cell):
        self.variant, self.scene, self.swept, self.parameters = (
            cell.entry.name, cell.scene, cell.point, cell.parameters.values()
        )  # fmt: skip


@pytest.mark.slow
def test_the_page_is_made_from_the_reference_results():
    """`python docs/study.py` makes it anew."""
    kept = (REPOSITORY / "docs" / "the-study.md").read_text("utf-8")
    assert page.write(REPOSITORY / "results" / "reference") == kept
