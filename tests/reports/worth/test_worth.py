"""What a scene needs, of a made-up run: errors, times and verdicts that can be checked by hand."""

import csv

import matplotlib.pyplot as plt
import numpy as np
import pytest
from figure_lint import faults

from reports.accuracy import pareto
from reports.paper import style
from reports.run import command, naming, reduced
from reports.run.cell import Missing
from reports.times import headline
from reports.worth import figure, worth

# Left out, error, time over that of the whole, proof, and whether the picture changes.
THINGS = {
    "nothing": (0.01, 1.0, "", 0.0),
    "shadows": (0.05, 0.5, "", 0.1),
    "light 2": (0.01, 0.9, "its colour is black", 0.0),
    "the sphere of line 9": (0.01, 1.2, "", 0.0),
}


@pytest.fixture
def rows(record):
    """A function that gives 5 rounds of `variants`, in which each takes THINGS' times as long as the whole."""

    def make(variants=("cpp",), point=None, parameters=None):
        found = []
        for variant in variants:
            for what, (rmse, times, proof, _) in THINGS.items():
                key = f"{variant}-{'-'.join(what.split())}-{point or ''}"
                for number in range(5):
                    seconds = times * (0.2 + 0.01 * number)
                    made = record(variant, number, frames=[seconds] * 3, cell=key, series=None)
                    made["point"] = {**({"precision": point} if point else {}), "without": what}
                    made["parameters"] = {**made["parameters"], **(parameters or {})}
                    made["error"] = {**made["error"], "rmse": rmse, "change": 1e-9}
                    made["picture"] = {"file": f"pictures/{key}.npy"}
                    made["scene_version"] = what if what.startswith(("light", "the sphere")) else "whole"
                    if what != "nothing":
                        made["without"] = {"kind": "a kind", "proof": proof}
                    found.append(made)
        return found

    return make


@pytest.fixture
def loaded(load, rows):
    def make(*told, **more):
        pictures = {}
        for row in rows(*told, **more):
            change = THINGS[row["point"]["without"]][3]
            pictures[row["picture"]["file"]] = np.linspace(0, 1, 48).reshape(4, 4, 3) + 0.01 + change
        return load(rows(*told, **more), files=pictures)

    return make


def the(run):
    wholes = reduced.wholes(run)
    (whole,) = set(wholes.values())
    return whole, {row.name: row for row in worth.rows(run, whole, list(wholes))}


def test_each_thing_beside_the_whole_scene(loaded):
    whole, found = the(loaded())
    assert list(found) == ["shadows", "light 2", "the sphere of line 9"] and not reduced.without(whole)
    assert found["shadows"].time.value == pytest.approx(0.5) and found["shadows"].time.processes == 5
    assert found["shadows"].change.pixels == 1 and found["shadows"].change.largest == pytest.approx(0.1)
    assert found["shadows"].change.added == pytest.approx(0.11**2 - 0.01**2)
    assert {name: row.verdict for name, row in found.items()} == {
        "shadows": "error grows",
        "light 2": "needs none of it (proved): its colour is black",
        "the sphere of line 9": "changes no pixel (measured)",
    }


def test_the_section_and_its_file(loaded, tmp_path):
    text = worth.write(loaded(), tmp_path)
    assert text.startswith("## What the scene needs\n\n### comparison: cpp\n\n3 things were left out, one at a time; ")
    assert "1 of them contributes nothing (proved); without 1 no pixel changes (measured)" in text
    assert "the most time is saved without shadows: 0.50" in text
    with open(tmp_path / "what-the-scene-needs.csv", encoding="utf-8") as file:
        told = {row["without"]: row for row in csv.DictReader(file)}
    assert float(told["shadows"]["time_ratio"]) == pytest.approx(0.5) and told["shadows"]["kind"] == "a kind"
    assert (tmp_path / "what-the-scene-needs-0.png").exists()
    assert (tmp_path / "what-the-scene-needs-0-sheet.png").exists()


def test_a_run_that_leaves_nothing_out_has_no_section(load, record, tmp_path):
    assert worth.write(load([record("cpp")]), tmp_path) == "" and not list(tmp_path.glob("*.csv"))


def test_without_a_picture_it_is_unavailable(load, rows, bad, tmp_path):
    told = [row for row in rows() if row["point"]["without"] != "shadows"]
    why = "has no vector on"
    told += [
        bad("cpp", "unsupported", why, cell="lanes", point={"without": "lanes"}, without={"kind": "k", "proof": ""})
    ]
    run = load(told)
    _, found = the(run)
    assert found["lanes"].verdict == f"unavailable: unsupported: {why}"
    text = worth.write(run, tmp_path)
    assert "; 1 is unavailable" in text and f"unsupported: {why}" in text


def test_proved_is_told_apart_from_measured_in_the_chart(loaded):
    _, found = the(loaded())
    drawn = figure.draw([row.record() for row in found.values()], 0.01)
    errors = [bar.get_facecolor() for bar in drawn.axes[0].patches]
    assert len(set(errors)) == 3
    assert [text.get_text() for text in drawn.legends[0].get_texts()] == list(figure.KINDS)


@pytest.mark.parametrize("count", [1, 9, 60])
def test_long_names_fit(count):
    name = "constant Fresnel share, no refraction, of the material of the ellipsoid of line 123 and 45 more"
    time = {"ratio": 0.9, "low": 0.8, "high": 1.0, "verdict": "faster"}
    told = {"left_out": name, "proof": "", "pixels": 0.1, "error": {"rmse": 0.0123}, "time": time}
    with style.styled():
        drawn = figure.draw([told] * count, 0.01)
        try:
            assert not faults(drawn)
            assert drawn.axes[0].get_position().width > 0.3
        finally:
            plt.close(drawn)


def test_models_and_methods_are_on_one_front(load, rows):
    told = rows(point="float64") + rows(point="float32", parameters={"precision": "float32"})
    run = load(told)
    (chart,) = pareto.charts(run)
    assert len(chart.points) == 8 and chart.view.title == "comparison"
    names = {point.name for point in chart.points}
    assert {"cpp", "cpp, without shadows", "cpp, float32, without light 2"} <= names
    assert not any(point.unbiased for point in chart.points if "without" in point.name)


def test_a_model_without_a_part_of_its_scene_has_no_command_that_renders_it(load, rows):
    run = load(rows())
    told = {cell.swept["without"]: command.of(run, cell) for cell in run.cells}
    assert told["nothing"] == told["shadows"] and "-r cpp" in told["nothing"]
    assert isinstance(told["light 2"], Missing) and "no file has the scene without light 2" in str(told["light 2"])


def test_places_are_named_and_the_whole_scene_is_raced(load, rows):
    run = load(rows(("cpp", "numpy")))
    names = [naming.called(run, place) for place in run.places]
    assert names == ["comparison", *(f"comparison, without {what}" for what in list(THINGS)[1:])]
    assert {bar.cell.swept["without"] for bar in headline.of(run).bars} == {"nothing"}
