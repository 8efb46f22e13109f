"""The chart of speed against accuracy: what is drawn, what each point tells, and what is said where nothing is."""

import csv
import itertools
import re

import pytest
from drawn_files import drawn_files
from made_up_errors import FACTS

from reports.accuracy import pareto, pareto_figure
from reports.paper import markdown, style
from reports.run import command


def test_a_floor_is_drawn_where_samples_no_longer_help(load, cell):
    def line(variant, errors, **more):
        return [
            told
            for n, size in zip((1, 2, 4, 8), errors, strict=True)
            for told in cell(variant, [n * n] * 6, size, sampler="jittered", samples=n, **more)
        ]

    told = [
        *line("cpp", (0.08, 0.03, 0.0201, 0.02), cutoff=0.01), *line("numba", (0.08, 0.03, 0.01, 0.0035), cutoff=0.01),
        *line("cpp", (0.08, 0.03, 0.0201, 0.02)), *line("numpy", (0.01, 1e-3, 3e-4, 3e-4), cutoff=0.01),
    ]  # fmt: skip
    (chart,) = pareto.charts(load(told, **FACTS))
    found = {(curve.variant, curve.family): pareto.bias_floor(chart, curve) for curve in chart.curves}
    cut = "jittered n × n, cut-off 0.01"
    assert found == {("cpp", cut): 0.02, ("numba", cut): None, ("cpp", "jittered n × n"): None, ("numpy", cut): None}


def test_the_section_holds_every_point_and_its_command(load, many, tmp_path):
    run = load(many, **FACTS)
    text = pareto_figure.write(run, tmp_path)
    local, mirrors = sorted(pareto.charts(run), key=lambda chart: chart.view.label)
    assert (local.view.label, mirrors.view.label) == ("local", "mirrors")
    for chart in (local, mirrors):
        for point in chart.front:
            line = next(line for line in text.splitlines() if line.startswith(f"| {point.number} | {point.name} |"))
            assert line.endswith(f"| `{command.of(run, point.cell)}` |")
    assert "- numba-cuda, one sample" not in text and "- numba-cuda: unsupported: has no sampler" in text
    assert "judge made the truth (depth 10). Errors are held against it at the centres of pixels at depth 10." in text
    assert "At 100 pixels computed in 60 digits the largest difference is 2.1e-13." in text
    assert "known to 0.00012 (RMS); below 4 times that, 0.00048, it cannot tell." in text
    assert "numpy; numba" in text.split("Not on any front")[1]
    for path, chart in ((tmp_path / "pareto-1-local.csv", local), (tmp_path / "pareto-0-mirrors.csv", mirrors)):
        with open(path, newline="") as file:
            rows = list(csv.DictReader(file))
        assert len(rows) == len(chart.view.cells)
        for row in rows:
            assert all(value or name in ("note",) for name, value in row.items()), row
            assert row["command"].startswith("rayrace render experiments/scenes/")
            assert row["measured_by"].startswith("rayrace run experiments/a.toml --only")
        assert sum(row["number"] != "NaN" for row in rows) == len(chart.front)


def test_every_point_of_the_drawing_tells_its_command(load, many, tmp_path):
    run = load(many, **FACTS)
    pareto_figure.write(run, tmp_path)
    for number, chart in enumerate(pareto.charts(run)):
        text = (tmp_path / f"pareto-{number}-{chart.view.label}.svg").read_text()
        found = dict(re.findall(r'<g id="method-(\d+)">\s*<title>(.*?)</title>', text))
        assert len(found) == len(chart.points) > 10
        for place, point in enumerate(chart.points):
            told = found[str(place)].replace("&amp;", "&")
            assert command.of(run, point.cell) in told and point.name in told
            assert told.startswith(f"{point.number}: ") == bool(point.number)


def test_twice_the_same_bytes(load, many, tmp_path):
    outs = tmp_path / "a", tmp_path / "b"
    for out in outs:
        out.mkdir()
        pareto_figure.write(load(many, name=f"run-{out.name}", **FACTS), out)
    found, again = (sorted(path.name for path in out.iterdir()) for out in outs)
    assert len(found) == 2 * (1 + len(drawn_files("one figure"))) and found == again
    for file in found:
        assert (outs[0] / file).read_bytes() == (outs[1] / file).read_bytes(), file


def shown(figure):
    """Every text of a figure and its box; matplotlib keeps ticks beyond the ends, which it does not draw."""
    figure.canvas.draw()
    texts = [*figure.texts, *(text for legend in figure.legends for text in legend.get_texts())]
    for axes in figure.axes:
        texts += [*axes.texts, axes.xaxis.label, axes.yaxis.label]
        for axis in (axes.xaxis, axes.yaxis):
            low, high = axis.get_view_interval()
            ticks = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
            texts += [tick.label1 for tick in ticks if low <= tick.get_loc() <= high]
    return [(text.get_text(), text.get_window_extent()) for text in texts if text.get_text().strip()]


@pytest.mark.parametrize("crowded", [False, True])
def test_no_two_texts_meet(load, many, cell, jittered, crowded):
    more = []
    for n in range(12 * crowded):  # a front of points that are close together, and float32 close to a visible step
        more += cell(
            "cpp", [0.01 * 1.04**n] * 6, 0.003 * 0.93**n, False, "scenes/local.txt", precision="float32", seed=n
        )
        more += jittered("cpp", 0.04 * 0.95**n, cutoff=2.0 ** -(4 + n))
    run = load([*many, *more], **FACTS)
    for chart in pareto.charts(run):
        with style.styled():
            figure = pareto_figure.draw(run, chart)
            boxes = shown(figure)
        assert len(boxes) > 20
        for (text, box), (other, beside) in itertools.combinations(boxes, 2):
            assert not box.padded(-2).overlaps(beside.padded(-2)), (text, other)
        for text, box in boxes:
            assert figure.bbox.contains(box.x0, box.y0) and figure.bbox.contains(box.x1, box.y1), text


def test_nothing_drawn_says_why(load, cell, tmp_path):
    told = [{**one, "error": {"unavailable": "no judge here"}} for n in (1, 2) for one in cell("cpp", [1], 0, seed=n)]
    text = pareto_figure.write(load(told, **FACTS), tmp_path)
    assert "unavailable: no method has both a time and an error" in text and "no judge here" in text


def test_commands_in_tables_stay_commands():
    assert markdown.code("a | b") == "`a \\| b`"
    assert markdown.code("echo `x`") == "`` echo `x` ``"
