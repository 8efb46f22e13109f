"""The chart for newcomers: which methods are worth their time, and that nothing covers their names."""

import itertools

import numpy as np
import pytest
from drawn_files import drawn_files
from made_up_errors import FACTS

from reports.accuracy import front_figure, pareto
from reports.paper import style


def test_a_method_is_worth_its_time_if_it_reduces_the_error_by_a_tenth(load, cell):
    errors = {1: 0.08, 2: 0.09, 3: 0.073, 4: 0.0719, 5: 0.04, 6: 1.3e-4, 7: 1e-4}
    told = [one for seed, error in errors.items() for one in cell("cpp", [seed] * 6, error, seed=seed)]
    (chart,) = pareto.charts(load(told, **FACTS))
    assert chart.resolution > 1.3e-4  # the truth cannot tell the last two apart
    kept = front_figure.worth(chart, chart.points)
    assert [point.cell.parameters["seed"] for point in kept] == [1, 4, 5, 6]


def test_whatever_the_methods_the_best_are_kept(load, cell):
    print("seed 11")
    rng = np.random.default_rng(11)
    told = [one for n in range(60) for one in cell("cpp", [rng.lognormal()] * 6, 0.05 * rng.lognormal(), seed=n)]
    (chart,) = pareto.charts(load(told, **FACTS))
    kept = front_figure.worth(chart, chart.points)
    assert kept[0].time.value == min(point.time.value for point in chart.points)
    for point in chart.points:  # none is both quicker and, by more than a tenth, nearer than all that are no slower
        no_slower = [one for one in kept if one.time.value <= point.time.value]
        assert min(one.error for one in no_slower) <= point.error / pareto.GAIN


@pytest.mark.parametrize("crowded", [False, True])
def test_names_are_inside_and_apart(load, many, cell, crowded):
    more = []
    for n in range(12 * crowded):
        more += cell("cpp", [0.01 * 1.1**n] * 6, 0.003 * 0.85**n, False, "scenes/local.txt", seed=n)
    run = load([*many, *more], **FACTS)
    for chart in pareto.charts(run):
        with style.styled():
            figure = front_figure.draw(run, chart)
            figure.canvas.draw()
        (axes,) = figure.axes
        frame = axes.get_window_extent()
        boxes = [(text.get_text(), text.get_window_extent()) for text in axes.texts]
        variants = {point.cell.variant for point in chart.points}
        assert variants <= {text for text, _ in boxes} and len(boxes) > len(variants) + 2
        for (text, box), (other, beside) in itertools.combinations(boxes, 2):
            assert not box.padded(-1).overlaps(beside.padded(-1)), (text, other)
        for text, box in boxes:
            assert frame.contains(box.x0, box.y0) and frame.contains(box.x1, box.y1), text


def test_the_lines_are_the_methods_of_a_renderer_that_are_worth_their_time(load, many):
    run = load(many, **FACTS)
    for chart in pareto.charts(run):
        with style.styled():
            figure = front_figure.draw(run, chart)
        lines = [line.get_xydata() for line in figure.axes[0].lines if line.get_linestyle() == "-"]
        expected = []
        for variant in run.variants:
            mine = front_figure.worth(chart, [point for point in chart.points if point.cell.variant == variant])
            if mine:
                expected.append([(max(point.error, chart.resolution), point.time.value) for point in mine])
        assert len(lines) == len(expected) > 1
        for line, points in zip(lines, expected, strict=True):
            assert line == pytest.approx(np.array(points))


def test_a_section_has_a_chart_a_view_and_none_without_errors(load, many, cell, tmp_path):
    run, out = load(many, **FACTS), tmp_path / "out"
    out.mkdir()
    text = front_figure.write(run, out)
    assert text.startswith("## How long") and "](front-0-mirrors.png)" in text and "](front-1-local.png)" in text
    assert sorted(path.name for path in out.iterdir()) == drawn_files("front-0-mirrors", "front-1-local")
    told = [{**one, "error": {"unavailable": "no judge"}} for n in (1, 2) for one in cell("cpp", [1], 0, seed=n)]
    assert front_figure.write(load(told, name="other", **FACTS), tmp_path / "none") == ""
