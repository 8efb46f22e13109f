"""Verdicts: each word from made-up runs, and the study's claims, whose cells their experiments must have."""

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


def claim(**changes):
    return Claim(**{"place": "4", "says": "s", "run": "r", "why": "w"} | changes)


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
    assert verdict.decide(claim(ratio=one, least=0.9), few).verdict == "true"  # nothing is compared


def test_errors_factors_and_exponents(run):
    sides = {"above": {"variant": "slow"}, "below": {"variant": "fast"}}
    found = verdict.decide(claim(ratio={**sides, "column": "error_rmse"}, least=1.9, most=2.1), run)
    assert (found.verdict, found.measured) == ("true", "2.00 ×")
    assert verdict.decide(claim(ratio={**sides, "times": 100.0}, least=350, most=450), run).verdict == "true"
    exponent = {**sides, "power": 2.0, "unit": "as exponent"}  # 4 times for twice as much
    assert verdict.decide(claim(ratio=exponent, least=1.8, most=2.2), run).verdict == "true"


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
    sides = {"one": {"variant": "a"}, "other": {"variant": "b"}}
    found = load(rows)
    assert verdict.decide(claim(agree={}), found) == verdict.Decided("true", "2 of 2 pictures agree")
    assert verdict.decide(claim(differ={}), found).verdict == "false"
    assert verdict.decide(claim(apart=sides, least=0.01), found).verdict == "false"
    picture = np.load(found.folder / rows[1]["picture"]["file"])
    picture[0, 0] += 0.5
    np.save(found.folder / rows[1]["picture"]["file"], picture)
    apart = verdict.decide(claim(apart=sides, least=0.01), found)
    assert apart == verdict.Decided("true", "6.2 % of the pixels differ")
    rows[1]["agreement"] = agreed | {"wrong": "1 pixel is off"}
    other = load(rows, name="wrong")
    assert verdict.decide(claim(agree={}), other) == verdict.Decided("false", "1 of 2 pictures agree")


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


@pytest.mark.parametrize("name", sorted({one.run for one in ALL} - {""}))
def test_the_cells_of_claims_are_planned(name, known):
    """One for each side of a ratio, and some for pictures: a verdict is not unavailable for a slip."""
    file = REPOSITORY / "experiments" / f"{name}.toml"
    cells = [Planned(cell) for cell in plan.make(experiment.load(file), file, known).cells]
    for one in ALL:
        if one.run != name:
            continue
        sides = (
            [one.ratio.above, one.ratio.below] if one.ratio else [one.apart.one, one.apart.other] if one.apart else []
        )
        for wanted in sides:
            assert sum(all(verdict._has(cell, *item) for item in wanted.items()) for cell in cells) == 1, (one, wanted)
        for wanted in filter(None, (one.agree, one.differ)):
            assert any(all(verdict._has(cell, *item) for item in wanted.items()) for cell in cells), one


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
