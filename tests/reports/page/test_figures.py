"""Every figure of a report by eye, as far as a program has one: no text is cut off, none lies over another."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from figure_lint import faults, lint

from harness.store import packed
from reports.page import report
from reports.paper import style

RUNS = sorted((Path(__file__).parents[3] / "results" / "reference").glob("*/*.tar.xz"))


@pytest.mark.slow
@pytest.mark.parametrize("run", RUNS, ids=packed.name)
def test_the_figures_of_reference_runs_have_no_fault(run, tmp_path):
    with packed.opened(run) as folder, lint() as found:
        report.write(folder, tmp_path / "report")
    assert len(list((tmp_path / "report").glob("*.png")))
    assert found == {}


@pytest.mark.parametrize(
    ("spoil", "fault"),
    [
        (lambda figure, axes: axes.set_ylabel("far too long for an axis " * 4), "clipped"),
        (lambda figure, axes: [axes.text(3e5, 3, word) for word in ("one", "two")], "overlapping"),
        (lambda figure, axes: figure.add_axes((0.9, 0.9, 0.05, 0.05), xticks=[], yticks=[]), "empty"),
        (lambda figure, axes: figure.set_size_inches(4, 30), "larger than a page"),
        (lambda figure, axes: axes.set_xticks([1e5, 1e6], ["100000", "1e+06"]), "two ways"),
        (lambda figure, axes: (axes.set_xticks([1e5], ["100000"]), axes.set_xticks([], minor=True)), "one number"),
    ],
)
def test_each_fault_is_found(spoil, fault):
    with style.styled():
        figure, axes = plt.subplots(figsize=(4, 3), layout="constrained")
        axes.plot(np.geomspace(1e5, 1e6, 5), [1, 2, 3, 4, 5])
        axes.set(xscale="log", xlabel="objects")
        style.log_ticks(axes.xaxis, narrow=True)
        assert faults(figure) == []
        spoil(figure, axes)
        assert any(one.startswith(fault) or fault in one for one in faults(figure))
    plt.close(figure)


def test_what_is_not_drawn_has_no_fault():
    """Hidden axes, and ticks beyond the ends of a logarithmic axis, which matplotlib keeps."""
    figure, (axes, hidden) = plt.subplots(1, 2, figsize=(4, 3), layout="constrained")
    axes.plot([1, 1e-15], [1, 2])
    axes.set_xscale("log")
    axes.set_xlim(1, 1e-15)
    axes.set_xticks([1, 1e-15, 1e-30], ["1", "mild", "extreme"])
    axes.set_xlim(1, 1e-15)
    hidden.set_visible(False)
    assert faults(figure) == []
    plt.close(figure)


def test_an_axis_with_a_0_has_it_and_nothing_below():
    """Errors of an experiment that are 0, beside some that are not."""
    figure, axes = plt.subplots()
    axes.plot([1, 2, 3], [0, 1e-7, 1e-2])
    axes.set_yscale("symlog", linthresh=1e-7)
    axes.set_ylim(-1e-8, 1e-1)
    style.log_ticks(axes.yaxis)
    figure.canvas.draw()
    labels = {tick: label.get_text() for tick, label in zip(axes.get_yticks(), axes.get_yticklabels(), strict=True)}
    assert labels[0] == "0" and labels[1e-2] == "10⁻²"
    assert not any(text for tick, text in labels.items() if tick < 0)
    assert not any(label.get_text() for label in axes.get_yticklabels(minor=True))
    plt.close(figure)
