"""Several runs in one report: grouped by machine, never pooled, and the study's numbers from whichever run has them."""

import csv

import pytest
import report_tables

from harness.store import packed
from reports.compare import hosts, side_by_side
from reports.page import several, study_again
from reports.pictures import gallery_figure
from reports.run import results, study

TIMES = {"slow": (0.4, 0.41, 0.42, 0.43, 0.44, 0.45), "fast": (0.1, 0.11, 0.12, 0.13, 0.14, 0.15)}
SCENE = "scenes/comparison.txt"


@pytest.fixture
def environment(make_run, record):
    """A function that gives the environment of made-up runs, with what is other in it."""
    told = results.load(make_run([record("cpp")], name="any")).facts["environment"]
    return lambda **changes: {**told, **changes}


@pytest.fixture
def make(make_run, record, environment):
    """make(name, times, machine, ..): a run of cpp and numba, which takes twice as long; its folder."""

    def make(name, times="slow", scene_version="1", records=(), machine=None):
        told = [
            record(variant, n, frames=[9.0] + [times_ * time] * 3, scene_version=scene_version)
            for variant, times_ in (("cpp", 1), ("numba", 2))
            for n, time in enumerate(TIMES[times])
        ]
        return make_run([*told, *records], name=name, environment=environment(**(machine or {})))

    return make


def members(*folders):
    return hosts.members([(folder.name, results.load(folder)) for folder in folders])


def test_runs_are_grouped_by_machine(make):
    found = members(make("a"), make("b", machine={"host": "other"}), make("c"), make("d", machine={"cpu": "new"}))
    assert [(member.name, member.host) for member in found] == [
        ("a", "h, a processor"), ("c", "h, a processor"), ("b", "other"), ("d", "h, new"),
    ]  # fmt: skip


def test_names_are_never_shared(make, tmp_path):
    found = hosts.members([(name, results.load(make(f"r{n}"))) for n, name in enumerate(("a", "a", "a-2"))])
    assert [member.name for member in found] == ["a", "a-2", "a-2-2"]
    same = {"memory_bytes": 4e9}
    assert [one.host for one in members(make("x"), make("y", machine=same))] == ["h, a processor", "h, a processor-2"]


def test_what_changed_on_a_machine_is_told(make):
    text = hosts.write(members(make("a"), make("b", machine={"packages": {"numpy": "3"}})))
    assert "b against a: packages.numpy: 2 -&gt; 3" in text
    assert "against" not in hosts.write(members(make("c"), make("d", machine={"host": "x", "commit": "new"})))


def test_nothing_is_pooled(make, tmp_path):
    found = members(make("a"), make("b", "fast", machine={"host": "other"}))
    text = side_by_side.write(found, tmp_path)
    with open(next(tmp_path.glob("side-by-side-*.csv")), newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["quantity"] == "steady_frame"]
    assert [(row["variant"], round(float(row["value"]), 3), row["processes"]) for row in rows] == [
        ("cpp", 0.425, "6"), ("cpp", 0.125, "6"), ("numba", 0.85, "6"), ("numba", 0.25, "6"),
    ]  # fmt: skip
    shown = [row["steady frame"].partition(" \\[")[0] for row in report_tables.tables(text)[0]]
    assert shown == ["420", "120", "850", "250"] and "2.00" in text
    assert next(tmp_path.glob("side-by-side-*.svg")).exists()


def test_another_scene_is_not_beside(make, tmp_path):
    text = side_by_side.write(members(make("a"), make("b", scene_version="2")), tmp_path)
    assert "the content of the scene changed" in text and not list(tmp_path.glob("*.csv"))


def test_runs_with_nothing_in_common(make, make_run, record, tmp_path):
    other = make_run([record("cpp", n, scene="scenes/local.txt") for n in range(5)], name="other")
    assert side_by_side.write(members(make("a"), other), tmp_path) == ""


def test_numbers_of_the_study_are_found():
    headings = [
        "## Times (the study's table 4.1)",
        "### more",
        "## Next",
        "### mine, case = figure 3.1, an edge",
        "### The study's figure 3.1",
        "### y",
    ]
    text = "\n\n".join(
        f"{heading}\n\n{body}" for heading, body in zip(headings, ("body", "it", "no", "another", "x", ""), strict=True)
    )
    assert study_again.numbered(["## Summary\n\nfigure 4.2\n", text]) == {
        "table 4.1": "body\n\n### more\n\nit",
        "figure 3.1": "x",
    }


def test_every_number_is_there_or_why_not(make, record, tmp_path):
    parameters = record("cpp")["parameters"] | study.VARIABLES | {"region": "0,0,512,512"}
    case = [record("cpp", n, cell="all", scene=SCENE, parameters=parameters, point={"region": "all"}) for n in range(5)]
    runs = [make("needs"), make("comparison", records=case)]
    path = several.make(runs, tmp_path / "out")
    text = (tmp_path / "out" / "report.md").read_text("utf-8")
    parts = dict(part.split("\n", 1) for part in text.split("\n### ")[1:] if part[:5] in ("Table", "Figur"))
    assert [name.partition(":")[0].lower() for name in parts] == list(study.NUMBERED)
    times = next(body for name, body in parts.items() if name.startswith("Table 4.1"))
    assert "From [comparison](comparison/report.html)." in times and "](comparison/times-0" in times
    blocks = next(body for name, body in parts.items() if name.startswith("Figure 2.8"))
    assert "unavailable: none of these runs has it; experiments/launch-blocks.toml on a machine with a GPU" in blocks
    html = path.read_text("utf-8")
    assert path.name == "report.html" and html.count("<script") == 2 and "Plotly" not in html.partition("<script>")[0]
    assert (tmp_path / "out" / "needs" / "report.html").exists()
    assert several.check(runs, tmp_path / "out") == []
    (tmp_path / "out" / "needs" / "machine.csv").unlink()
    assert several.check(runs, tmp_path / "out") == ["needs/machine.csv is new"]


def test_a_packed_run_gives_the_report_of_its_folder(make, tmp_path):
    folder = make("a")
    several.make([folder], tmp_path / "out")
    packed.pack(folder, tmp_path / "a.tar.xz")
    assert several.check([tmp_path / "a.tar.xz"], tmp_path / "out") == []
    again = several.make([tmp_path / "a.tar.xz"], tmp_path / "again")
    assert again.read_bytes() == (tmp_path / "out" / "report.html").read_bytes()


def test_a_run_packed_without_its_pictures_says_so(make, tmp_path):
    packed.pack(make("a"), tmp_path / "a.tar.xz", pictures=False)
    several.make([tmp_path / "a.tar.xz"], tmp_path / "out")
    text = (tmp_path / "out" / "report.md").read_text("utf-8")
    told = "Pictures: unavailable: the pictures of this run were left out when it was packed"
    assert told in text.partition("## Not in this run")[2] and "(pictures-" not in text
    assert "largest error 0.75" in text, "their errors stay"


def test_a_run_packed_without_its_truths_says_so(make, tmp_path):
    folder = make("a")
    packed.pack(folder, tmp_path / "a.tar.xz", truths=False)
    with packed.opened(tmp_path / "a.tar.xz") as opened:
        names = {path.name for path in (opened / "pictures").iterdir()}
    assert names == {path.name for path in (folder / "pictures").iterdir() if not path.name.endswith(packed.TRUTHS)}
    several.make([tmp_path / "a.tar.xz"], tmp_path / "out")
    drawn = (tmp_path / "out" / "pictures-0-comparison.svg").read_text("utf-8")
    assert "the truths of this run" in drawn and "the pictures of this run" not in drawn


def test_pictures_named_after_figures_of_the_study(make_run, record, bad, tmp_path):
    def told(variant, case, **changes):
        named = f"{variant}-{case}"
        picture = {"picture": {"file": f"pictures/{named.replace(' ', '-')}.npy"}}
        return record(variant, cell=named, point={"case": case}, **{**picture, **changes})

    records = [
        told("cpp", "figure 3.10b, last"), told("cpp", "figure 3.2, a mesh"), told("numba", "figure 3.10b, last"),
        bad("cpp", "failed", "it broke", cell="x", point={"case": "figure 3.10a"}), told("cpp", "figure of mine"),
        told("numba", "figure 3.10a", agreement=None),
    ]  # fmt: skip
    found = gallery_figure.panels(loaded := results.load(make_run(records)))
    assert list(found) == ["3.2", "3.10"]
    assert [(title, cell and cell.variant) for title, cell, _ in found["3.10"]] == [("b: last", "cpp"), ("a", "numba")]
    text = gallery_figure.write(loaded, tmp_path)
    assert "### The study's figure 3.2\n" in text and (tmp_path / "gallery-3-10.svg").exists()
    (only,) = gallery_figure.panels(results.load(make_run(records[3:5], name="b"))).values()
    assert only == [("a", None, "failed: it broke")]


def test_without_such_pictures_there_is_no_section(load, record, tmp_path):
    assert gallery_figure.write(load([record("cpp")]), tmp_path) == ""
    assert not list(tmp_path.glob("gallery*"))
