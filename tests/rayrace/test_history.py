"""`rayrace history`: what each commit makes of a renderer's instructions, and where they step."""

import json
import math

import numpy as np
import pandas as pd
import pytest
from compilers import compiler
from pages import blocks
from repositories import git

from harness.errors import UserError
from harness.renderer import registry, versions
from harness.statistics.statistics import Estimate
from harness.system import counters
from rayrace.history import halves
from reports.compare import history
from reports.run.missing import Missing

SCENE = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\nBACKGROUND (0.2,0.5,0.7)\n"
FRAME = "double begin = now();"
LOOP = '    for (long turn = 0; turn < {}; turn++) __asm__ volatile("");'
NONE = Missing("it was not measured")


@pytest.fixture
def tree(tmp_path):
    """A repository with a renderer in C, called mine."""
    compiler("c")
    mine = tmp_path / "tree" / "mine"
    mine.mkdir(parents=True)
    manifest = blocks("adding-a-renderer.md", "toml")[1]
    (mine / "renderer.toml").write_text(manifest.replace('"flat-c"', '"mine"'))
    git(tmp_path / "tree", "init", "-q")
    return tmp_path / "tree"


def commit(tree, turns, subject, more=""):
    """Commits a renderer whose frames take so many turns of an empty loop; returns the hash."""
    (program,) = blocks("adding-a-renderer.md", "c")
    assert program.count(FRAME) == 1
    text = program.replace(FRAME, FRAME + LOOP.format(turns)) + f"/* {subject} */\n{more}"
    (tree / "mine" / "flat.c").write_text(text)
    git(tree, "add", ".")
    git(tree, "commit", "-qm", subject)
    return git(tree, "rev-parse", "HEAD").strip()


@pytest.fixture
def ask(tree, experiment, rayrace, tmp_path):
    """Calls `rayrace history` for the span; its JSON."""
    if isinstance(why := counters.find(), str):
        pytest.skip(why)
    small = "--experiment", experiment(["python"], "[measure]\ncount = true\n", scene=SCENE, size=20)

    def ask(span, *more):
        done = rayrace(
            "history", "mine", "--commits", span, *small, "--renderer", tree / "mine", "--json", *more, code=0
        )
        print(done.stderr)
        return json.loads(done.stdout)

    return ask


@pytest.mark.slow
def test_a_slowdown_is_found_at_its_commit(tree, ask, tmp_path):
    first = commit(tree, 1_000_000, "first")
    names = "a comment", "it does not compile", "five per cent more", "another comment"
    turns = 1_000_000, 1_000_000, 1_050_000, 1_050_000
    broken = "#error broken on purpose\n"
    hashes = [commit(tree, count, name, broken * (name == names[1])) for count, name in zip(turns, names, strict=True)]
    told = ask(f"{first}..HEAD", "--out", tmp_path / "history")
    assert [point["commit"] for point in told["points"]] == [first, *hashes]
    assert [point["subject"] for point in told["points"]] == ["first", *names]
    counts = [point["instructions"] for point in told["points"]]
    assert counts[2] is None and "broken on purpose" in told["points"][2]["no_instructions"]
    (step,) = told["steps"]
    assert (step["before"], step["after"], step["of"]) == (hashes[0], hashes[2], "instructions")
    assert step["ratio"] == pytest.approx(1.05, abs=0.005)
    table = pd.read_csv(tmp_path / "history" / "history.csv")
    assert list(table["commit"]) == [first, *hashes]
    assert (tmp_path / "history" / "history.svg").stat().st_size > 1000
    kept = {path: path.read_text() for path in (tmp_path / "history").glob("*/repetitions.jsonl")}
    again = ask(f"{first}..HEAD", "--resume", tmp_path / "history")
    assert again["points"] == told["points"] and len(kept) >= 4
    assert {path: path.read_text() for path in kept} == kept


@pytest.mark.slow
def test_a_span_is_halved(tree, ask, tmp_path):
    """Of nine commits the first, the middle and the last, and then those around the step."""
    hashes = [commit(tree, 1_000_000 if number < 6 else 800_000, f"number {number}") for number in range(9)]
    told = ask(f"{hashes[0]}..HEAD", "--at-most", 3, "--out", tmp_path / "history")
    (step,) = told["steps"]
    assert (step["before"], step["after"]) == (hashes[5], hashes[6]) and step["ratio"] == pytest.approx(0.8, abs=0.01)
    assert {point["commit"] for point in told["points"]} == {hashes[n] for n in (0, 4, 8, 6, 5)}


@pytest.mark.parametrize("own", ["", '[count.x86_64]\noptions = ["-mno-own"]\n'])
def test_a_version_from_before_the_counts_is_counted_as_today(tree, tmp_path, own):
    today = '[count.x86_64]\noptions = ["-mno-avx512f"]\n'
    folders = {}
    for name, more in (("then", own), ("now", today)):
        folders[name] = tmp_path / name / "mine"
        folders[name].mkdir(parents=True)
        text = (tree / "mine" / "renderer.toml").read_text()
        (folders[name] / "renderer.toml").write_text(text.replace("\n[build]", f"\n{more}[build]"))
    entry = registry.entries((folders["now"],))["mine"]
    other = versions.others(str(folders["then"]), [entry])["mine"]
    assert other.renderer.manifest.count["x86_64"].options == (("-mno-own",) if own else ("-mno-avx512f",))


def points(values, of="instructions"):
    found = []
    for number, value in enumerate(values):
        time = Estimate(value, value / 1.02, value * 1.02, 5) if of == "time" else NONE
        count = value if of == "instructions" else NONE
        found.append(history.Point(f"{number:040x}", "", f"commit {number}", "scene", count, time))
    return found


@pytest.mark.parametrize("of, noise", [("instructions", 5e-4), ("time", 0.01)])
def test_steps_are_found_and_noise_is_none(of, noise):
    """A step of 5 % of the instructions, or of 20 % of times, at a random commit; none without.

    One history in some 300 has a step of noise (EXPLAINS), before or beside the true one: so 5 of 100 may.
    """
    seed = np.random.SeedSequence().entropy
    print("seed", seed)
    rng, factor, false = np.random.default_rng(seed), {"instructions": 1.05, "time": 1.2}[of], 0
    beside = 0
    for _ in range(100):
        values = 1e8 * np.exp(rng.normal(0, noise, 15))
        false += bool(history.steps(points(values, of), 0.01))
        at = int(rng.integers(1, 15))
        values[at:] *= factor
        found = history.steps(points(values, of), 0.03)
        places = [int(one.after.commit, 16) for one in found]
        assert at in places and all(one.of == of for one in found)
        beside += len(places) > 1
        if len(places) == 1:
            assert found[0].ratio == pytest.approx(factor, rel=4 * noise)
    assert false <= 5 and beside <= 5


def test_a_step_is_where_the_nearest_measured_commits_are():
    """What was not measured is passed over; instructions decide where there are any."""
    mine = points([1.0, math.nan, 1.0, 1.5])
    mine[1] = history.Point(mine[1].commit, "", "", "scene", NONE, NONE)
    (step,) = history.steps(mine, 0.01)
    assert (step.before, step.after) == (mine[2], mine[3]) and step.time is None
    assert "+50 % instructions (scene)" in step.text


def test_halves():
    commits = [versions.Commit(f"{number:040x}", "", "") for number in range(9)]
    mine = points(range(9))
    step = history.Step("scene", mine[2], mine[8], "instructions", 2.0, None)
    assert halves(commits, dict.fromkeys((0, 2, 8)), [step]) == [5]
    assert halves(commits, dict.fromkeys((0, 2, 5, 8)), [step]) == [6]
    assert halves(commits, dict.fromkeys(range(9)), [step]) == []


def test_wrong_spans(tree):
    (tree / "other").mkdir()
    commit(tree, 1, "first")
    (tree / "other" / "file").write_text("1")
    git(tree, "add", ".")
    git(tree, "commit", "-qm", "elsewhere")
    entry = registry.entries((tree / "mine",))["mine"]
    for span, why in {
        "HEAD": "expected two commits",
        "HEAD...HEAD": "expected two commits",
        "nothing..HEAD": "has no commit nothing",
        "HEAD~1..HEAD": "none of them changes",
    }.items():
        with pytest.raises(UserError, match=why):
            versions.commits(span, entry)
    last = commit(tree, 2, "second")
    assert [(one.subject, one.hash == last) for one in versions.commits("HEAD~1..HEAD", entry)] == [
        ("first", False), ("second", True),
    ]  # fmt: skip
