"""Draws the time of a frame against the number of objects, with a hierarchy and without, and the time to build it."""

import itertools
from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.lines import Line2D

from harness.statistics.statistics import Estimate
from reports.paper import style
from reports.run.results import Missing, Results

MARKERS = "os^vDP"  # of the lines of one variant
WIDTH, HEIGHT, WIDEST = 3.0, 3.4, 8.0  # inches of a panel, of a figure
KINDS = (
    Line2D([], [], color="#555555", ls="--", lw=1.2, label="frame, accel = none"),
    Line2D([], [], color="#555555", ls="-", lw=1.2, label="frame, accel = bvh"),
    Line2D([], [], color="#555555", ls="-", lw=0.5, label="build, once"),
    Line2D([], [], color="black", ls="", marker="*", ms=7, label="break-even"),
)


def draw(results: Results, crossings: list[tuple]):
    """Draws a panel for each kind of scene. crossings: lines, each with its BreakEven or Missing."""
    scenes = list(dict.fromkeys(line.scene for line, _ in crossings))
    figure, panels = plt.subplots(
        1, len(scenes), figsize=(min(max(4.2, WIDTH * len(scenes)), WIDEST), HEIGHT), sharey=True, squeeze=False,
        layout="constrained",
    )  # fmt: skip
    looks = _looks(results, [line for line, _ in crossings])
    for scene, axes in zip(scenes, panels[0], strict=True):
        for line, crossing in crossings:
            if line.scene == scene:
                _line(axes, line, crossing, *looks[line.label])
        axes.set(xscale="log", yscale="log", xlabel="objects", title=Path(scene).stem)
        for axis in (axes.xaxis, axes.yaxis):
            style.log_ticks(axis)
        axes.grid()
    panels[0][0].set_ylabel("time (ms)")
    variants = [
        Line2D([], [], color=shade, marker=marker, ms=3.5, lw=1.2, label=label)
        for label, (shade, marker) in looks.items()
    ]
    figure.legend(handles=[*variants, *KINDS], loc="outside lower center", ncols=4, fontsize=6)
    return figure


def _looks(results: Results, lines: list) -> dict[str, tuple[str, str]]:
    """Returns for each label the colour of its variant and a marker of its own among that variant's lines."""
    looks: dict[str, tuple[str, str]] = {}
    markers = {line.variant: itertools.cycle(MARKERS) for line in lines}
    for line in lines:
        if line.label not in looks:
            looks[line.label] = style.colour(line.variant, results.variants), next(markers[line.variant])
    return looks


def _line(axes, line, crossing, shade: str, marker: str) -> None:
    """Draws both times and the build of a line, and where the times cross."""
    _curve(axes, [(point.objects, point.built) for point in line.points], shade, "", ls="-", lw=0.5)
    for kind, dashes in (("none", "--"), ("bvh", "-")):
        _curve(axes, [(point.objects, point.frames[kind]) for point in line.points], shade, marker, ls=dashes, lw=1.2)
    if not isinstance(crossing, Missing):
        axes.plot(crossing.objects, 1e3 * crossing.seconds, "*", color=shade, mec="black", mew=0.5, ms=8, zorder=5)


def _curve(axes, points: list[tuple[int, Estimate | Missing]], shade: str, marker: str, **look) -> None:
    """Draws the known values in ms against objects, with intervals."""
    values = [(count, value) for count, value in points if isinstance(value, Estimate)]
    axes.plot(
        [n for n, _ in values], [1e3 * value.value for _, value in values], color=shade, marker=marker, ms=3, **look
    )
    for count, value in values:
        if value.low is not None:
            axes.plot([count, count], [1e3 * value.low, 1e3 * value.high], color=shade, lw=0.8)
