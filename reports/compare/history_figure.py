"""Draws the history of a renderer: instructions and times by commit, with their steps."""

import matplotlib.pyplot as plt
from matplotlib.figure import Figure

from harness.statistics.digits import change
from reports.compare.history import Point, Step
from reports.paper import style
from reports.run.missing import Missing

COUNT, TIME, STEP = "#0072B2", "#009E73", "#D55E00"
HASH = 7  # digits of a commit below the axis
MOST = 40  # commits with a name below the axis


def draw(points: list[Point], steps: list[Step]) -> Figure:
    """Draws Points of one place, in the order of the commits, over the first that has a value."""
    figure, axes = plt.subplots(figsize=(7.4, 3.2), layout="constrained")
    places = {point.commit: number for number, point in enumerate(points)}
    counted = [point for point in points if not isinstance(point.instructions, Missing)]
    if counted:
        shares = [point.instructions / counted[0].instructions for point in counted]
        axes.plot([places[p.commit] for p in counted], shares, "o-", color=COUNT, ms=4, label="instructions")
    timed = [point for point in points if not isinstance(point.time, Missing)]
    if timed:
        first = timed[0].time.value
        at = [places[point.commit] + 0.15 for point in timed]
        values = [point.time.value / first for point in timed]
        ends = [[v - (p.time.low or p.time.value) / first, (p.time.high or p.time.value) / first - v]
                for v, p in zip(values, timed, strict=True)]  # fmt: skip
        bars = list(zip(*ends, strict=True))
        axes.errorbar(at, values, bars, fmt="s", color=TIME, ms=3, lw=0.8, label="time, 95 % interval")
    for point in points:
        if isinstance(point.instructions, Missing) and isinstance(point.time, Missing):
            axes.plot(places[point.commit], 1, "x", color="#888888", ms=5)
    for step in steps:
        axes.axvline(places[step.after.commit] - 0.5, color=STEP, lw=1, ls="--")
        axes.text(
            places[step.after.commit] - 0.5, 1.01, change(step.ratio), color=STEP, fontsize=7,
            ha="center", transform=axes.get_xaxis_transform(),
        )  # fmt: skip
    every = -(-len(points) // MOST)
    names = points[::every]
    axes.set_xticks([places[point.commit] for point in names], [point.commit[:HASH] for point in names], rotation=90)
    axes.set_ylabel("over the first commit")
    axes.grid(axis="y")
    if counted or timed:
        axes.legend(loc="best")
    style.entitle(figure, f"{points[0].place}\n")
    return figure
